"""Gouge check of every motion against the part; gouging cuts are tilted, lifted, dropped, or only reported."""

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
from pentapod.mesh.query.swept_depth import RESOLUTION_M, is_clear, meets, sweep, touch
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath.gouge.report import GougeOptions, GougeReport, Remedy
from pentapod.toolpath.linking.clear_links import cleared
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.linking.ways_out import WaysOut
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath


def without_gouges(
    toolpath: Toolpath, tool: Tool, part: Mesh, options: GougeOptions, progress: Progress = silent
) -> tuple[Toolpath, GougeReport]:
    """Return the toolpath with its gouges removed as the options say, and a report.

    Only cuts are changed; links and rapids follow the changed ends of a cut. Dropped motions become links on feed, up
    along the axis, over the dropped motions and down again, as low as is clear. Finally every motion of the result is
    checked: gouges that remain, and links and rapids that collide with the part, are reported. Raises ToolpathError for
    lengths of the options that are much larger than the part.

    >>> clean, report = without_gouges(toolpath, tool, part, GougeOptions(remedies=(Remedy.DROP,)))
    >>> report.left
    0
    """
    check_size(options, float(np.ptp(part.bounds, axis=0).max()), ToolpathError)
    cut = np.array([toolpath.segments[k].kind is SegmentKind.CUT for k in toolpath.segment_of_interval])
    removal = _GougeRemoval(toolpath, tool, FacetTree.of(part), options, cut, progress)
    depths = removal.cut_depths()
    bad = depths.max(axis=1) > options.tolerance
    report = GougeReport(
        motions=int(cut.sum()),
        gouging=int(bad.sum()),
        depths=tuple(float(d) for d in depths.max(axis=0, initial=-np.inf)),  # type: ignore[arg-type]
    )
    for remedy in options.remedies:
        if not bad.any():
            break
        if remedy is Remedy.TILT and tool.can_tilt:
            report = replace(report, tilted=removal.tilt(bad))
        elif remedy is Remedy.LIFT:
            lifted, most = removal.lift(bad)
            report = replace(report, lifted=lifted, most_lifted=most)
        elif remedy is Remedy.DROP:
            dropped = removal.drop(bad)
            lost = {"dropped_share": removal.dropped_share(), "dropped_centres": removal.dropped_centres()}
            report = replace(report, dropped=dropped, **lost)
        bad = removal.gouging()
    result = removal.toolpath() if report.gouging else toolpath
    depths, cutting = removal.all_depths(result)
    if options.links is not None and (depths[~cutting] > -np.inf).any():
        ways = WaysOut(removal.tree, tool.solids, options.links, removal.is_clear, options.ways)
        found = cleared(result, (depths > -np.inf) & ~cutting, ways, may_drop=Remedy.DROP in options.remedies)
        result, report = found.path, replace(report, relinked=found.replaced, stuck=found.dropped)
        depths, cutting = removal.all_depths(result)
    left, unclear = (depths > -np.inf) & cutting, (depths > -np.inf) & ~cutting
    return result, replace(
        report,
        left=int(left.sum()),
        left_depth=float(depths[left].max(initial=0.0)),
        places=_run_begins(left),
        unclear=int(unclear.sum()),
        unclear_places=_run_begins(unclear),
    )


class _GougeRemoval:
    """The waypoints of a toolpath while gouges are removed. cut (N − 1,): which motions cut."""

    def __init__(
        self, path: Toolpath, tool: Tool, tree: FacetTree, options: GougeOptions, cut: Bools, progress: Progress
    ) -> None:
        self.path, self.tool, self.tree, self.options, self.cut = path, tool, tree, options, cut
        self.tips, self.axes = path.tips.copy(), path.axes.copy()
        self.dropped = np.zeros(len(cut), dtype=np.bool_)
        self.progress = progress

    def cut_depths(self) -> Floats:
        """Return how deep (N − 1, 3) cutter, shank and holder gouge on each motion; −inf: not, or no cut."""
        rows = np.flatnonzero(self.cut & ~self.dropped)
        depths = np.full((len(self.cut), 3), -np.inf)
        depths[rows] = self._depths(self.tips, self.axes, rows, self.options.tolerance)
        return depths

    def gouging(self) -> Bools:
        """Return which motions (N − 1,) gouge."""
        rows = np.flatnonzero(self.cut & ~self.dropped)
        pairs = (np.stack([poses[rows], poses[rows + 1]], axis=1).reshape(-1, 3) for poses in (self.tips, self.axes))
        met = np.zeros(len(self.cut), dtype=np.bool_)
        met[rows] = meets(self.tree, self.tool, *pairs, threshold=self.options.tolerance, every=2)
        return met

    def all_depths(self, path: Toolpath) -> tuple[Floats, Bools]:
        """Return how deep (N − 1,) the tool collides on each motion of a path, −inf: not; and which motions cut."""
        kinds = np.array([path.segments[k].kind for k in path.segment_of_interval])
        depths = np.full(len(kinds), -np.inf)
        for kind in SegmentKind:
            rows = np.flatnonzero(kinds == kind)
            depths[rows] = self._depths(path.tips, path.axes, rows, self._tolerance(kind)).max(axis=1)
        return depths, np.asarray(kinds == SegmentKind.CUT)

    def is_clear(self, segment: Segment) -> bool:
        """Return whether a new segment does not collide with the part; a rapid keeps a gap to it."""
        rapid = segment.kind is SegmentKind.RAPID
        threshold = -self.options.ways.gap if rapid else self._tolerance(segment.kind)
        return is_clear(self.tree, self.tool, segment.tips, segment.axes, threshold=threshold)

    def _tolerance(self, kind: SegmentKind) -> float:
        """Return the depth, metres, from which a motion of a kind collides: a rapid may not even touch."""
        return RESOLUTION_M if kind is SegmentKind.RAPID else self.options.tolerance

    def _depths(self, tips: Floats, axes: Floats, rows: Ints, threshold: float) -> Floats:
        """Return how deep (n, 3) the tool collides on the motions `rows` between poses (N, 3), −inf up to threshold."""
        if not len(rows):
            return np.zeros((0, 3))
        # Each motion has a pair of poses: neighbours need not be in `rows`.
        pairs = (np.stack([poses[rows], poses[rows + 1]], axis=1).reshape(-1, 3) for poses in (tips, axes))
        return sweep(self.tree, self.tool, *pairs, threshold=threshold, progress=self.progress, every=2).depths

    def tilt(self, bad: Bools) -> int:
        """Tilt the axes at gouging waypoints about the tilt centre by the least clear angle; return their number.

        The tilt fades out over the neighbours on either side, so that the axis does not jump.
        """
        centres = self.tips + self.tool.tilt_centre * self.axes
        original = self.axes.copy()
        turn = np.zeros((len(self.tips), 2))
        t1, t2 = tangent_frame(original)
        search = self.options.search
        for _ in range(search.rounds):
            remaining = np.flatnonzero(_waypoints_of(bad))
            for ring in range(1, search.rings + 1):
                angle = np.tan(self.options.cone * ring / search.rings)
                for spoke in range(search.spokes):
                    if not len(remaining):
                        break
                    direction = 2.0 * np.pi * spoke / search.spokes
                    trial = np.tile([angle * np.cos(direction), angle * np.sin(direction)], (len(remaining), 1))
                    axes = _tilted(original[remaining], t1[remaining], t2[remaining], trial)
                    tips = centres[remaining] - self.tool.tilt_centre * axes
                    met = touch(self.tree, self.tool, tips, axes, threshold=0.5 * self.options.tolerance)
                    clear = met.deepest == -np.inf
                    turn[remaining[clear]] = trial[clear]
                    remaining = remaining[~clear]
            faded = _faded(turn, search.fade)
            self.axes = _tilted(original, t1, t2, faded)
            changed = (faded != 0.0).any(axis=1)[:, None]
            self.tips = np.where(changed, centres - self.tool.tilt_centre * self.axes, self.tips)
            gouging = self.gouging()
            bad = bad | gouging
            if not gouging.any():
                break
        return int((self.axes != original).any(axis=1).sum())

    def lift(self, bad: Bools) -> tuple[int, float]:
        """Raise gouging waypoints along their axes until their motions are clear; return how many, and the most."""
        lift, start, tolerance = np.zeros(len(self.tips)), self.tips.copy(), self.options.tolerance
        for _ in range(self.options.search.lifts):
            depth = np.zeros(len(bad))
            depth[bad] = np.maximum(self._depths(self.tips, self.axes, np.flatnonzero(bad), tolerance).max(axis=1), 0.0)
            bad = depth > tolerance
            if not bad.any():
                break
            need = np.zeros(len(lift))
            need[:-1] = np.where(bad, 1.2 * depth + 0.1 * tolerance, 0.0)
            need[1:] = np.maximum(need[1:], need[:-1])
            lift = np.minimum(lift + need, self.options.highest)
            self.tips = start + lift[:, None] * self.axes
            # Neighbours of a raised motion have changed too: they are checked again.
            changed = _waypoints_of(bad)
            bad = self.cut & ~self.dropped & (changed[:-1] | changed[1:])
        hopeless = _waypoints_of(self.gouging()) & (lift >= self.options.highest)
        self.tips = np.where(hopeless[:, None], start, self.tips)
        lift = np.where(hopeless, 0.0, lift)
        return int((lift > 0.0).sum()), float(lift.max())

    def drop(self, bad: Bools) -> int:
        """Turn gouging motions into links above the part; return how many."""
        self.dropped |= bad
        # Ends of cuts that remain stay; other waypoints of dropped motions are raised.
        high = _waypoints_of(bad) & ~self._kept()
        self.tips = np.where(high[:, None], self.tips + self.options.highest * self.axes, self.tips)
        return int(bad.sum())

    def dropped_share(self) -> float:
        """Return the share of the length of the path's cuts that is dropped, 0 to 1: along the part.

        Around an edge a ball goes far and touches one place.
        """
        places = self.path.tilt_centres - self.tree.closest(self.path.tilt_centres)[1]
        lengths = np.where(self.cut, np.linalg.norm(np.diff(places, axis=0), axis=1), 0.0)
        return float(lengths[self.dropped].sum() / max(lengths.sum(), np.finfo(np.float64).tiny))

    def dropped_centres(self) -> Floats:
        """Return the tilt centre at both ends (n, 2, 3) of each motion that is dropped."""
        centres = self.path.tilt_centres
        return np.stack([centres[:-1], centres[1:]], axis=1)[self.dropped]

    def _kept(self) -> Bools:
        """Return which waypoints (N,) belong to a cut that is not dropped."""
        return _waypoints_of(self.cut & ~self.dropped)

    def _bridge(self, first: int, last: int) -> tuple[Floats, Floats]:
        """Return tips and axes of the link from waypoint `first` to `last`: the lowest that is clear, else the highest.

        From a kept end up along its axis, above the waypoints between, and down; raised ends are there already.
        """
        kept = self._kept()
        over = slice(first + (not kept[first]), last + int(kept[last]))
        ends = self.tips[first : last + 1], self.axes[first : last + 1]
        link = ends
        for rise in self.options.search.rises:
            middle = self.path.tips[over] + rise * self.options.highest * self.axes[over]
            tips, axes = [ends[0][:1]], [ends[1][:1]]
            if kept[first]:
                up = spaced(np.stack([self.tips[first], middle[0]]), LinkStyle.rapid_spacing)[1:-1]
                tips, axes = [*tips, up], [*axes, np.tile(self.axes[first], (len(up), 1))]
            tips, axes = [*tips, middle], [*axes, self.axes[over]]
            if kept[last]:
                down = spaced(np.stack([middle[-1], self.tips[last]]), LinkStyle.rapid_spacing)[1:-1]
                tips, axes = [*tips, down], [*axes, np.tile(self.axes[last], (len(down), 1))]
            link = np.concatenate([*tips, ends[0][-1:]]), np.concatenate([*axes, ends[1][-1:]])
            if is_clear(self.tree, self.tool, *link, threshold=self.options.tolerance):
                break
        return link

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


def _run_begins(marked: Bools) -> tuple[int, ...]:
    """Return where each run of marked motions (N − 1,) begins."""
    return tuple(marked_runs(marked)[:, 0].tolist())


def _waypoints_of(motions: Bools) -> Bools:
    """Return which waypoints (N,) begin or end one of the motions (N − 1,)."""
    return np.concatenate([motions, [False]]) | np.concatenate([[False], motions])


def _tilted(axes: Floats, t1: Floats, t2: Floats, turn: Floats) -> Floats:
    """Return axes (N, 3) tilted by tangents `turn` (N, 2) along t1 and t2."""
    mixed = axes + turn[:, :1] * t1 + turn[:, 1:] * t2
    mixed = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return np.where((turn == 0.0).all(axis=1)[:, None], axes, mixed)


def _faded(turn: Floats, fade: float) -> Floats:
    """Return turns (N, 2) where each waypoint has at least a share `fade` of its neighbours' turn."""
    result = turn.copy()
    for order, before in ((range(1, len(turn)), -1), (range(len(turn) - 2, -1, -1), 1)):
        for k in order:
            carried = fade * result[k + before]
            if np.square(carried).sum() > max(np.square(result[k]).sum(), 1e-6):
                result[k] = carried
    return result
