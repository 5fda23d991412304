"""Signals: motion of the written program against time, computed from its rows, for the plots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pentapod.base.arrays import Floats, Ints, set_frozen
from pentapod.geometry.interpolant import Interpolant, clamped_slopes
from pentapod.machine.clearance.collision_world import NOTHING, CollisionWorld
from pentapod.machine.dynamics.deflection import Yielding, leg_pushes
from pentapod.machine.machine import Machine
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.limits.margins import Margins
from pentapod.program.program import Program
from pentapod.report.figure import DETAIL
from pentapod.timing.time_law.trajectory import Profile
from pentapod.toolpath.toolpath import SegmentKind, Toolpath
from pentapod.verify.replay.row_forces import RowForces, motion_of_rows


class TimeLaw(Protocol):
    """What signals need of a `Trajectory`: its profile, and the toolpath's segment at a time."""

    @property
    def profile(self) -> Profile:
        """Speeds and active limits at the gridpoints."""
        ...

    @property
    def duration(self) -> float:
        """Seconds."""
        ...

    def segment(self, t: ArrayLike) -> Ints:
        """Return the index (n,) of the toolpath's segment at each time."""
        ...


@dataclass(frozen=True, eq=False)
class Signals:
    """At the rows of a program (N): SI units, machine frame.

    times (N,) s; legs, rates, accelerations (N, n_legs) m, m/s, m/s², as the controller moves between rows;
    tips, axes (N, 3); speeds (N,), m/s: of the tip, with a stand-off tool of the spot on the surface except on
    rapids; speed_limits (N,): the programmed feed, or the rapid rate; segments (N,) of the toolpath; cutting
    (N,). causes (N,): the active limit, index into `cause_names`. margins (K, M) at rows
    `margin_rows` (K,), with those to obstacles. forces: of the drives; None where they have no limit.
    deflections (N, 2): of the tip with the cutting force in the worst direction on cuts, and by masses alone, metres;
    what drives compensate for is not in them. None where they are not known.
    """

    times: Floats
    legs: Floats
    rates: Floats
    accelerations: Floats
    tips: Floats
    axes: Floats
    speeds: Floats
    speed_limits: Floats
    segments: Ints
    cutting: NDArray[np.bool_]
    causes: Ints
    cause_names: tuple[str, ...]
    margins: Floats
    margin_rows: Ints
    margin_names: tuple[str, ...]
    forces: RowForces | None = None
    deflections: Floats | None = None

    @classmethod
    def of(
        cls,
        program: Program,
        machine: Machine,
        law: TimeLaw,
        toolpath: Toolpath,
        collision_world: CollisionWorld = NOTHING,
        limits: Sequence[LimitKind] = (),
    ) -> Signals:
        """Return the signals of a program. The time law gives the segment and the active limit at a time.

        collision_world: what legs, spindle and tool must not touch. limits: kinds of limits on poses besides
        pentapod's own.
        """
        times = program.times
        rates, accelerations = motion = _motion(program)
        tips, axes = _poses(program, machine)
        segments = law.segment(np.minimum(times, law.duration))
        speeds = np.linalg.norm(np.gradient(tips, program.period, axis=0), axis=1)
        if toolpath.tilt_centre < 0.0:
            spots = tips + toolpath.tilt_centre * axes
            rapid = np.array([s.kind == SegmentKind.RAPID for s in toolpath.segments])[segments]
            speeds = np.where(rapid, speeds, np.linalg.norm(np.gradient(spots, program.period, axis=0), axis=1))
        feeds = np.array([min(s.feed, machine.rapid_velocity) for s in toolpath.segments])
        kinds = np.array([s.kind == SegmentKind.CUT for s in toolpath.segments])
        margins = Margins.of(machine, program.component, collision_world, limits)
        step = max(1, -(-len(times) // DETAIL.margin_rows))
        rows = np.unique(np.append(np.arange(0, len(times), step), len(times) - 1)).astype(np.intp)
        values = margins(tips[rows], axes[rows], program.placement)
        names = tuple(limit.name for limit in margins.limits)
        profile, poses = law.profile, (tips + machine.tool_length * axes, -axes)
        at = np.clip(np.searchsorted(profile.times, times, side="right") - 1, 0, len(profile.active) - 1)
        return cls(
            times, program.legs, rates, accelerations, tips, axes, speeds, feeds[segments], segments,
            kinds[segments], profile.active[at], tuple(profile.constraint_names), values, rows, names,
            _forces(machine, poses, motion, kinds[segments]),
            _deflections(program, machine, poses, motion, kinds[segments]),
        )  # fmt: skip

    def __post_init__(self) -> None:
        set_frozen(self, margin_names=tuple(self.margin_names), cause_names=tuple(self.cause_names))

    @property
    def smallest_margins(self) -> Floats:
        """The smallest margin (K,) at each of `margin_rows`."""
        return self.margins.min(axis=1)


def _motion(program: Program) -> tuple[Floats, Floats]:
    """Return rates and accelerations (N, n_legs) of the legs at the rows; of a spline in blocks."""
    if program.interpolation != "cubic":
        joined = Interpolant.along(program.legs, None, program.period)
        return joined.first, joined.second
    rates, accelerations = np.empty_like(program.legs), np.empty_like(program.legs)
    for part, *motion in motion_of_rows(program, clamped_slopes(program.legs)):
        rates[part], accelerations[part] = motion
    return rates, accelerations


def _forces(
    machine: Machine, poses: tuple[Floats, Floats], motion: tuple[Floats, Floats], cuts: NDArray[np.bool_]
) -> RowForces | None:
    """Return the forces of the drives at the rows, where they have a limit."""
    return RowForces.at(machine, poses, *motion, cuts) if machine.drive_forces.limited else None


def _deflections(
    program: Program,
    machine: Machine,
    poses: tuple[Floats, Floats],
    motion: tuple[Floats, Floats],
    cuts: NDArray[np.bool_],
) -> Floats | None:
    """Return how far the tip deflects at the rows (N, 2): see `Signals`."""
    if not machine.yielding_known:
        return None
    push = leg_pushes(machine, *poses, *motion, weight=not program.provenance.compensation)
    found = Yielding.of(machine, *poses, push)
    by_masses = np.linalg.norm(found.shift, axis=1)
    return np.column_stack([by_masses + machine.cutting_force * found.softest * cuts, by_masses])


def _poses(program: Program, machine: Machine) -> tuple[Floats, Floats]:
    """Return tips and tool axes (N, 3), machine frame, by the forward kinematics in the program's component."""
    position, direction = machine.robot.pose(program.legs, program.component)
    return position + machine.tool_length * direction, -direction
