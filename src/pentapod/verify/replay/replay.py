"""Replay: a program as the controller would run it, beside the toolpath it should follow."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.progress import Progress, silent
from pentapod.base.values import Value
from pentapod.geometry.interpolant import clamped_slopes
from pentapod.geometry.rigid import RigidTransform
from pentapod.machine.machine import Machine
from pentapod.numerics.blocks import blocks
from pentapod.program.program import Program
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify.replay.free_space import PosedPolyline
from pentapod.verify.replay.interval_bounds import IntervalBounds, interval_bounds
from pentapod.verify.replay.path_matching import PathMatch, match
from pentapod.verify.verdict.specification import Specification
from pentapod.verify.verdict.verdict import Place

_BLOCK = 1 << 15  # samples

SURVEY_SHARE = 0.6
"""Of the time that a verdict takes."""


@dataclass(frozen=True, eq=False)
class Replay(Value):
    """What the claims look at. Derived values are computed when first asked for, and kept.

    specification: what the program is judged against; its machine's guides stand where the program wants them.
    *Samples* are the rows and the moments halfway between them: M = 2N − 1, sample 2k is row k. *Chords* are the M − 1
    stretches of time between them.
    """

    program: Program
    specification: Specification
    progress: Progress = silent

    @property
    def machine(self) -> Machine:
        """The machine that the program is judged on."""
        return self.specification.machine

    @property
    def toolpath(self) -> Toolpath:
        """The toolpath that the program should follow, workpiece frame."""
        return self.specification.toolpath

    @property
    def tilt(self) -> float:
        """Half angle of the cone in which the tool may stand, radians."""
        return self.specification.tilt

    @property
    def path_tolerance(self) -> float:
        """How far the program may be off the toolpath, metres."""
        return self.specification.path_tolerance

    @property
    def axis_tolerance(self) -> float:
        """By how much the axis may leave the cone, radians."""
        return self.specification.axis_tolerance

    @cached_property
    def interval_bounds(self) -> IntervalBounds:
        """What the walk along the controller's polynomials measures and proves."""

        def told(share: float) -> None:
            self.progress("verify", SURVEY_SHARE * share, "between the rows")

        return interval_bounds(self.program, self.machine, self.toolpath.tilt_centre, self.path_tolerance, told)

    @cached_property
    def slopes(self) -> Floats | None:
        """Slopes (N, n_legs) of the legs at the rows, metres a period; None where they go straight from row to row."""
        return clamped_slopes(self.program.legs) if self.program.interpolation == "cubic" else None

    @cached_property
    def shared(self) -> dict[Hashable, object]:
        """What claims have reckoned that others ask as well."""
        return {}

    @property
    def pose(self) -> tuple[Floats, Floats]:
        """Positions and directions (M, 3) at the samples, machine frame, in the component of the header.

        By the closed-form forward kinematics; NaN where these leg lengths have no pose.
        """
        return self.interval_bounds.position, self.interval_bounds.direction

    @cached_property
    def unposed(self) -> Ints:
        """The samples where the leg lengths have no pose."""
        position, direction = self.pose
        return np.flatnonzero(~np.isfinite(position[:, 0] + direction[:, 0]))

    @cached_property
    def axes(self) -> Floats:
        """Tool axes (M, 3) at the samples, tip → spindle, workpiece frame by the header's placement."""
        return self._in_work(lambda inverse, _, direction: inverse.rotate(-direction))

    @cached_property
    def tilt_centres(self) -> Floats:
        """The points (M, 3) about which the tool may tilt, workpiece frame, metres."""
        along = self.machine.tool_length - self.toolpath.tilt_centre
        return self._in_work(lambda inverse, position, direction: inverse.apply(position + along * direction))

    def _in_work(self, of: Callable[[RigidTransform, Floats, Floats], Floats]) -> Floats:
        """Return what `of` makes (M, 3) of the transform into the workpiece frame and the poses, in blocks."""
        (position, direction), inverse = self.pose, self.program.placement.inverse()
        made = np.empty_like(position)
        for part in blocks(len(made), _BLOCK):
            made[part] = of(inverse, position[part], direction[part])
        return made

    @property
    def chord_arcs(self) -> Floats:
        """By how much (M − 1,) the toolpath's axis turns at most on each chord, in all, radians."""
        return np.diff(self.match.turned)

    @cached_property
    def match(self) -> PathMatch:
        """Which place of the toolpath each sample belongs to. Needs a pose at every sample."""
        program, path = (
            PosedPolyline(self.tilt_centres, self.axes),
            PosedPolyline(self.toolpath.tilt_centres, self.toolpath.axes),
        )
        bound = self.tilt + self.axis_tolerance
        return match(program, path, self.path_tolerance, axis_bound=bound, away=self.interval_bounds.away)

    def place(self, sample: float) -> Place:
        """Return the place of a sample (or of a moment between samples)."""
        if not len(self.unposed):
            waypoint = int(self.match.places[int(sample)])
            segment = int(self.toolpath.segment_of_interval[min(waypoint, len(self.toolpath) - 2)])
        else:
            segment = None
        return Place(round(float(sample) * 0.5 * self.program.period, 9), int(sample) // 2, segment)
