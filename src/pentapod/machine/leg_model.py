"""LegModel: what the drive of a leg is told so that the leg has the length that the geometry asks for.

Readings are what robots and programs know; commands are what a drive counts. They differ by

- the turn of a universal joint about its leg, which turns the nut on the screw: length = travel + lead/2π · turn;
- the temperature of the screw: length = zero + (travel − zero) (1 + expansion · (temperature − reference));
- errors of the pitch, a table: travel = command + error(command);
- backlash, half of it to the side from which the leg comes.

Each step has an exact inverse; that of the turn, which depends on the pose, is a fixed point that a handful of rounds
finds to rounding. Commands are made where posts are written, and nowhere before.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.keys import Key, check_fields
from pentapod.base.values import Value
from pentapod.kinematics.robot import Poses, Robot
from pentapod.machine.calibration.digest import digest_of
from pentapod.machine.fields import LEG_AXES, LEGS, PER_LEG, each_leg, per_leg

NO_AXIS = [0.0, 0.0, 0.0]


@dataclass(frozen=True)
class CommandOptions:
    """rounds: of the fixed point, at most; settled: metres, change of a reading that ends it.

    steepest: error of the pitch over travel from which a table cannot be right.
    """

    rounds: int = 30
    settled: float = 1e-13
    steepest: float = 0.01


OPTIONS = CommandOptions()


@dataclass(frozen=True, eq=False)
class LegModel(Value):
    """Screws, temperatures, pitch errors and backlash of the legs. Arrays (n,), SI; scalars hold for all legs.

    lead: metres per turn, positive where the leg grows when its platform end turns counter-clockwise against its base
    end, seen from the platform; first_axes (n, 3): of the base joints' universal joints, fixed to the base, machine
    frame. expansion: 1/K; temperature, reference: °C. pitch_at (K,): commands, metres, ascending; pitch_errors (n, K):
    travel minus command there, linear between them, constant beyond. backlash: metres.

    Raises MachineError: wrong counts, a lead without axis, a table that does not ascend or is too steep, numbers out of
    range.
    """

    lead: Annotated[Floats, Key("mm", "lead of the screw, 0: no coupling", "screw_lead", kind=PER_LEG)] = field(
        default_factory=each_leg(0.0)
    )
    first_axes: Annotated[
        Floats, Key("", "axis of the base's universal joint that is fixed to the base", "first_axis", kind=LEG_AXES)
    ] = field(default_factory=each_leg(NO_AXIS))
    expansion: Annotated[
        Floats, Key("", "thermal expansion of the screw, 1/K; steel 11.5e-6", "expansion_per_k", kind=PER_LEG)
    ] = field(default_factory=each_leg(0.0))
    temperature: Annotated[Floats, Key("", "of each screw, degrees Celsius", "temperature_c", kind=PER_LEG)] = field(
        default_factory=each_leg(20.0)
    )
    reference: Annotated[float, Key("", "temperature of the calibration, degrees Celsius", "reference_c")] = 20.0
    pitch_at: Annotated[Floats, Key("mm", "ascending commands of the table of pitch errors", kind=list[float])] = field(
        default_factory=lambda: np.zeros(0)
    )
    pitch_errors: Annotated[
        Floats, Key("mm", "travel minus command there, a list for each leg", "pitch_error", kind=list[list[float]])
    ] = field(default_factory=lambda: np.zeros((LEGS, 0)))
    backlash: Annotated[Floats, Key("mm", "play of the drive at reversals", kind=PER_LEG, ge=0.0)] = field(
        default_factory=each_leg(0.0)
    )

    def __post_init__(self) -> None:
        per_leg(self, "lead", "expansion", "temperature", "backlash", first_axes=3)
        check_fields(self, MachineError)
        lengths = np.linalg.norm(self.first_axes, axis=1)
        wrong = (self.lead != 0.0) & (np.abs(lengths - 1.0) > 1e-3)
        if wrong.any():
            leg = int(np.argmax(wrong))
            raise MachineError(
                f"leg {leg + 1}: a screw's lead needs the fixed axis of its universal joint", key="first_axes",
                value=self.first_axes[leg].tolist(), expected="unit vectors [x, y, z]",
            )  # fmt: skip
        self._check_table()

    def _check_table(self) -> None:
        """Keep the table as read-only arrays. Raises MachineError where it is none."""
        at = np.array(self.pitch_at, dtype=np.float64)
        count = len(self.lead)
        try:
            errors = np.array(self.pitch_errors, dtype=np.float64)
        except ValueError:  # lists of unequal lengths
            errors = np.zeros(1)
        errors = np.zeros((count, 0)) if not errors.size else errors
        if at.ndim != 1 or errors.shape != (count, len(at)):
            expected = f"{count} lists of {len(at)} numbers, as pitch_at_mm has"
            raise MachineError("the table of pitch errors has another shape", key="pitch_errors", expected=expected)
        if not (np.isfinite(at).all() and np.isfinite(errors).all() and (np.diff(at) > 0.0).all()):
            raise MachineError("the commands of the table do not ascend", key="pitch_at", value=at.tolist())
        if len(at) > 1 and (np.abs(np.diff(errors)) > OPTIONS.steepest * np.diff(at)).any():
            expected = f"errors that change by at most {OPTIONS.steepest:.0%} of the way"
            raise MachineError("the pitch errors are too steep", key="pitch_errors", expected=expected)
        for array in (at, errors):
            array.flags.writeable = False
        set_frozen(self, pitch_at=at, pitch_errors=errors)

    @property
    def digest(self) -> str:
        """16 hexadecimal digits of a SHA-256 over all numbers; "" where commands are readings."""
        numbers = {item.name: getattr(self, item.name) for item in fields(self)}
        return digest_of(numbers) if self.is_needed else ""

    @property
    def without_backlash(self) -> LegModel:
        """The same model for single poses, of which nobody knows from which side the drives came."""
        return replace(self, backlash=np.zeros_like(self.backlash))

    @property
    def is_needed(self) -> bool:
        """Whether commands differ from readings at all."""
        warm = (self.expansion * (self.temperature - self.reference)).any()
        return bool(self.lead.any() or warm or self.pitch_errors.any() or self.backlash.any())

    def commands(self, robot: Robot, legs: ArrayLike, branch: ArrayLike, home: Poses) -> Floats:
        """Return what the drives are told (N, n) so that the legs read `legs` (N, n), in the order of the motion.

        home: a pose (3,), (3,) in which the screws count as not turned. NaN where readings have no pose in the branch.
        """
        readings = np.asarray(legs, dtype=np.float64)
        travel = readings - self._turned(robot, readings, branch, home)
        cold = robot_zeros(robot) + (travel - robot_zeros(robot)) / self._growth
        told = cold.copy()
        for leg in range(cold.shape[1] if len(self.pitch_at) else 0):
            at, error = self.pitch_at, self.pitch_errors[leg]
            inside = np.interp(cold[:, leg], at + error, error)  # linear in the command, so in the travel
            told[:, leg] -= inside
        return told + 0.5 * self.backlash * _sides(told)

    def readings(self, robot: Robot, commands: ArrayLike, branch: ArrayLike, home: Poses) -> Floats:
        """Return what the legs read (N, n) where the drives were told `commands` (N, n): the inverse of `commands`."""
        told = self._without_backlash(np.asarray(commands, dtype=np.float64))
        cold = told.copy()
        for leg in range(told.shape[1] if len(self.pitch_at) else 0):
            cold[:, leg] += np.interp(told[:, leg], self.pitch_at, self.pitch_errors[leg])
        travel = robot_zeros(robot) + (cold - robot_zeros(robot)) * self._growth
        legs = travel
        for _ in range(OPTIONS.rounds if self.lead.any() else 0):
            before, legs = legs, travel + self._turned(robot, legs, branch, home)
            if not np.nanmax(np.abs(legs - before), initial=0.0) > OPTIONS.settled:
                break
        return legs

    @property
    def _growth(self) -> Floats:
        return 1.0 + self.expansion * (self.temperature - self.reference)

    def _turned(self, robot: Robot, legs: Floats, branch: ArrayLike, home: Poses) -> Floats:
        """Return by how much screws make the legs longer (N, n) as their joints turn from the home pose."""
        if not self.lead.any():
            return np.zeros_like(legs)
        p, i = robot.pose(legs, branch)
        turn = self.turns(robot, (p, i)) - self.turns(robot, (home[0][None], home[1][None]))
        turn = np.remainder(turn + np.pi, 2.0 * np.pi) - np.pi
        return self.lead / (2.0 * np.pi) * turn

    def turns(self, robot: Robot, poses: Poses) -> Floats:
        """Return the angles (N, n) about each leg from its base joint's cross to its platform joint's, radians.

        The cross of a universal joint is square to the leg and to the axis that is fixed: in the base `first_axes`, in
        the platform the tool's axis.
        """
        p, i = poses
        vectors = robot.leg_vectors(p, i)
        along = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
        base, platform = np.cross(self.first_axes, along), np.cross(i[:, None], along)
        sine = np.einsum("nkc,nkc->nk", along, np.cross(base, platform))
        return np.arctan2(sine, np.einsum("nkc,nkc->nk", base, platform))

    def _without_backlash(self, commands: Floats) -> Floats:
        """Return commands without the half of the backlash that was added: from row to row, as the side is known."""
        if not self.backlash.any():
            return commands.copy()
        half, told = 0.5 * self.backlash, np.empty_like(commands)
        side: Floats = np.ones(commands.shape[1])
        for row, value in enumerate(commands):
            if row:
                up: Bools = value - half > told[row - 1]
                down: Bools = value + half < told[row - 1]
                side = np.where(up, 1.0, np.where(down, -1.0, side))
                told[row] = np.where(up | down, value - side * half, told[row - 1])
            else:
                told[row] = value - half
        return told


def robot_zeros(robot: Robot) -> Floats:
    """Return the zeros of a robot's scales (n,), metres; 0 where it knows none."""
    return np.asarray(getattr(robot, "zeros", np.zeros(robot.n_legs)), dtype=np.float64)


def _sides(told: Floats) -> Floats:
    """Return from which side each leg comes in each row (N, n): +1 where it grows, and before it first moves."""
    moves = np.sign(np.diff(told, axis=0, prepend=told[:1]))
    moves[0] = 1.0
    rows = np.maximum.accumulate(np.where(moves != 0.0, np.arange(len(told))[:, None], 0), axis=0)
    return np.take_along_axis(moves, rows, axis=0)
