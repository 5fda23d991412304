"""What a toolpath of a ball leaves on a part, cuts too deep and runs in vain, measured without the planner's formulas.

The limit of what a ball can reach from above is where a drop cutter lets it rest, and all above: a height over the
plane, sampled ever finer where it is steep. What is left at a point of the part is its distance from the ball's nearest
way, less the radius; what is beyond the limit is that, less what even the nearest reachable centre leaves.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

from pentapod import Mesh
from pentapod.mesh.offset.drop_cutter import drop_cutter
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath import SegmentKind, Toolpath


def columns_at_jumps(a, b, pitch):
    """Points, `pitch` apart, upwards from the lower of neighbours (E, 3) whose heights differ by more than that."""
    jump = np.abs(a[:, 2] - b[:, 2]) > pitch
    a, b = a[jump], b[jump]
    lower = np.where((a[:, 2] < b[:, 2])[:, None], a, b)
    count = np.ceil(np.abs(a[:, 2] - b[:, 2]) / pitch).astype(int)
    owner = np.repeat(np.arange(len(count)), count)
    column = lower[owner]
    column[:, 2] += (np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)) * pitch
    return column


class Reachable:
    """The lowest centres of a ball of `radius` metres that comes from above (+z), about `pitch` metres apart."""

    def __init__(self, part: Mesh, radius: float, pitch: float = 1e-4) -> None:
        self.part, self.radius, self.pitch, self.tree = part, radius, pitch, FacetTree.of(part)
        low, high = part.bounds[0][:2] - radius, part.bounds[1][:2] + radius
        self.lines = [np.arange(a + 0.37 * pitch, b, pitch) for a, b in zip(low, high, strict=True)]
        places = np.stack(np.meshgrid(*self.lines, indexing="ij"), axis=-1)
        self.heights = self._dropped(places)
        grid = np.concatenate([places, self.heights[..., None]], axis=-1)
        filled = [grid.reshape(-1, 3)]
        for a, b in ((grid[:-1], grid[1:]), (grid[:, :-1], grid[:, 1:])):
            filled += self._between(a.reshape(-1, 3), b.reshape(-1, 3))
        centres = np.concatenate(filled)
        self.centres = centres[np.isfinite(centres[:, 2])]

    def _dropped(self, places):
        heights = drop_cutter(self.tree, places.reshape(-1, 2), self.radius).reshape(places.shape[:-1])
        return np.where(np.isfinite(heights), heights, np.nan)

    def _between(self, a, b, rounds=14):
        """Points between neighbours (E, 3) where heights are steep or kinked; in the end upright columns at jumps."""
        made = []
        for _ in range(rounds):
            middle = 0.5 * (a + b)
            height = self._dropped(middle[:, :2])
            # Nowhere that the ball meets nothing: NaN.
            wanted = (np.abs(a[:, 2] - b[:, 2]) > self.pitch) | (np.abs(height - middle[:, 2]) > 2e-6)
            a, b, middle = a[wanted], b[wanted], np.column_stack([middle[:, :2], height])[wanted]
            made.append(middle)
            a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        return [*made, columns_at_jumps(a, b, self.pitch)]

    @cached_property
    def near(self) -> KDTree:
        """The centres, to be searched."""
        return KDTree(self.centres)

    def regions(self, angle: float, least: float = 4e-6) -> int:
        """Number of separate regions of at least `least` m² where the centres' surface is no steeper than an angle."""
        if angle >= np.radians(89.4):
            return int(ndimage.label(np.isfinite(self.heights))[1])
        slope = np.hypot(*np.gradient(np.where(np.isfinite(self.heights), self.heights, -1.0), self.pitch))
        label, count = ndimage.label((slope <= np.tan(angle)) & np.isfinite(self.heights))
        return int((np.bincount(label.ravel(), minlength=count + 1)[1:] * self.pitch**2 >= least).sum())

    def samples(self, count: int, steepest_deg: float = 80.0, flattest_deg: float = 0.0, seed: int = 2) -> Samples:
        """Points spread evenly over what is seen from above and whose slope is within two angles."""
        rng, part = np.random.default_rng(seed), self.part
        upright = part.facet_normals[:, 2]
        wanted = (upright >= np.cos(np.radians(steepest_deg)) - 1e-9) & (
            upright <= np.cos(np.radians(flattest_deg)) + 1e-9
        )
        if not wanted.any():
            return Samples(self, np.empty((0, 3)))
        area = part.facet_areas * wanted
        facet = rng.choice(len(area), count, p=area / area.sum())
        weights = rng.dirichlet([1.0, 1.0, 1.0], count)[:, :, None]
        points = (part.vertices[part.faces[facet]] * weights).sum(axis=1)
        # A ball of 1 µm is let down beside each point; it is stopped by what hides the point.
        beside = points + 3e-6 * part.facet_normals[facet]
        return Samples(self, points[drop_cutter(self.tree, beside[:, :2], 1e-6) < beside[:, 2] + 2e-5])


class Samples:
    """Points (N, 3) of a part's surface; gap (N,): distance from the nearest reachable centre, and which that is."""

    def __init__(self, reachable: Reachable, points) -> None:
        self.reachable, self.points = reachable, points
        self.gap, self.nearest = reachable.near.query(points)
        self._allowed: dict[float, np.ndarray] = {}

    def allowed(self, stepover: float):
        """The largest excess (N,) at each point if a pass comes within half a stepover of its nearest centre."""
        if stepover not in self._allowed:
            near, centres, most = self.reachable.near, self.reachable.centres, np.empty(len(self.points))
            within = 0.5 * (stepover + self.reachable.pitch)
            for first in range(0, len(most), 1000):
                home = centres[self.nearest[first : first + 1000]]
                for k, around in enumerate(near.query_ball_point(home, within), first):
                    most[k] = np.linalg.norm(centres[around] - self.points[k], axis=1).max()
            self._allowed[stepover] = most - self.gap
        return self._allowed[stepover]


@dataclass(frozen=True)
class Left:
    """What a toolpath leaves on samples of the surface, in metres, and how it moves.

    limit: what the nearest reachable centre leaves. excess: above that. allowed: largest excess if a pass comes within
    half a stepover of the nearest such centre. gouge: how deep the ball gets into the part, on any motion. cut, links,
    air: metres of cuts, of links on feed, and of rapids; lifts: how often the tool leaves the part between cuts.
    """

    radius: float
    stepover: float
    limit: np.ndarray
    excess: np.ndarray
    allowed: np.ndarray
    gouge: float
    cut: float
    links: float
    air: float
    lifts: int
    passes: int

    @property
    def beyond(self) -> float:
        """Share of the samples with an excess of more than 1.18 times the ridge between passes on a plane.

        In hollows that the ball touches the ridge is higher, as it is allowed there; at creases that it does not touch
        it is not.
        """
        ridge = 1.18 * (self.radius - np.sqrt(self.radius**2 - 0.25 * self.stepover**2))
        most = np.where(self.limit > 0.03 * self.radius, ridge, np.maximum(ridge, self.allowed))
        return float((self.excess > most).mean())

    @property
    def over(self) -> float:
        """The 99.9th percentile of the excess above what is allowed, metres."""
        return float(np.quantile(self.excess - self.allowed, 0.999))


def dense(line, step=5e-5):
    """Points along a polyline (N, 3) at most `step` apart."""
    count = np.maximum(np.ceil(np.linalg.norm(np.diff(line, axis=0), axis=1) / step), 1).astype(int)
    leg = np.repeat(np.arange(len(count)), count)
    t = ((np.arange(len(leg)) - np.repeat(np.cumsum(count) - count, count)) / count[leg])[:, None]
    return np.concatenate([line[leg] * (1 - t) + line[leg + 1] * t, line[-1:]])


def centre_lines(toolpath: Toolpath, radius: float):
    """The lines of a ball's centre and the kinds of the segments."""
    return [(s.tips + radius * s.axes, s.kind) for s in toolpath.segments]


def left(samples: Samples, toolpath: Toolpath, stepover: float) -> Left:
    """Measure what a toolpath leaves on samples of a part, and how it moves."""
    reachable, lines = samples.reachable, centre_lines(toolpath, samples.reachable.radius)
    way = {kind: [line for line, k in lines if k is kind] for kind in SegmentKind}
    length = {k: sum(np.linalg.norm(np.diff(x, axis=0), axis=1).sum() for x in v) for k, v in way.items()}
    cuts = np.concatenate([np.empty((0, 3)), *(dense(line) for line in way[SegmentKind.CUT])])
    moves = np.concatenate([cuts, *(dense(line) for kind in ("link", "rapid") for line in way[SegmentKind(kind)])])
    kinds = [k for _, k in lines]
    first, last = kinds.index(SegmentKind.CUT), len(kinds) - kinds[::-1].index(SegmentKind.CUT)
    between = [set(run) for cut, run in groupby(kinds[first:last], lambda k: k is SegmentKind.CUT) if not cut]
    return Left(
        radius=reachable.radius,
        stepover=stepover,
        limit=samples.gap - reachable.radius,
        excess=KDTree(cuts).query(samples.points)[0] - samples.gap,
        allowed=samples.allowed(stepover),
        gouge=reachable.radius - nearest_facet(reachable.part, moves),
        cut=length[SegmentKind.CUT],
        links=length[SegmentKind.LINK],
        air=length[SegmentKind.RAPID],
        lifts=sum(SegmentKind.RAPID in run for run in between),
        passes=len(way[SegmentKind.CUT]),
    )


def nearest_facet(part: Mesh, points, step=3e-4, checked=300) -> float:
    """The least distance of points (N, 3) from a mesh: all facets for those that are nearest to samples of it."""
    corners = part.vertices[part.faces]
    samples = [corners.reshape(-1, 3)]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    for count in np.unique(np.ceil(sides / step).astype(int)):
        own = corners[np.ceil(sides / step).astype(int) == count]
        i, j = (k.ravel() for k in np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij"))
        u, v = i[i + j <= count] / max(count, 1), j[i + j <= count] / max(count, 1)
        samples.append(
            (own[:, None, 0] + u[:, None] * (own[:, None, 1] - own[:, None, 0])
             + v[:, None] * (own[:, None, 2] - own[:, None, 0])).reshape(-1, 3)
        )  # fmt: skip
    about = KDTree(np.concatenate(samples)).query(points)[0]
    nearest = points[np.argsort(about)[:checked]]
    return min(float(facet_distances(corners, point).min()) for point in nearest)


def facet_distances(corners, point):
    """Distances (F,) of a point from facets (F, 3, 3): from the plane where its foot is inside, else from the edges."""
    best = np.full(len(corners), np.inf)
    for k in range(3):
        a, along = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        square = (along**2).sum(axis=1)
        t = np.clip(((point - a) * along).sum(axis=1) / np.where(square > 0, square, 1.0), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(point - a - t[:, None] * along, axis=1))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal = normal / np.where(length > 0, length, 1.0)[:, None]
    height = ((point - corners[:, 0]) * normal).sum(axis=1)
    foot = point - height[:, None] * normal
    inside = length > 0
    for k in range(3):
        edge, to = corners[:, (k + 1) % 3] - corners[:, k], foot - corners[:, k]
        inside &= (np.cross(edge, to) * normal).sum(axis=1) >= 0.0
    return np.where(inside, np.minimum(best, np.abs(height)), best)
