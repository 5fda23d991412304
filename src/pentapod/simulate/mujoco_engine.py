"""Rigid-body simulation: MuJoCo plays a program on the model of `mjcf`, which shares no kinematics with pentapod."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.display import load_extra
from pentapod.base.errors import ArrayError
from pentapod.base.progress import Progress, silent
from pentapod.base.refusal import Refusal, stage
from pentapod.base.values import Result
from pentapod.kinematics.families.as_built import AsBuiltPentapod, as_pentapod
from pentapod.kinematics.robot import Robot
from pentapod.machine.rigid_bodies.frames import steps_in
from pentapod.machine.rigid_bodies.mjcf import mjcf
from pentapod.simulate.forces import leg_loads
from pentapod.simulate.measures import Measure
from pentapod.simulate.reference import Played, Reference


@dataclass(frozen=True)
class PhysicsOptions:
    """Options of the rigid-body simulation."""

    rest: float = 0.3
    """Seconds at rest before the start, until the drives carry the weight."""
    report_rows: int = 500
    """Rows between two reports of progress."""


DEFAULTS = PhysicsOptions()


@dataclass(frozen=True, eq=False)
class Physics(Result):
    """A program as MuJoCo played it.

    leg_forces (N, n): axial forces of the legs on the platform joints, newtons, a push is positive; the drives' forces
    (`played.forces`) also accelerate motor and screw. closure (N,): the largest gap of the closed loops, metres, a
    measure of how rigid the simulated joints are.
    """

    played: Played
    leg_forces: Floats
    closure: Floats

    def __post_init__(self) -> None:
        set_frozen(
            self,
            leg_forces=frozen(self.leg_forces, "leg_forces", (None, None)),
            closure=frozen(self.closure, "closure", (None,)),
        )

    @property
    def measures(self) -> tuple[Measure, ...]:
        """Measures beside the tool's errors."""
        return (
            Measure("closure error", "mm", 1e3 * self.closure, "largest gap of the loops"),
            Measure("leg force", "N", np.abs(self.leg_forces).max(axis=1), "push or pull of any leg"),
        )


@dataclass(frozen=True, eq=False)
class Plant(Result):
    """The machine as built at the start of a program. xml: as MJCF; position, direction (3,): its pose."""

    xml: str
    position: Floats
    direction: Floats


def load_mujoco() -> Any:
    """Return the module mujoco. Raises InputError where it is not installed."""
    return load_extra("mujoco", "sim", "this engine needs MuJoCo", key="mujoco")


def plant(
    reference: Reference,
    *,
    base_errors: ArrayLike = 0.0,
    offset_errors: ArrayLike = 0.0,
    true: Robot | None = None,
) -> Plant | Refusal:
    """Return the machine as MJCF, with the leg lengths of the program's first row; MuJoCo itself is not needed.

    base_errors (n, 3) and offset_errors (n,): deviations of the real joints of a linear pentapod from the machine, as
    designed or as its calibration has it, metres, or one number for all. true: the machine that plays, where it is
    known: it takes the place of the reference's, and the errors are added to it. A Refusal says that the real machine
    has no proven pose there. Raises MachineError for errors of another robot.
    """
    program, machine = reference.program, reference.machine
    real: Robot = machine.robot if true is None else true
    if not real.arms.any() or np.any(base_errors) or np.any(offset_errors):
        built = as_pentapod(real, "the rigid-body model with errors")
        real = AsBuiltPentapod.of(built, base_errors=base_errors, offset_errors=offset_errors)
    position, direction = real.pose(program.legs[0], program.component)
    if not np.isfinite(position).all():
        return Refusal("simulation", "the machine with these errors has no proven pose at the program's start")
    return Plant(mjcf(machine, real, position, direction, period=program.period), position, direction)


@stage
def simulate_mujoco(
    reference: Reference, as_built: Plant, *, tip_forces: ArrayLike = 0.0, progress: Progress = silent
) -> Physics | Refusal:
    """Return the motion of a machine in MuJoCo that plays a program.

    tip_forces (N, 3), or one for all rows: newtons on the tip, machine frame. A Refusal says that the simulation
    diverged. Raises InputError where MuJoCo is missing, ArrayError for forces of a wrong shape.
    """
    mujoco = load_mujoco()
    # MuJoCo would write warnings to a file in the working folder; it counts them too, and they become a refusal.
    mujoco.set_mju_user_warning(lambda _warning: None)
    try:
        return _run(mujoco, reference, as_built, tip_forces, progress)
    finally:
        mujoco.set_mju_user_warning(None)


def _run(
    mujoco: Any, reference: Reference, as_built: Plant, tip_forces: ArrayLike, progress: Progress
) -> Physics | Refusal:
    program, machine = reference.program, reference.machine
    (rows, legs), parts = program.legs.shape, steps_in(program.period)
    model = mujoco.MjModel.from_xml_string(as_built.xml)
    data = mujoco.MjData(model)
    try:
        force = np.broadcast_to(np.asarray(tip_forces, dtype=np.float64), (rows, 3))
    except ValueError as error:
        raise ArrayError("wrong shape", key="tip_forces", value=np.shape(tip_forces), expected="(rows, 3)") from error
    body = model.body("platform").id
    lever = (machine.tool_length - model.body_ipos[body][2]) * reference.directions[::2]
    wrench = np.concatenate([force, np.cross(lever, force)], axis=1)
    commands, at_rest = _commands(reference, parts), np.zeros(legs)
    drives = _Drives(reference, model, data)

    def diverged() -> bool:
        bad = data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number or not np.isfinite(data.qpos).all()
        return bool(bad)

    data.xfrc_applied[body] = wrench[0]
    for _ in range(int(np.ceil(DEFAULTS.rest / model.opt.timestep))):
        drives.set(program.legs[0], at_rest, at_rest, commands[3][0])
        mujoco.mj_step(model, data)
    numbers = range(1, legs + 1)
    names = ("tip", *(f"rod{leg}" for leg in numbers), *(f"platform{leg}" for leg in numbers))
    sites = [model.site(name).id for name in names]
    positions, axes = np.empty((rows, len(sites), 3)), np.empty((rows, 3))
    lengths, drive_forces, loop_forces = np.empty((rows, legs)), np.empty((rows, legs)), np.empty((rows, 3 * legs))
    rates = drives.rates
    for row in range(rows):
        if row:
            data.xfrc_applied[body] = wrench[row - 1]
            for part in range((row - 1) * parts, row * parts):
                drives.set(*(values[part] for values in commands))
                rates = drives.rates
                mujoco.mj_step(model, data)
        # After a step forces are those of its start; positions are updated by mj_kinematics. The integrator takes the
        # drives' damping by the rates at the step's end.
        drive_forces[row] = data.actuator_force[:legs] - drives.damping * (drives.rates - rates)
        loop_forces[row] = data.efc_force[: 3 * legs]
        mujoco.mj_kinematics(model, data)
        positions[row], axes[row], lengths[row] = data.site_xpos[sites], data.xmat[body][2::3], drives.lengths
        if row % DEFAULTS.report_rows == 0:
            progress("simulate", row / rows)
            if diverged():
                break
    if diverged():
        return Refusal(
            "simulation",
            f"the simulation diverges before {data.time:.3f} s: the bodies fly apart",
            remedy="lower the gains in [drives], or look for a singularity near the path",
        )
    progress("simulate", 1.0)
    return _physics(lengths, positions, axes, drive_forces, loop_forces, model.body_pos)


def _physics(
    lengths: Floats, positions: Floats, axes: Floats, drive_forces: Floats, loop_forces: Floats, bodies: Floats
) -> Physics:
    tips, (rods, joints) = positions[:, 0], np.split(positions[:, 1:], 2, axis=1)
    # Bodies in the order of the model: the world, then cylinder and rod of each leg.
    legs = rods - bodies[1 : 2 * rods.shape[1] : 2]
    legs /= np.linalg.norm(legs, axis=2, keepdims=True)
    # The constraint drive_forces the rod's end; the platform feels the opposite.
    push = -np.einsum("nlc,nlc->nl", loop_forces.reshape(*legs.shape), legs)
    gaps = np.linalg.norm(rods - joints, axis=2).max(axis=1)
    return Physics(Played(lengths, tips, axes, drive_forces), push, gaps)


class _Drives:
    """Control of MuJoCo's position actuators, with the drives' feed-forward and integrators."""

    def __init__(self, reference: Reference, model: Any, data: Any) -> None:
        self._drives, self._data, self._step = reference.machine.drives, data, model.opt.timestep
        joints = [model.joint(f"leg{leg + 1}").id for leg in range(reference.machine.robot.n_legs)]
        self._addresses, self._rate_addresses = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self._integral, self._feedforward = np.zeros(len(joints)), np.zeros(len(joints))

    @property
    def lengths(self) -> Floats:
        """Leg lengths (n_legs,) now, metres."""
        return self._data.qpos[self._addresses]

    @property
    def rates(self) -> Floats:
        """Rates of the legs (n_legs,) now, m/s."""
        return np.array(self._data.qvel[self._rate_addresses])

    @property
    def damping(self) -> Floats:
        """Force (n_legs,) for a rate error of 1 m/s, N·s/m."""
        return self._drives.moving_mass * self._drives.velocity_gain

    def set(self, length: Floats, rate: Floats, acceleration: Floats, load: Floats) -> None:
        """Set the drives' set values and loads for the next step, each (n_legs,)."""
        d = self._drives
        feedforward = d.velocity_feedforward * rate
        # The present rate follows from the command of the step before.
        self._integral += self._step * (d.position_gain * (length - self.lengths) + self._feedforward - self.rates)
        self._feedforward = feedforward
        push = (
            d.velocity_gain * (feedforward + d.velocity_integral * self._integral)
            + d.acceleration_feedforward * acceleration
        )
        push += d.load_feedforward * load / d.moving_mass
        self._data.ctrl[: len(length)] = length + push / (d.position_gain * d.velocity_gain)


def _commands(reference: Reference, parts: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Return lengths, rates, accelerations and loads (K, n_legs) for each step.

    MuJoCo's steps set rates first and then move by the new rates: so the rate is the forward difference of the lengths,
    the acceleration their second difference.
    """
    step = reference.program.period / parts
    lengths = reference.at(parts)[0]
    rates = np.diff(lengths, axis=0) / step
    accelerations = np.diff(rates, axis=0, prepend=np.zeros_like(rates[:1])) / step
    at_rows, share = leg_loads(reference), np.arange(parts)[:, None] / parts
    loads = at_rows[:-1, None] * (1.0 - share) + at_rows[1:, None] * share
    return lengths[:-1], rates, accelerations, loads.reshape(len(rates), -1)
