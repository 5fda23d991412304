"""Study: what a placement of the part comes to: the margins along the path, at once, and their colours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pentapod.base.arrays import Floats, Ints
from pentapod.base.values import Value
from pentapod.geometry.rigid import RigidTransform
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.sampling import best_tilted_margins
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.view.opened import Opened

COMFORTABLE = 0.4
"""Smallest margin from which a place of the path is drawn in full green."""

_SHOWN, _THOROUGH, _TILTED = 2_500, 20_000, 400
_STOPS = np.array([0.0, 0.35, 1.0])  # of the way from a limit to comfort
_COLOURS = np.array([[214.0, 58.0, 40.0], [240.0, 184.0, 48.0], [26.0, 152.0, 80.0]])
_BEYOND = np.array([128.0, 0.0, 32.0])  # darker than anything within the limits: told apart without colour, too


class Worst(NamedTuple):
    """The tightest place: limit, by name; margin; room: to the limit, in `unit`, negative beyond it; waypoint."""

    limit: str
    margin: float
    room: float
    unit: str
    waypoint: int


@dataclass(frozen=True, eq=False)
class Reach(Value):
    """What a placement comes to at waypoints `rows` (n,), of all. margins (n,): the smallest one at each.

    beyond: share of the rows at which a limit is broken.
    """

    rows: Ints
    margins: Floats
    worst: Worst
    beyond: float

    @property
    def fits(self) -> bool:
        """Whether every limit is kept at every one of the rows."""
        return self.worst.margin >= 0.0

    def colours(self, at: Ints) -> NDArray[np.uint8]:
        """Return the colours (m, 3) of waypoints `at`: between two rows, those in between."""
        return margin_colours(np.interp(at, self.rows, self.margins))


@dataclass(frozen=True, eq=False)
class Study(Value):
    """A path that may be placed anywhere, with the tool axes that were chosen. shown (n,): waypoints that are drawn.

    axes (N, 3): workpiece frame; they turn with the part.
    """

    samples: ToolpathSamples
    axes: Floats
    margins: Margins
    shown: Ints

    @classmethod
    def of(cls, run: Opened) -> Study:
        """Return the study of a run."""
        samples = ToolpathSamples.of(run.toolpath, float(np.radians(run.job.axis.tilt_deg)))
        margins = Margins.of(run.machine, run.component, run.collision_world)
        return cls(samples, run.axes, margins, drawn_waypoints(run.toolpath.starts))

    def at(self, placement: RigidTransform, *, tilted: bool = False, thorough: bool = False) -> Reach:
        """Return what a placement comes to, quickly: at the waypoints that are drawn.

        tilted: with the best lean within the job's cone at each waypoint by itself, not the axes that were chosen, and
        at fewer waypoints: what could be reached. thorough: at all waypoints, or at twenty thousand of them.
        """
        rows = self._thorough_rows if thorough else self.shown
        if tilted:
            rows = rows[:: -(-len(rows) // _TILTED)] if not thorough else self.shown
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
        return np.unique(np.linspace(0, count - 1, min(count, _THOROUGH)).astype(np.intp))


def margin_colours(margins: Floats) -> NDArray[np.uint8]:
    """Return RGB colours (n, 3) of margins (n,): from red at a limit to green at comfort; dark red beyond a limit."""
    share = np.clip(margins / COMFORTABLE, 0.0, 1.0)
    within = np.stack([np.interp(share, _STOPS, column) for column in _COLOURS.T], axis=1)
    return np.where((margins < 0.0)[:, None], _BEYOND, within).astype(np.uint8)


def drawn_waypoints(starts: Ints) -> Ints:
    """Return the waypoints to draw: where segments begin and end, as far as there is room, and evenly between."""
    count = int(starts[-1]) + 1
    even = np.linspace(0, count - 1, min(count, _SHOWN)).astype(np.intp)
    ends = starts[:: -(-len(starts) // (_SHOWN // 2))]
    return np.unique(np.concatenate([even, ends, [count - 1]])).astype(np.intp)
