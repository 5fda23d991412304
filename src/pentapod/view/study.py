"""Study: margins along the path for any placement of the part, quickly."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.values import Value
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.build.limits import placement_limits
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.common_axes import OPTIONS as COMMON_AXES
from pentapod.planning.placement.sampling import best_tilted_margins
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.view.opened_run import OpenedRun

COMFORTABLE = 0.5
"""Smallest margin from which a waypoint has the best colour."""


@dataclass(frozen=True)
class StudyOptions:
    """Numbers of waypoints. shown: drawn. dragged: judged while the part is dragged; thorough: after a drag.

    tilted: judged with the best tool axis while the part is dragged.
    """

    shown: int = 2500
    dragged: int = 1500
    thorough: int = 20_000
    tilted: int = 400


OPTIONS = StudyOptions()


class Worst(NamedTuple):
    """The waypoint with the smallest margin. room: distance from the limit in `unit`, negative beyond it."""

    limit: str
    margin: float
    room: float
    unit: str
    waypoint: int


@dataclass(frozen=True, eq=False)
class Reach(Value):
    """Margins of a placement at waypoints `rows` (n,). margins (n,): the smallest one at each.

    beyond: share of the rows beyond a limit.
    """

    rows: Ints
    margins: Floats
    worst: Worst
    beyond: float

    @property
    def fits(self) -> bool:
        """Whether every limit is kept at all rows."""
        return self.worst.margin >= 0.0


@dataclass(frozen=True, eq=False)
class Study(Value):
    """A path with its planned tool axes, for any placement. shown (n,): waypoints that are drawn.

    axes (N, 3): workpiece frame; they turn with the part.
    """

    samples: ToolpathSamples
    axes: Floats
    margins: Margins
    shown: Ints

    @classmethod
    def of(cls, run: OpenedRun) -> Study:
        """Return the study of a run."""
        samples = ToolpathSamples.of(run.toolpath, run.job.axis.si.tilt)
        if run.job.axis.mode == "auto":  # the tool leans from the planned axes, and those from the normals
            samples = replace(samples, nominal=run.axes, tilt=min(samples.tilt, COMMON_AXES.tilt))
        margins = Margins.of(run.machine, run.component, run.collision_world, placement_limits(run.job))
        return cls(samples, run.axes, margins, drawn_waypoints(run.toolpath.starts))

    def at(self, placement: RigidTransform, *, tilted: bool = False, thorough: bool = False) -> Reach:
        """Return the margins of a placement, at some of the waypoints that are drawn.

        tilted: with the best tool axis within the job's cone at each waypoint instead of the planned ones, at fewer
        waypoints. thorough: at many more waypoints.
        """
        rows = self._thorough_rows if thorough else _some(self.shown, OPTIONS.dragged)
        if tilted:
            rows = self.shown if thorough else _some(self.shown, OPTIONS.tilted)
            values, _ = best_tilted_margins(self.samples.at(rows), self.margins, placement)
        else:
            values = self.margins(*self.samples.machine_poses(placement, self.axes[rows], rows), placement)
        smallest = values.min(axis=1)
        row, limit = (int(k) for k in np.unravel_index(int(values.argmin()), values.shape))
        named, margin = self.margins.limits[limit], float(values[row, limit])
        room = float(np.copysign(abs(named.shortfall(margin)), margin))
        worst = Worst(named.name, margin, room, named.unit, int(rows[row]))
        return Reach(rows, smallest, worst, float((smallest < 0.0).mean()))

    @property
    def _thorough_rows(self) -> Ints:
        count = len(self.samples.tilt_centres)
        return np.unique(np.linspace(0, count - 1, min(count, OPTIONS.thorough)).astype(np.intp))


def drawn_waypoints(starts: Ints) -> Ints:
    """Return the waypoints to draw: evenly spaced ones, and ends of segments."""
    count = int(starts[-1]) + 1
    even = np.linspace(0, count - 1, min(count, OPTIONS.shown)).astype(np.intp)
    ends = starts[:: -(-len(starts) // (OPTIONS.shown // 2))]
    return np.unique(np.concatenate([even, ends, [count - 1]])).astype(np.intp)


def _some(rows: Ints, most: int) -> Ints:
    """Return evenly chosen ones, at most so many, and the last."""
    return np.unique(np.append(rows[:: -(-len(rows) // most)], rows[-1]))
