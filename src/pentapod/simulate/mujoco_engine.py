"""Rigid-body simulation: MuJoCo plays a program on the machine of `mjcf`, which shares no kinematics with ours."""

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
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.families.as_built_forward import as_built_pose
from pentapod.kinematics.families.quadratic import as_quadratic
from pentapod.simulate.load import leg_loads
from pentapod.simulate.measures import Measure
from pentapod.simulate.mjcf import mjcf
from pentapod.simulate.played import Played
from pentapod.simulate.reference import Reference

LONGEST_STEP_S = 5e-4
_REST_S = 0.3  # so long the machine stands before the start, until the drives carry its weight
_NEWS = 500  # rows between two reports of progress


@dataclass(frozen=True, eq=False)
class Physics(Result):
    """A program as MuJoCo played it.

    leg_forces (N, n): with which each leg pushes its platform joint away from its base joint, newtons: what bends and
    buckles a leg; the drives' forces (`played.forces`) have to speed up motor and screw as well. closure (N,): the
    largest gap of a loop that should be closed, metres: it tells how rigid the simulated joints are.
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
        """What it measures beside the tool's errors."""
        return (
            Measure("closure error", "mm", 1e3 * self.closure, "largest gap of the five loops"),
            Measure("leg force", "N", np.abs(self.leg_forces).max(axis=1), "push or pull of any leg"),
        )


@dataclass(frozen=True, eq=False)
class Plant(Result):
    """The machine that stands there, at the start of a program. xml: as MJCF, standing at position, direction (3,)."""

    xml: str
    position: Floats
    direction: Floats


def load_mujoco() -> Any:
    """Return the module mujoco. Raises InputError where it is not installed."""
    return load_extra("mujoco", "sim", "this engine needs MuJoCo", key="mujoco")


def plant(reference: Reference, *, base_errors: ArrayLike = 0.0, offset_errors: ArrayLike = 0.0) -> Plant | Refusal:
    """Return the machine as MJCF, its legs as long as the program's first row says; MuJoCo itself is not needed.

    base_errors (n, 3) and offset_errors (n,): metres by which the real joints are off the machine file, or one number
    for all. A Refusal says that the real machine has no pose there that can be trusted.
    """
    program, machine = reference.program, reference.machine
    robot = as_quadratic(machine.robot, "the rigid-body model")
    real = AsBuiltPentapod.of(robot, base_errors=base_errors, offset_errors=offset_errors)
    start = as_built_pose(real, robot, program.legs[0], program.component)
    if not start.proven:
        return Refusal(
            "simulation",
            "the machine with these errors has no pose at the program's start that is sure to be the right",
        )
    step = program.period / _parts(program.period)
    xml = mjcf(machine, real, start.position, start.direction, step=step)
    return Plant(xml, start.position, start.direction)


@stage
def simulate_mujoco(
    reference: Reference, stands: Plant, *, tip_forces: ArrayLike = 0.0, progress: Progress = silent
) -> Physics | Refusal:
    """Return how MuJoCo plays a program on a machine.

    tip_forces (N, 3), or one for all rows: newtons on the tip, machine frame. A Refusal says that the simulation broke
    down. Raises InputError where MuJoCo is missing, ArrayError for forces of a wrong shape.
    """
    mujoco = load_mujoco()
    mujoco.set_mju_user_warning(_quiet)  # it would write a file into the folder it is called from
    try:
        return _run(mujoco, reference, stands, tip_forces, progress)
    finally:
        mujoco.set_mju_user_warning(None)


def _run(
    mujoco: Any, reference: Reference, stands: Plant, tip_forces: ArrayLike, progress: Progress
) -> Physics | Refusal:
    program, machine = reference.program, reference.machine
    (rows, legs), parts = program.legs.shape, _parts(program.period)
    still = np.zeros(legs)
    model = mujoco.MjModel.from_xml_string(stands.xml)
    data = mujoco.MjData(model)
    try:
        force = np.broadcast_to(np.asarray(tip_forces, dtype=np.float64), (rows, 3))
    except ValueError as error:
        raise ArrayError("wrong shape", key="tip_forces", value=np.shape(tip_forces), expected="(rows, 3)") from error
    body = model.body("platform").id
    lever = (machine.tool_length - model.body_ipos[body][2]) * reference.directions[::2]
    wrench = np.concatenate([force, np.cross(lever, force)], axis=1)
    wanted = _wanted(reference, parts)
    drives = _Drives(reference, model, data)
    data.xfrc_applied[body] = wrench[0]
    for _ in range(int(np.ceil(_REST_S / model.opt.timestep))):
        drives.tell(program.legs[0], still, still, wanted[3][0])
        mujoco.mj_step(model, data)
    sites = [model.site(name).id for name in _sites(legs)]
    places, axes = np.empty((rows, len(sites), 3)), np.empty((rows, 3))
    lengths, pushes, loops = np.empty((rows, legs)), np.empty((rows, legs)), np.empty((rows, 3 * legs))
    for row in range(rows):
        if row:
            data.xfrc_applied[body] = wrench[row - 1]
            for part in range((row - 1) * parts, row * parts):
                drives.tell(*(values[part] for values in wanted))
                mujoco.mj_step(model, data)
        # A step leaves places and forces as they were at its start: they are told apart by where they are read.
        pushes[row], loops[row] = data.actuator_force[:legs], data.efc_force[: 3 * legs]
        mujoco.mj_kinematics(model, data)
        places[row], axes[row], lengths[row] = data.site_xpos[sites], data.xmat[body][2::3], drives.lengths
        if row % _NEWS == 0:
            progress("simulate", row / rows)
            if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number or not np.isfinite(data.qpos).all():
                break
    if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number or not np.isfinite(data.qpos).all():
        return Refusal(
            "simulation",
            f"the bodies fly apart before {data.time:.3f} s",
            remedy="lower the gains in [drives], or look for a singularity near the path",
        )
    progress("simulate", 1.0)
    return _physics(lengths, places, axes, pushes, loops, model.body_pos)


def _sites(legs: int) -> tuple[str, ...]:
    numbers = range(1, legs + 1)
    return ("tip", *(f"rod{leg}" for leg in numbers), *(f"platform{leg}" for leg in numbers))


def _physics(lengths: Floats, places: Floats, axes: Floats, pushes: Floats, loops: Floats, bodies: Floats) -> Physics:
    tips, (rods, joints) = places[:, 0], np.split(places[:, 1:], 2, axis=1)
    # Bodies in the order of the model: the world, then cylinder and rod of each leg.
    legs = rods - bodies[1 : 2 * rods.shape[1] : 2]
    legs /= np.linalg.norm(legs, axis=2, keepdims=True)
    # The constraint pushes the rod's end; the platform feels the opposite.
    push = -np.einsum("nlc,nlc->nl", loops.reshape(*legs.shape), legs)
    gaps = np.linalg.norm(rods - joints, axis=2).max(axis=1)
    return Physics(Played(lengths, tips, axes, pushes), push, gaps)


class _Drives:
    """The drives' loops as MuJoCo's position actuators have them, and the integrators, which they have not."""

    def __init__(self, reference: Reference, model: Any, data: Any) -> None:
        self._drives, self._data, self._step = reference.machine.drives, data, model.opt.timestep
        joints = [model.joint(f"leg{leg + 1}").id for leg in range(reference.machine.robot.n_legs)]
        self._places, self._rates = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self._held, self._ahead = np.zeros(len(joints)), np.zeros(len(joints))

    @property
    def lengths(self) -> Floats:
        """Leg lengths (n_legs,) now, metres."""
        return self._data.qpos[self._places]

    def tell(self, length: Floats, rate: Floats, acceleration: Floats, load: Floats) -> None:
        """Set what the drives want during the next step, and what they have to carry, each (n_legs,)."""
        d = self._drives
        ahead = d.velocity_feedforward * rate
        # What moves now moves as it was told for the step before.
        self._held += self._step * (
            d.position_gain * (length - self.lengths) + self._ahead - self._data.qvel[self._rates]
        )
        self._ahead = ahead
        push = d.velocity_gain * (ahead + d.velocity_integral * self._held) + d.acceleration_feedforward * acceleration
        push += d.load_feedforward * load / d.moving_mass
        self._data.ctrl[: len(length)] = length + push / (d.position_gain * d.velocity_gain)


def _wanted(reference: Reference, parts: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Return lengths, rates, accelerations and loads (K, n_legs) for each step.

    MuJoCo's steps set rates first and then move by the new rates. A leg that is to be at the next length after the step
    needs the forward difference as its rate, and the second difference as its acceleration.
    """
    step = reference.program.period / parts
    lengths = reference.at(parts)[0]
    rates = np.diff(lengths, axis=0) / step
    accelerations = np.diff(rates, axis=0, prepend=np.zeros_like(rates[:1])) / step
    at_rows, share = leg_loads(reference), np.arange(parts)[:, None] / parts
    loads = at_rows[:-1, None] * (1.0 - share) + at_rows[1:, None] * share
    return lengths[:-1], rates, accelerations, loads.reshape(len(rates), -1)


def _quiet(warning: object) -> None:
    """Say nothing: what went wrong is counted by MuJoCo too, and told as a refusal."""


def _parts(period: float) -> int:
    return max(1, int(np.ceil(period / LONGEST_STEP_S - 1e-9)))
