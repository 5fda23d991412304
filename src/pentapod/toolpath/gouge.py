"""Gouges: every cut checked against the part, and what gouges tilted clear, lifted, dropped, or only reported."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise

import numpy as np

from pentapod.arrays import Bools, Floats, Ints
from pentapod.errors import ToolpathError
from pentapod.geometry.directions import tangent_frame
from pentapod.progress import Progress, silent
from pentapod.toolpath.facet_tree import FacetTree
from pentapod.toolpath.solids import KINDS
from pentapod.toolpath.sweep import Sweep, sweep, touch
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.toolpath.tools import Tool

_RINGS, _SPOKES = 4, 16
_LIFTS = 40
_ROUNDS = 3


class Remedy(StrEnum):
    """What is done about a gouge: tilt the tool clear within a cone, lift it along its axis, drop the cut, nothing."""

    TILT = "tilt"
    LIFT = "lift"
    DROP = "drop"
    REPORT = "report"


@dataclass(frozen=True)
class GougeOptions:
    """remedies: tried in this order on what still gouges. tolerance: depth that counts as none, metres.

    cone: half angle in radians within which tilting may turn the axis. highest: most that lifting may lift, metres.
    Raises ToolpathError for values that make no sense.
    """

    remedies: tuple[Remedy, ...] = (Remedy.REPORT,)
    tolerance: float = 20e-6
    cone: float = float(np.radians(30.0))
    highest: float = 20e-3

    def __post_init__(self) -> None:
        if not (self.tolerance > 0.0 and 0.0 < self.cone < 0.5 * np.pi and self.highest > 0.0):
            raise ToolpathError(
                "impossible limits", key="gouge", value=(self.tolerance, self.cone, self.highest), expected="positive"
            )


@dataclass(frozen=True)
class GougeReport:
    """What the check found. motions: cuts' motions between waypoints that were checked.

    gouging: of them too deep at first; depths: the deepest of cutter, shank and holder at first, metres, −inf for none.
    tilted, lifted: waypoints changed; dropped: motions taken out of the cut; most_lifted: metres.
    left: motions still too deep, left_depth how deep, metres; places: the first waypoint of each run of those.
    """

    motions: int
    gouging: int
    depths: tuple[float, float, float]
    tilted: int = 0
    lifted: int = 0
    most_lifted: float = 0.0
    dropped: int = 0
    left: int = 0
    left_depth: float = 0.0
    places: tuple[int, ...] = ()

    def __str__(self) -> str:
        text = f"gouge check: {self.motions:,} motions"
        if not self.gouging:
            return text + ", none gouges"
        deep = ", ".join(f"{k} {1e3 * d:.3g} mm" for k, d in zip(KINDS, self.depths, strict=True) if d > 0.0)
        text += f", {self.gouging:,} gouged: {deep} deep"
        if self.tilted:
            text += f"\n  note: {self.tilted:,} waypoints tilted clear"
        if self.lifted:
            text += f"\n  note: {self.lifted:,} waypoints lifted, by up to {1e3 * self.most_lifted:.3g} mm"
        if self.dropped:
            text += f"\n  note: {self.dropped:,} motions dropped: material is left there"
        if self.left:
            where = ", ".join(str(place) for place in self.places[:5]) + (", ..." if len(self.places) > 5 else "")
            worst = 1e3 * self.left_depth
            text += f"\n  problem: {self.left:,} motions gouge by up to {worst:.3g} mm, from waypoints {where}"
        return text


def checked(
    toolpath: Toolpath, tool: Tool, tree: FacetTree, options: GougeOptions, progress: Progress = silent
) -> tuple[Toolpath, GougeReport]:
    """Return the toolpath with its gouges remedied as the options say, and what was found and done.

    Cuts alone are looked at; a cut that begins or ends elsewhere than before takes its neighbours' ends along.
    Dropped motions become links on feed, raised along the axis until they are clear, so that the path stays whole.
    What no remedy cures is left and reported.
    """
    cut = np.array([toolpath.segments[k].kind is SegmentKind.CUT for k in toolpath.segment_of_interval])
    work = _Work(toolpath, tool, tree, options, cut, progress)
    first = work.found()
    report = GougeReport(
        motions=int(cut.sum()),
        gouging=int(work.bad(first).sum()),
        depths=tuple(float(d) for d in first.depths.max(axis=0, initial=-np.inf)),  # type: ignore[arg-type]
    )
    if not report.gouging:
        return toolpath, report
    bad = work.bad(first)
    for remedy in options.remedies:
        if not bad.any():
            break
        if remedy is Remedy.TILT and tool.leans:
            report = replace(report, tilted=work.tilt(bad))
        elif remedy is Remedy.LIFT:
            lifted, most = work.lift(bad)
            report = replace(report, lifted=lifted, most_lifted=most)
        elif remedy is Remedy.DROP:
            report = replace(report, dropped=work.drop(bad))
        bad = work.bad(work.found())
    if bad.any():
        left = work.found()
        runs = np.flatnonzero(bad & ~np.concatenate([[False], bad[:-1]]))
        report = replace(
            report, left=int(bad.sum()), left_depth=float(left.deepest.max()), places=tuple(int(k) for k in runs)
        )
    return work.toolpath(), report


class _Work:
    """The waypoints of a toolpath while they are being changed."""

    def __init__(
        self, path: Toolpath, tool: Tool, tree: FacetTree, options: GougeOptions, cut: Bools, progress: Progress
    ) -> None:
        self.path, self.tool, self.tree, self.options, self.cut = path, tool, tree, options, cut
        self.tips, self.axes = path.tips.copy(), path.axes.copy()
        self.dropped = np.zeros(len(cut), dtype=np.bool_)
        self.progress = progress

    def found(self) -> Sweep:
        """Return what the motions meet; those that do not cut count as clear."""
        rows = np.flatnonzero(self.cut & ~self.dropped)
        met = _motions(self, rows)
        depths = np.full((len(self.cut), 3), -np.inf)
        depths[rows] = met.depths
        times, facets = np.full((len(self.cut), 3), np.nan), np.full((len(self.cut), 3), -1, dtype=np.intp)
        points = np.full((len(self.cut), 3, 3), np.nan)
        times[rows], points[rows], facets[rows] = met.times, met.points, met.facets
        return Sweep(depths, times, points, facets)

    def bad(self, met: Sweep) -> Bools:
        """Return which motions (N − 1,) are too deep."""
        return met.beyond(self.options.tolerance)

    def tilt(self, bad: Bools) -> int:
        """Turn the axes at gouging waypoints, the least that clears them, about the pivot; return how many turned.

        The turn fades out over the neighbours on either side, so that the axis does not jump.
        """
        pivots = self.tips + self.tool.pivot * self.axes
        original = self.axes.copy()
        turn = np.zeros((len(self.tips), 2))
        t1, t2 = tangent_frame(original)
        for _ in range(_ROUNDS):
            rows = np.flatnonzero(_ends(bad))
            open_rows = rows
            for ring in range(1, _RINGS + 1):
                angle = np.tan(self.options.cone * ring / _RINGS)
                for spoke in range(_SPOKES):
                    if not len(open_rows):
                        break
                    way = 2.0 * np.pi * spoke / _SPOKES
                    trial = np.tile([angle * np.cos(way), angle * np.sin(way)], (len(open_rows), 1))
                    axes = _leaned(original[open_rows], t1[open_rows], t2[open_rows], trial)
                    tips = pivots[open_rows] - self.tool.pivot * axes
                    met = touch(self.tree, self.tool, tips, axes, threshold=0.5 * self.options.tolerance)
                    clear = met.deepest == -np.inf
                    turn[open_rows[clear]] = trial[clear]
                    open_rows = open_rows[~clear]
            faded = _faded(turn)
            self.axes = _leaned(original, t1, t2, faded)
            self.tips = np.where((faded != 0.0).any(axis=1)[:, None], pivots - self.tool.pivot * self.axes, self.tips)
            bad = bad | self.bad(self.found())
            if not self.bad(self.found()).any():
                break
        return int((self.axes != original).any(axis=1).sum())

    def lift(self, bad: Bools) -> tuple[int, float]:
        """Raise gouging waypoints along their axes until their motions are clear; return how many, and the most."""
        lift, start = np.zeros(len(self.tips)), self.tips.copy()
        for _ in range(_LIFTS):
            met = _motions(self, np.flatnonzero(bad))
            depth = np.zeros(len(bad))
            depth[bad] = np.maximum(met.deepest, 0.0)
            bad = depth > self.options.tolerance
            if not bad.any():
                break
            need = np.zeros(len(lift))
            step = 1.2 * depth + 0.1 * self.options.tolerance
            need[:-1] = np.where(bad, step, 0.0)
            need[1:] = np.maximum(need[1:], np.where(bad, step, 0.0))
            lift = np.minimum(lift + need, self.options.highest)
            self.tips = start + lift[:, None] * self.axes
            # A motion beside one that was raised leans more than before: it is looked at again.
            bad = self.cut & ~self.dropped & (_ends(bad)[:-1] | _ends(bad)[1:])
        hopeless = self.bad(self.found())
        given_up = _ends(hopeless) & (lift >= self.options.highest)
        self.tips = np.where(given_up[:, None], start, self.tips)
        lift = np.where(given_up, 0.0, lift)
        return int((lift > 0.0).sum()), float(lift.max())

    def drop(self, bad: Bools) -> int:
        """Turn gouging motions into links above the part; return how many."""
        self.dropped |= bad
        inner = _ends(bad)
        # Where a cut goes on, its end stays; what lies between is raised.
        keeps = _ends(self.cut & ~self.dropped)
        high = inner & ~keeps
        self.tips = np.where(high[:, None], self.tips + self.options.highest * self.axes, self.tips)
        return int(bad.sum())

    def toolpath(self) -> Toolpath:
        """Return the toolpath of the waypoints as they are now."""
        link_feeds = [s.feed for s in self.path.segments if s.kind is SegmentKind.LINK]
        segments: list[Segment] = []
        for k, old in enumerate(self.path.segments):
            a, b = int(self.path.starts[k]), int(self.path.starts[k + 1])
            breaks = [a, *(a + 1 + np.flatnonzero(np.diff(self.dropped[a:b].astype(np.int8)))).tolist(), b]
            for p, q in pairwise(breaks):
                fields = {"tips": self.tips[p : q + 1], "axes": self.axes[p : q + 1]}
                if self.dropped[p]:
                    fields |= {"kind": SegmentKind.LINK, "feed": link_feeds[0] if link_feeds else old.feed}
                segments.append(replace(old, **fields))
        return Toolpath(tuple(segments), self.path.pivot)


def _motions(work: _Work, rows: Ints) -> Sweep:
    """Return what the motions `rows` meet beyond the tolerance."""
    if not len(rows):
        empty = np.zeros((0, 3))
        return Sweep(empty, empty, np.zeros((0, 3, 3)), empty.astype(np.intp))
    # Runs of neighbours share their poses; cutting them apart costs nothing.
    tips = np.stack([work.tips[rows], work.tips[rows + 1]], axis=1).reshape(-1, 3)
    axes = np.stack([work.axes[rows], work.axes[rows + 1]], axis=1).reshape(-1, 3)
    return sweep(work.tree, work.tool, tips, axes, threshold=work.options.tolerance, progress=work.progress, every=2)


def _ends(motions: Bools) -> Bools:
    """Return which waypoints (N,) begin or end one of the motions (N − 1,)."""
    ends = np.zeros(len(motions) + 1, dtype=np.bool_)
    ends[:-1] |= motions
    ends[1:] |= motions
    return ends


def _leaned(axes: Floats, t1: Floats, t2: Floats, turn: Floats) -> Floats:
    """Return axes (N, 3) leaned by tangents `turn` (N, 2) along t1 and t2."""
    mixed = axes + turn[:, :1] * t1 + turn[:, 1:] * t2
    mixed = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return np.where((turn == 0.0).all(axis=1)[:, None], axes, mixed)


_FADE = 0.75


def _faded(turn: Floats) -> Floats:
    """Return turns (N, 2) carried over to neighbours, three quarters of it at each step away."""
    result = turn.copy()
    for order, before in ((range(1, len(turn)), -1), (range(len(turn) - 2, -1, -1), 1)):
        for k in order:
            carried = _FADE * result[k + before]
            if np.square(carried).sum() > max(np.square(result[k]).sum(), 1e-6):
                result[k] = carried
    return result
