"""Ways out of a part: straight motions of the tool from the end of a cut to above the clearance level."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.directions import normalised, tangent_frame
from pentapod.geometry.polyline import spaced
from pentapod.geometry.solids import Solid
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath.linking.links import LinkStyle, Poses
from pentapod.toolpath.toolpath import Segment, SegmentKind


@dataclass(frozen=True)
class WayOutSearch(Value):
    """Which ways out are tried: along the axis, after a step aside, along the view, in other directions, from back.

    withdrawals: lengths on feed, in approaches, before the tool rises along the view; the last way is as long as the
    part is large. aside: step away from the nearest point of the part, in approaches; little: shorter ones, as in a
    hole, after which the tool rises. leans: angles between axis and other directions, radians; spokes: directions for
    each. back: shares of the cut that the tool goes back on it. gap: to the part on new rapids, metres. lever: length
    of a rapid that a turn of one radian needs, metres.
    """

    withdrawals: tuple[float, ...] = (1.0, 3.0, 10.0)
    aside: float = 0.3
    little: tuple[float, ...] = (0.1, 0.03)
    leans: tuple[float, ...] = (0.35, 0.8, 1.2)
    spokes: int = 8
    back: tuple[float, ...] = (0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0)
    gap: float = 1e-4
    lever: float = 0.02


@dataclass(frozen=True, eq=False)
class WayOut:
    """A way out. links: on feed, from the end of a cut. axis (3,): from their end on. corners (2, 3): of the rapid."""

    links: tuple[Segment, ...]
    axis: Floats
    corners: Floats


class WaysOut:
    """The search for ways out of one part. clear: whether a link or rapid is clear of the part."""

    def __init__(
        self,
        tree: FacetTree,
        solids: tuple[Solid, ...],
        style: LinkStyle,
        clear: Callable[[Segment], bool],
        search: WayOutSearch = WayOutSearch(),
    ) -> None:
        self.tree, self.solids, self.style, self.clear, self.search = tree, solids, style, clear, search
        low, high = tree.extents[0]
        self._size = float(np.linalg.norm(high - low))
        corners = np.array(list(product(*zip(low, high, strict=True))))
        self._top = float((corners @ style.view).max())

    def level(self, *axes: Floats) -> float:
        """Return the height of tips along the view at which the tool with these axes is above the part."""
        turned = np.stack(axes)
        if len(turned) > 1:
            shares = np.linspace(0.0, 1.0, 9)[:, None]
            mixed = (1.0 - shares) * turned[0] + shares * turned[-1]
            turned = normalised(mixed + 1e-9 * tangent_frame(turned[0])[0])
        rise = turned @ self.style.view
        across = np.sqrt(np.maximum(1.0 - rise**2, 0.0))
        lowest = min(
            float((height * rise - (radius * across + solid.rounding)).min())
            for solid in self.solids
            for height, radius in ((solid.low, solid.low_radius), (solid.high, solid.high_radius))
        )
        return max(self.style.level, self._top - lowest + self.style.approach)

    def of(self, poses: Poses) -> WayOut | None:
        """Return the first clear way out from the last of the poses of a cut; None where none is found."""
        tips, axes = poses
        for way in self._from(tips[-1], axes[-1]):
            return way
        last = len(tips) - 1
        for place in sorted({last - max(1, round(share * last)) for share in self.search.back}, reverse=True):
            for way in self._from(tips[place], axes[place]):
                back = Segment(SegmentKind.LINK, tips[place:][::-1], axes[place:][::-1], self.style.feed)
                return WayOut((back, *way.links), way.axis, way.corners)
        return None

    def _from(self, tip: Floats, axis: Floats) -> Iterator[WayOut]:
        """Yield the clear ways out from a pose, the best first."""
        level = self.level(axis)
        for corners in self._trials(tip, axis):
            points = spaced(corners, self.style.spacing)
            link = Segment(SegmentKind.LINK, points, np.tile(axis, (len(points), 1)), self.style.feed)
            if not self.clear(link):
                continue
            knee = corners[-1]
            up = knee + max(level - float(knee @ self.style.view), self.style.approach) * self.style.view
            points = spaced(np.stack([knee, up]), self.style.rapid_spacing)
            if self.clear(Segment(SegmentKind.RAPID, points, np.tile(axis, (len(points), 1)), np.inf)):
                yield WayOut((link,), axis, np.stack([knee, up]))

    def _trials(self, tip: Floats, axis: Floats) -> Iterator[Floats]:
        """Yield the corners (n, 3) of the motions on feed that are tried."""
        lengths = [share * self.style.approach for share in self.search.withdrawals if share > 0.0]
        reach = max((solid.top + solid.largest_radius for solid in self.solids), default=0.0)
        lengths = [*(length for length in lengths if length < self._size), self._size + reach]
        middle = tip + self.style.approach * axis
        _, away, facet = self.tree.closest(middle[None])
        off = float(np.linalg.norm(away[0]))
        aside = self.style.approach * (away[0] / off if off > 0.0 else axis)
        yield from (np.stack([tip, tip + length * axis]) for length in lengths)
        if facet[0] >= 0:
            beside = tip + self.search.aside * aside
            yield from (np.stack([tip, beside, beside + length * axis]) for length in lengths)
            for share in (self.search.aside, *self.search.little):
                beside = tip + share * aside
                yield from (np.stack([tip, beside, beside + length * self.style.view]) for length in lengths)
        first, second = tangent_frame(axis)
        for lean in self.search.leans:
            for turn in 2.0 * np.pi * np.arange(self.search.spokes) / self.search.spokes:
                direction = np.cos(lean) * axis + np.sin(lean) * (np.cos(turn) * first + np.sin(turn) * second)
                yield from (np.stack([tip, tip + length * direction]) for length in lengths)
