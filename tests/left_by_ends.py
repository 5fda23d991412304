"""What a toolpath of a bull-nose or flat end with axis +z leaves and what it cuts too deep, by OpenCAMLib.

The limit of what the cutter can reach is where OpenCAMLib's drop cutter lets it rest, and all above, down to the lowest
point of the part. What is left at a point of the part is its distance from the cutter's nearest position. A cutter that
is smaller by a tolerance all around must never be below the height at which it would rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np
from scipy.spatial import KDTree

from left_material import columns_at_jumps, dense
from pentapod import Mesh
from pentapod.cutters.bull_nose import BullNose
from pentapod.toolpath import SegmentKind, Toolpath


def rest_heights(part: Mesh, places, radius: float, corner: float):
    """Heights (N,) of the tip of an end dropped at places (N, 2), by OpenCAMLib; −inf where it meets nothing."""
    import opencamlib as ocl

    surface, drop = ocl.STLSurf(), ocl.BatchDropCutter()
    for facet in (1e3 * part.vertices[part.faces]).tolist():
        surface.addTriangle(ocl.Triangle(*(ocl.Point(*point) for point in facet)))
    drop.setSTL(surface)
    wide, long = 2e3 * radius, 200.0
    cutter = ocl.BullCutter(wide, 1e3 * corner, long) if corner else ocl.CylCutter(wide, long)
    drop.setCutter(cutter)  # OpenCAMLib holds no reference of its own
    nothing = float(1e3 * part.bounds[0, 2]) - 100.0
    for x, y in (1e3 * np.asarray(places)).tolist():
        drop.appendPoint(ocl.CLPoint(x, y, nothing))
    drop.run()
    heights = np.array([point.z for point in drop.getCLPoints()])
    return np.where(heights > nothing, 1e-3 * heights, -np.inf)


class ReachableTips:
    """The lowest tips of an end from above, about `pitch` metres apart, upright columns at jumps among them."""

    def __init__(self, part: Mesh, tool: BullNose, pitch: float = 2e-4) -> None:
        self.part, self.tool, self.pitch = part, tool, pitch
        self.lowest = float(part.bounds[0, 2])
        wide = tool.radius + pitch
        low, high = part.bounds[0][:2] - wide, part.bounds[1][:2] + wide + pitch
        lines = [np.arange(a + 0.37 * pitch, b, pitch) for a, b in zip(low, high, strict=True)]
        grid = self._at(np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2))
        grid = grid.reshape(len(lines[0]), len(lines[1]), 3)
        tips = [grid.reshape(-1, 3)]
        for a, b in ((grid[:-1], grid[1:]), (grid[:, :-1], grid[:, 1:])):
            tips += self._between(a.reshape(-1, 3), b.reshape(-1, 3))
        tips = np.concatenate(tips)
        self.tips = tips[tips[:, 2] >= self.lowest]

    def _at(self, places):
        heights = rest_heights(self.part, places, self.tool.radius, self.tool.corner)
        return np.column_stack([places, np.maximum(heights, self.lowest - 1e-3)])

    def _between(self, a, b, rounds=9):
        """Tips between neighbours (E, 3) where heights are steep; in the end upright columns."""
        made = []
        for _ in range(rounds):
            steep = np.abs(a[:, 2] - b[:, 2]) > 2.0 * self.pitch
            a, b = a[steep], b[steep]
            middle = self._at(0.5 * (a[:, :2] + b[:, :2]))
            made.append(middle)
            a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        return [*made, columns_at_jumps(a, b, self.pitch)]

    def samples(self, count: int, steepest_deg: float = 90.0, seed: int = 2):
        """Points (N, 3) spread evenly over what is seen from above, walls too, not what is lowest on the outside."""
        rng, part = np.random.default_rng(seed), self.part
        wanted = part.facet_normals[:, 2] >= np.cos(np.radians(steepest_deg)) - 1e-9
        area = part.facet_areas * wanted
        facet = rng.choice(len(area), count, p=area / area.sum())
        weights = rng.dirichlet([1.0, 1.0, 1.0], count)[:, :, None]
        points = (part.vertices[part.faces[facet]] * weights).sum(axis=1)
        beside = points + 3e-6 * part.facet_normals[facet]
        return points[rest_heights(part, beside[:, :2], 1e-6, 0.0) < beside[:, 2] + 2e-5]


def distances(tool: BullNose, way):
    """Distance of points from the cutting part of a tool: way (..., 3) from its tip. Negative inside a rounding."""
    out = np.maximum(np.hypot(way[..., 0], way[..., 1]) - (tool.radius - tool.corner), 0.0)
    beyond = np.maximum(np.maximum(tool.corner - way[..., 2], way[..., 2] - (tool.flute or tool.corner)), 0.0)
    return np.hypot(out, beyond) - tool.corner


class Nearest:
    """The nearest of many positions of a cutter."""

    def __init__(self, tool: BullNose, tips, reach: float = 3e-3) -> None:
        self.tool, self.tips, self.reach, self.tree = tool, tips, reach, KDTree(tips[:, :2])

    def of(self, points):
        """Distances (N,) of points (N, 3), and the tip (N, 3) in the middle of those that are about as near."""
        found, home = np.full(len(points), self.reach), np.full((len(points), 3), np.nan)
        for first in range(0, len(points), 200):
            part = points[first : first + 200, :2]
            for k, rows in enumerate(self.tree.query_ball_point(part, self.tool.radius + self.reach), first):
                if rows:
                    own = self.tips[rows]
                    away = distances(self.tool, points[k] - own)
                    least = away.min()
                    if least < self.reach:
                        same = own[away < least + 2e-5]
                        found[k] = least
                        home[k] = same[np.linalg.norm(same - same.mean(axis=0), axis=1).argmin()]
        return found, home


@dataclass(frozen=True)
class LeftByEnd:
    """What a toolpath leaves on samples, metres. limit, excess, allowed, lifts, cut, links, air: as in `Left`.

    off: distance of the nearest cut from the tip that would leave least.
    """

    tool: BullNose
    stepover: float
    limit: np.ndarray
    excess: np.ndarray
    allowed: np.ndarray
    off: np.ndarray
    cut: float
    links: float
    air: float
    lifts: int

    @property
    def missed(self) -> float:
        """Share of the samples whose best tip is farther from a cut than half a stepover and 0.2 mm."""
        return float((self.off > 0.5 * self.stepover + 2e-4).mean())

    @property
    def beyond(self) -> float:
        """Share of the samples with an excess of more than 1.18 ridges of a ball as wide as the tool, see `Left`."""
        return float((self.excess > self.most).mean())

    @cached_property
    def most(self):
        radius = self.tool.radius
        ridge = 1.18 * (radius - np.sqrt(radius**2 - 0.25 * self.stepover**2))
        return np.where(self.limit > 0.03 * radius, ridge, np.maximum(ridge, self.allowed))


def left_by_end(reachable: ReachableTips, points, toolpath: Toolpath, stepover: float) -> LeftByEnd:
    """Measure what a toolpath leaves on points of a part, and how it moves."""
    tool = reachable.tool
    lines = [(s.tips, s.kind) for s in toolpath.segments]
    length = {
        k: sum(np.linalg.norm(np.diff(x, axis=0), axis=1).sum() for x, kind in lines if kind is k) for k in SegmentKind
    }
    gap, home = Nearest(tool, reachable.tips).of(points)
    cuts = np.concatenate([dense(line, 1e-4) for line, kind in lines if kind is SegmentKind.CUT])
    near, allowed = KDTree(reachable.tips), np.zeros(len(points))
    known = np.isfinite(home[:, 0])
    for k in np.flatnonzero(known):
        around = reachable.tips[near.query_ball_point(home[k], 0.5 * stepover + reachable.pitch)]
        allowed[k] = distances(tool, points[k] - around).max() - gap[k]
    kinds = [k for _, k in lines]
    first, last = kinds.index(SegmentKind.CUT), len(kinds) - kinds[::-1].index(SegmentKind.CUT)
    between = [set(run) for cut, run in groupby(kinds[first:last], lambda k: k is SegmentKind.CUT) if not cut]
    return LeftByEnd(
        tool,
        stepover,
        limit=gap,
        excess=Nearest(tool, cuts).of(points)[0] - gap,
        allowed=allowed,
        off=KDTree(cuts).query(home[known])[0],
        cut=length[SegmentKind.CUT],
        links=length[SegmentKind.LINK],
        air=length[SegmentKind.RAPID],
        lifts=sum(SegmentKind.RAPID in run for run in between),
    )


def gouges(part: Mesh, tool: BullNose, toolpath: Toolpath, tolerance: float, step: float = 1e-4) -> int:
    """Number of places along a toolpath where the part is deeper in the cutter than a tolerance, in metres."""
    moves = np.concatenate([dense(s.tips, step) for s in toolpath.segments])
    corner = max(tool.corner - tolerance, 0.0)
    heights = rest_heights(part, moves[:, :2], tool.radius - tolerance, corner)
    return int((heights > moves[:, 2] + tolerance + 1e-9).sum())
