"""Replay: a program as the controller runs it, beside the toolpath that it should follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.progress import Progress, silent
from pentapod.base.values import Value
from pentapod.geometry.interpolant import clamped_slopes
from pentapod.geometry.polyline import arc_length
from pentapod.machine.dynamics.deflection import Yielding, leg_pushes, tip_shift
from pentapod.machine.machine import Machine
from pentapod.numerics.blocks import blocks
from pentapod.program.commands import springs
from pentapod.program.program import Program
from pentapod.toolpath.toolpath import SegmentKind, Toolpath
from pentapod.verify.replay.free_space import PosedPolyline
from pentapod.verify.replay.interval_bounds import IntervalBounds, interval_bounds
from pentapod.verify.replay.path_matching import OPTIONS as MATCHING
from pentapod.verify.replay.path_matching import AtPlaces, PathMatch, match
from pentapod.verify.replay.row_forces import ROWS_AT_ONCE, RowForces, motion_of_rows
from pentapod.verify.verdict.specification import Specification
from pentapod.verify.verdict.verdict import Place

REPLAY_SHARE = 0.6
"""Share of the time of a verdict that the interval bounds take, for progress bars."""


@dataclass(frozen=True, eq=False)
class OfSamples:
    """Vectors of `count` samples, computed where they are asked for: of all of them they take much memory.

    at: returns those of some rows (n, 3), or of one (3,).
    """

    count: int
    at: Callable[[Any], Floats]

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, rows: slice | Ints | int) -> Floats:
        """Return the vectors of some rows."""
        if not isinstance(rows, slice) or len(own := range(self.count)[rows]) <= ROWS_AT_ONCE:
            return self.at(rows)
        found = np.empty((len(own), 3))
        for part in blocks(len(own), ROWS_AT_ONCE):
            few = own[part]
            found[part] = self.at(slice(few.start, few.stop, few.step))
        return found


@dataclass(frozen=True, eq=False)
class Replay(Value):
    """The input of the claims. Derived values are computed once, when first needed.

    specification: what the program is judged against; its guides are at the positions of the program.
    *Samples* are the rows and the moments halfway between them: M = 2N − 1, sample 2k is row k. *Chords* are the M − 1
    straight lines between consecutive samples.
    """

    program: Program
    specification: Specification
    progress: Progress = silent

    @cached_property
    def kept(self) -> dict[Any, Any]:
        """What claims have computed of this replay and others may use, by keys of their own."""
        return {}

    @property
    def machine(self) -> Machine:
        """The machine that the program is judged on."""
        return self.specification.machine

    @property
    def toolpath(self) -> Toolpath:
        """The toolpath that the program should follow, workpiece frame."""
        return self.specification.toolpath

    @property
    def path_tolerance(self) -> float:
        """Allowed deviation of the program from the toolpath, metres."""
        return self.specification.path_tolerance

    @property
    def match_radius(self) -> float:
        """How far a sample may be from its place in the matching, metres: the path tolerance and a little more."""
        return MATCHING.within * self.path_tolerance

    @cached_property
    def interval_bounds(self) -> IntervalBounds:
        """Poses at the samples, and what is proven of the motion between them."""

        def progress(share: float) -> None:
            self.progress("verify", REPLAY_SHARE * share, "between the rows")

        more = self.compensated_by
        return interval_bounds(
            self.program, self.machine, self.toolpath.tilt_centre, self.path_tolerance, progress,
            told=None if more is None else self.program.legs + more,
        )  # fmt: skip

    @cached_property
    def compensated_by(self) -> Floats | None:
        """By how much drives are told more than the rows (N, n_legs), because legs yield, metres; None for nothing."""
        if not (self.program.provenance.compensation and self.machine.yielding_known):
            return None
        return springs(self.program, self.machine, self.program.legs)

    @cached_property
    def slopes(self) -> Floats | None:
        """Slopes (N, n_legs) of the legs at the rows, metres a period; None for linear interpolation."""
        return clamped_slopes(self.program.legs) if self.program.interpolation == "cubic" else None

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
    def axes(self) -> OfSamples:
        """Tool axes (M, 3) at the samples, tip → spindle, workpiece frame by the header's placement."""
        direction, inverse = self.pose[1], self.program.placement.inverse()
        return OfSamples(len(direction), lambda rows: inverse.rotate(-direction[rows]))

    @cached_property
    def tilt_centres(self) -> OfSamples:
        """Tilt centres (M, 3) at the samples, workpiece frame, metres."""
        (position, direction), inverse = self.pose, self.program.placement.inverse()
        along = self.machine.tool_length - self.toolpath.tilt_centre
        return OfSamples(len(position), lambda rows: inverse.apply(position[rows] + along * direction[rows]))

    @cached_property
    def match(self) -> PathMatch:
        """The matching of the samples with the toolpath. Needs a pose at every sample."""
        return self.matched(self.tilt_centres[:])

    @property
    def arcs(self) -> AtPlaces:
        """How far along the toolpath the samples (M,) are, metres. Needs a pose at every sample."""
        return self.match.arcs

    def matched(self, tilt_centres: Floats) -> PathMatch:
        """Return the matching of tilt centres (M, 3), with the axes of the samples, with the toolpath."""
        return match(
            PosedPolyline(tilt_centres, self.axes[:]),
            PosedPolyline(self.toolpath.tilt_centres, self.toolpath.axes),
            self.path_tolerance,
            axis_bound=self.specification.tilt + self.specification.axis_tolerance,
            chord_deviations=self.interval_bounds.deviations,
        )

    @cached_property
    def forces(self) -> RowForces:
        """Forces of the drives at the rows, of a machine that limits them. Needs a pose at every row."""
        position, direction = (pose[::2] for pose in self.pose)
        program = self.program
        cuts = self.cuts() if self.machine.cutting_force else np.zeros(len(program.legs), dtype=np.bool_)
        return RowForces.of(program, self.machine, self.slopes, (position, direction), cuts)

    @cached_property
    def yielding(self) -> Yielding:
        """How far the tip moves at the rows because the legs yield to masses. Needs a pose at every row.

        What drives compensate for is not in it.
        """
        (position, direction), found = (pose[::2] for pose in self.pose), list[Yielding]()
        for part, rates, accelerations in motion_of_rows(self.program, self.slopes):
            poses = position[part], direction[part]
            push = leg_pushes(self.machine, *poses, rates, accelerations, weight=self.compensated_by is None)
            found.append(Yielding.of(self.machine, *poses, push))
        return Yielding(*(np.concatenate([getattr(each, name) for each in found]) for name in vars(found[0])))

    @cached_property
    def sag(self) -> Floats:
        """How far loads for which drives compensate would move the tip (N,) at the rows, metres; 0 for none."""
        return self._moved(self.compensated_by)

    @cached_property
    def pushed(self) -> Floats:
        """How far the tip (N,) is moved at the rows by a process force that drives compensate for, where there is none.

        Metres; 0 where that is nothing.
        """
        if self.compensated_by is None or self.program.process_force is None:
            return self._moved(None)
        steady = replace(self.program, process_force=None)
        return self._moved(self.compensated_by - springs(steady, self.machine, steady.legs))

    def _moved(self, more: Floats | None) -> Floats:
        """Return how far the tip (N,) moves at the rows as legs get shorter by `more` (N, n_legs), metres."""
        (position, direction), found = (pose[::2] for pose in self.pose), np.zeros(len(self.program.legs))
        for part in blocks(0 if more is None else len(found), ROWS_AT_ONCE):
            if more is not None:
                shift = tip_shift(self.machine, position[part], direction[part], more[part])
                found[part] = np.linalg.norm(shift, axis=1)
        return found

    def cuts(self) -> Bools:
        """Return the rows (N,) on a cut and farther than the path tolerance from its ends."""
        return self._on(cut=True)

    def off_cuts(self) -> Bools:
        """Return the rows (N,) on a link or rapid and farther than the path tolerance from its ends."""
        return self._on(cut=False)

    def _on(self, *, cut: bool) -> Bools:
        arcs, ends = self.match.arcs[::2], arc_length(self.toolpath.tilt_centres)[self.toolpath.starts]
        first = np.searchsorted(ends, arcs - self.match_radius, side="right")
        behind = np.searchsorted(ends, arcs + self.match_radius, side="left")
        kinds = [(segment.kind is SegmentKind.CUT) is cut for segment in self.toolpath.segments]
        return np.array([False, *kinds, False])[first] & (first == behind)

    def place(self, sample: float) -> Place:
        """Return the place of a sample (or of a moment between samples)."""
        segment = None
        if not len(self.unposed):
            waypoint = int(self.match.places[int(sample)])
            segment = int(self.toolpath.segment_of_interval[min(waypoint, len(self.toolpath) - 2)])
        return Place(round(float(sample) * 0.5 * self.program.period, 9), int(sample) // 2, segment)
