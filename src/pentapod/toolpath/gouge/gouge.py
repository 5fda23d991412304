"""Gouge check of every motion against the part; gouging cuts are tilted clear, lifted, dropped, or only reported."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import check_size
from pentapod.base.progress import Progress, silent
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import tangent_frame
from pentapod.geometry.polyline import spaced
from pentapod.geometry.runs import equal_runs, marked_runs
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.swept_depth import RESOLUTION_M, Sweep, sweep, touch
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath.gouge.report import GougeOptions, GougeReport, Remedy
from pentapod.toolpath.linking.links import RAPID_SPACING_M
from pentapod.toolpath.linking.relinking import relinked
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath


def without_gouges(
    toolpath: Toolpath, tool: Tool, part: Mesh, options: GougeOptions, progress: Progress = silent
) -> tuple[Toolpath, GougeReport]:
    """Return `checked` against a part as it is loaded: the toolpath with its gouges remedied, and what was found.

    Raises ToolpathError for lengths of the options that are much larger than the part.
    """
    check_size(options, float(np.ptp(part.bounds, axis=0).max()), ToolpathError)
    return checked(toolpath, tool, FacetTree.of(part), options, progress)


def checked(
    toolpath: Toolpath, tool: Tool, tree: FacetTree, options: GougeOptions, progress: Progress = silent
) -> tuple[Toolpath, GougeReport]:
    """Return the toolpath with its gouges remedied as the options say, and what was found and done.

    Cuts alone are changed; a cut that begins or ends elsewhere than before takes its neighbours' ends along. Dropped
    motions become links on feed, up along the axis, over what was dropped and down again, as low as is clear. In the
    end every motion of the result is checked: what no remedy cures, and links and rapids that meet the part, are told.
    """
    cut = np.array([toolpath.segments[k].kind is SegmentKind.CUT for k in toolpath.segment_of_interval])
    work = _Work(toolpath, tool, tree, options, cut, progress)
    first = work.found()
    bad = work.bad(first)
    report = GougeReport(
        motions=int(cut.sum()),
        gouging=int(bad.sum()),
        depths=tuple(float(d) for d in first.depths.max(axis=0, initial=-np.inf)),  # type: ignore[arg-type]
    )
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
    result = work.toolpath() if report.gouging else toolpath
    depths, cutting = _standing(result, work)
    if options.links is not None and (depths[~cutting] > -np.inf).any():
        result, changed = relinked(result, (depths > -np.inf) & ~cutting, options.links, work.clear)
        report = replace(report, relinked=changed)
        depths, cutting = _standing(result, work) if changed else (depths, cutting)
    left, unclear = (depths > -np.inf) & cutting, (depths > -np.inf) & ~cutting
    return result, replace(
        report,
        left=int(left.sum()),
        left_depth=float(depths[left].max(initial=0.0)),
        places=_begins(left),
        unclear=int(unclear.sum()),
        unclear_places=_begins(unclear),
    )


def _standing(path: Toolpath, work: _Work) -> tuple[Floats, Bools]:
    """Return how deep (N − 1,) what is in the way of each motion is, −inf for nothing; and which motions cut."""
    kinds = np.array([path.segments[k].kind for k in path.segment_of_interval])
    depths = np.full(len(kinds), -np.inf)
    for kind in SegmentKind:
        rows = np.flatnonzero(kinds == kind)
        depths[rows] = _met(work, path.tips, path.axes, rows, work.threshold(kind)).deepest
    return depths, np.asarray(kinds == SegmentKind.CUT)


def _begins(marked: Bools) -> tuple[int, ...]:
    """Return where each run of marked motions (N − 1,) begins."""
    return tuple(marked_runs(marked)[:, 0].tolist())


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
        met = _met(self, self.tips, self.axes, rows, self.options.tolerance)
        depths = np.full((len(self.cut), 3), -np.inf)
        depths[rows] = met.depths
        times, facets = np.full((len(self.cut), 3), np.nan), np.full((len(self.cut), 3), -1, dtype=np.intp)
        points = np.full((len(self.cut), 3, 3), np.nan)
        times[rows], points[rows], facets[rows] = met.times, met.points, met.facets
        return Sweep(depths, times, points, facets)

    def threshold(self, kind: SegmentKind) -> float:
        """Return the depth, metres, from which a motion of a kind meets the part: a rapid may not even touch."""
        return RESOLUTION_M if kind is SegmentKind.RAPID else self.options.tolerance

    def clear(self, segment: Segment) -> bool:
        """Return whether a segment does not meet the part."""
        met = sweep(self.tree, self.tool, segment.tips, segment.axes, threshold=self.threshold(segment.kind))
        return bool((met.deepest == -np.inf).all())

    def bad(self, met: Sweep) -> Bools:
        """Return which motions (N − 1,) are too deep."""
        return met.beyond(self.options.tolerance)

    def tilt(self, bad: Bools) -> int:
        """Turn the axes at gouging waypoints, the least that clears them, about the tilt centre; return their number.

        The turn fades out over the neighbours on either side, so that the axis does not jump.
        """
        tilt_centres = self.tips + self.tool.tilt_centre * self.axes
        original = self.axes.copy()
        turn = np.zeros((len(self.tips), 2))
        t1, t2 = tangent_frame(original)
        search = self.options.search
        for _ in range(search.rounds):
            rows = np.flatnonzero(_ends(bad))
            open_rows = rows
            for ring in range(1, search.rings + 1):
                angle = np.tan(self.options.cone * ring / search.rings)
                for spoke in range(search.spokes):
                    if not len(open_rows):
                        break
                    way = 2.0 * np.pi * spoke / search.spokes
                    trial = np.tile([angle * np.cos(way), angle * np.sin(way)], (len(open_rows), 1))
                    axes = _leaned(original[open_rows], t1[open_rows], t2[open_rows], trial)
                    tips = tilt_centres[open_rows] - self.tool.tilt_centre * axes
                    met = touch(self.tree, self.tool, tips, axes, threshold=0.5 * self.options.tolerance)
                    clear = met.deepest == -np.inf
                    turn[open_rows[clear]] = trial[clear]
                    open_rows = open_rows[~clear]
            faded = _faded(turn, search.fade)
            self.axes = _leaned(original, t1, t2, faded)
            self.tips = np.where(
                (faded != 0.0).any(axis=1)[:, None], tilt_centres - self.tool.tilt_centre * self.axes, self.tips
            )
            bad = bad | self.bad(self.found())
            if not self.bad(self.found()).any():
                break
        return int((self.axes != original).any(axis=1).sum())

    def lift(self, bad: Bools) -> tuple[int, float]:
        """Raise gouging waypoints along their axes until their motions are clear; return how many, and the most."""
        lift, start = np.zeros(len(self.tips)), self.tips.copy()
        for _ in range(self.options.search.lifts):
            met = _met(self, self.tips, self.axes, np.flatnonzero(bad), self.options.tolerance)
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
        # Where a cut goes on, its end stays; where a link comes to one that is dropped, it ends above.
        high = _ends(bad) & ~self._kept()
        self.tips = np.where(high[:, None], self.tips + self.options.highest * self.axes, self.tips)
        return int(bad.sum())

    def _kept(self) -> Bools:
        """Return which waypoints (N,) belong to a cut that is not dropped."""
        return _ends(self.cut & ~self.dropped)

    def _bridge(self, first: int, last: int) -> tuple[Floats, Floats]:
        """Return tips and axes of the link from waypoint `first` to `last`: the lowest that is clear, else the highest.

        From a kept end up along its axis, above the waypoints between, and down; raised ends are there already.
        """
        kept = self._kept()
        over = slice(first + (not kept[first]), last + int(kept[last]))
        way = self.tips[first : last + 1], self.axes[first : last + 1]
        for rise in self.options.search.rises:
            middle = self.path.tips[over] + rise * self.options.highest * self.axes[over]
            tips, axes = [self.tips[first : first + 1]], [self.axes[first : first + 1]]
            if kept[first]:
                up = spaced(np.stack([self.tips[first], middle[0]]), RAPID_SPACING_M)[1:-1]
                tips, axes = [*tips, up], [*axes, np.tile(self.axes[first], (len(up), 1))]
            tips, axes = [*tips, middle], [*axes, self.axes[over]]
            if kept[last]:
                down = spaced(np.stack([middle[-1], self.tips[last]]), RAPID_SPACING_M)[1:-1]
                tips, axes = [*tips, down], [*axes, np.tile(self.axes[last], (len(down), 1))]
            tips, axes = [*tips, self.tips[last : last + 1]], [*axes, self.axes[last : last + 1]]
            way = np.concatenate(tips), np.concatenate(axes)
            rows = np.arange(len(way[0]) - 1)
            if (_met(self, *way, rows, self.options.tolerance).deepest == -np.inf).all():
                break
        return way

    def toolpath(self) -> Toolpath:
        """Return the toolpath of the waypoints as they are now."""
        link_feeds = [s.feed for s in self.path.segments if s.kind is SegmentKind.LINK]
        segments: list[Segment] = []
        for k, old in enumerate(self.path.segments):
            a, b = int(self.path.starts[k]), int(self.path.starts[k + 1])
            for p, q in (a + equal_runs(self.dropped[a:b])).tolist():
                dwell = old.dwell if q == b else None
                if self.dropped[p]:
                    feed = link_feeds[0] if link_feeds else old.feed
                    segments.append(Segment(SegmentKind.LINK, *self._bridge(p, q), feed, dwell=dwell))
                else:
                    segments.append(replace(old, tips=self.tips[p : q + 1], axes=self.axes[p : q + 1], dwell=dwell))
        return replace(self.path, segments=tuple(segments))


def _met(work: _Work, tips: Floats, axes: Floats, rows: Ints, threshold: float) -> Sweep:
    """Return what the motions `rows` between poses (N, 3), (N, 3) meet beyond a threshold, metres."""
    if not len(rows):
        empty = np.zeros((0, 3))
        return Sweep(empty, empty, np.zeros((0, 3, 3)), empty.astype(np.intp))
    # Runs of neighbours share their poses; cutting them apart costs nothing.
    tips = np.stack([tips[rows], tips[rows + 1]], axis=1).reshape(-1, 3)
    axes = np.stack([axes[rows], axes[rows + 1]], axis=1).reshape(-1, 3)
    return sweep(work.tree, work.tool, tips, axes, threshold=threshold, progress=work.progress, every=2)


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


def _faded(turn: Floats, fade: float) -> Floats:
    """Return turns (N, 2) carried over to neighbours, a share of them at each step away."""
    result = turn.copy()
    for order, before in ((range(1, len(turn)), -1), (range(len(turn) - 2, -1, -1), 1)):
        for k in order:
            carried = fade * result[k + before]
            if np.square(carried).sum() > max(np.square(result[k]).sum(), 1e-6):
                result[k] = carried
    return result
