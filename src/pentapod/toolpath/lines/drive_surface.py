"""Drive surface: where the centre of a ball is that rolls over the part and cuts into it nowhere.

It is the offset surface of the part at the ball's radius, seen from outside. Lines are drawn on it as on any mesh.
Points are then put exactly on the offset, and chords between them are proven clear by their exact distance from the
part. A ball is clear at a centre whatever its axis, so nothing of this depends on the tool axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.directions import normalised
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.offset.offset_surface import offset_surface, onto_level
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.tree import FacetTree
from pentapod.mesh.region import Region
from pentapod.mesh.topology import components


@dataclass(frozen=True)
class DriveOptions(Value):
    """How a drive surface is made and used.

    step: of the grid, as a share of the ball's radius; narrower channels may be closed. upright: radians beyond a right
    angle to which a region reaches that reaches a right angle, so that walls are not split by rounding. on_level: as a
    share of the radius, how near to the offset a point is put. rounds: of moving it there, and of halving chords.
    window: length over which normals are averaged along a line, as a share of the radius: at creases they jump.
    border: how exactly an open border is known, as a share of the radius; enters: how far beyond it the ball gets where
    it is no hole. longest: of a link on the surface, as a multiple of the straight way; uneven: of its longest step.
    """

    step: float = 0.25
    upright: float = float(np.radians(0.5))
    on_level: float = 1e-7
    rounds: int = 30
    window: float = 1.0
    border: float = 0.02
    enters: float = 0.5
    longest: float = 2.5
    uneven: float = 3.0


@dataclass(frozen=True, eq=False)
class DriveSurface:
    """The drive surface of a ball of `radius` metres over a part; mesh: the surface itself, facing outwards."""

    part: Mesh
    tree: FacetTree
    radius: float
    mesh: Mesh
    options: DriveOptions

    @classmethod
    def of(cls, part: Mesh, radius: float, options: DriveOptions | None = None) -> DriveSurface:
        """Return the drive surface of a part. Raises MeshError where the part is too large for the ball."""
        options = options or DriveOptions()
        tree = FacetTree.of(part)
        vertices, faces = offset_surface(tree, radius, options.step * radius)
        # A line goes on over creases of the drive surface: no edge of it parts passes.
        mesh = Mesh.of(vertices, faces, source=part.diagnosis.source, crease_angle=np.pi)
        return cls(part, tree, radius, mesh, options)

    def patch(self, region: Region) -> Patch:
        """Return the part of the drive surface from which the ball touches a region; empty where there is none.

        A region that reaches a right angle reaches a little further, so that rounding does not split walls. Around an
        open border the ball does not roll.
        """
        patch = Patch.whole(self.mesh)
        if region.box is not None:
            for bound, side in zip(region.bounds, (1.0, -1.0), strict=True):
                for axis in range(3):
                    contacts = self.contacts(patch.vertices)
                    patch, _ = patch.above(side * (contacts[:, axis] - bound[axis]), 0.0)
        more = self.options.upright if 0.5 * np.pi - region.angle < self.options.upright else 0.0
        cosine = np.cos(region.angle + more)
        patch = patch.where_normals(lambda n: n @ region.direction - cosine * np.linalg.norm(n, axis=-1))
        return patch if self.part.topology.watertight else patch.above(-self._beyond_border(patch), 0.0)[0]

    def contacts(self, centres: Floats) -> Floats:
        """Return the points (N, 3) of the part that are nearest to centres (N, 3): where the ball touches."""
        return centres - self.tree.closest(centres)[1]

    def _beyond_border(self, patch: Patch) -> Floats:
        """Return how far (V,) the ball's centre is beyond the part's open border at vertices; negative above facets.

        Measured across the border in the plane of the facet there. Holes that the ball cannot enter are no border.
        """
        gap, away, facet = self.tree.closest(patch.vertices)
        corners = self.part.vertices[self.part.topology.edges[self.part.topology.facets_at_edge == 1]]
        step = self.options.border * self.radius
        count = np.ceil(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1) / step).astype(np.intp) + 1
        edge = np.repeat(np.arange(len(count)), count)
        share = (np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)) / (count - 1)[edge]
        border = corners[edge, 0] + share[:, None] * (corners[edge, 1] - corners[edge, 0])
        near = KDTree(border).query(patch.vertices - away)[0]
        upright = np.einsum("ni,ni->n", self.part.facet_normals[self.tree.facets[facet]], away)
        over = np.sqrt(np.maximum(gap**2 - upright**2, 0.0))
        beyond = np.where((near < step) & (over > step), over, -near)
        # A ball over a hole smaller than itself is beyond its border, but not far.
        sides = np.stack([patch.faces, np.roll(patch.faces, -1, axis=1)], axis=-1).reshape(-1, 2)
        sides = sides[(beyond[sides] > 0.0).all(axis=1)]
        number, piece = components(len(beyond), sides[:, 0], sides[:, 1])
        furthest = np.full(number, -np.inf)
        np.maximum.at(furthest, piece, beyond)
        bridged = (beyond > 0.0) & (furthest[piece] < self.options.enters * self.radius)
        return np.where(bridged, -step, beyond)

    def on_level(self, points: Floats) -> Floats:
        """Return points (N, 3) moved onto the offset, along the lines to their closest points of the part."""
        return onto_level(self.tree, points, self.radius, self.options.rounds, self.options.on_level)

    def exact(self, passes: Passes, chordal: float, closest: float) -> Passes:
        """Return passes with their points on the offset, and with more where a chord leaves it by more than `chordal`.

        No chord comes nearer to the part than radius − chordal: that is proven. How far it is from the offset outwards
        is measured in its middle. closest: metres; shorter chords are not halved, if they are clear for their length.
        """
        shortest = min(closest, 2.0 * chordal)
        points, owner = self.on_level(passes.points), passes.pass_of_point
        live = owner[1:] == owner[:-1]
        for _ in range(self.options.rounds):
            rows = np.flatnonzero(live)
            rows = rows[np.linalg.norm(points[rows + 1] - points[rows], axis=1) > shortest]
            live[:] = False
            if not len(rows):
                break
            middles = 0.5 * (points[rows] + points[rows + 1])
            bad = self.tree.closest(middles)[0] > self.radius + chordal
            bad |= self._clearances(points[rows], points[rows + 1]) < self.radius - chordal
            at = rows[bad] + 1
            live[rows[bad]] = True
            points = np.insert(points, at, self.on_level(middles[bad]), axis=0)
            owner = np.insert(owner, at, owner[at])
            live = np.insert(live, at, True)
        starts = np.concatenate([[0], np.flatnonzero(np.diff(owner)) + 1, [len(owner)]])
        return Passes(points, self.normals(points), starts, passes.levels)

    def links(
        self, starts: Floats, ends: Floats, spacing: float, chordal: float, closest: float
    ) -> list[Floats | None]:
        """Return for each pair of centres (L, 3) the points (n, 3) of a way on or above the surface, ends included.

        It is the straight way, moved onto the surface where that is nearer to the part than the radius, its chords
        proven as those of `exact`. None where it would be long, or jump.
        """
        length = np.linalg.norm(ends - starts, axis=1)
        count = np.maximum(np.ceil(length / spacing), 2.0).astype(np.intp) + 1
        owner = np.repeat(np.arange(len(count)), count)
        share = (np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)) / (count - 1)[owner]
        points = starts[owner] + share[:, None] * (ends - starts)[owner]
        points[share == 1.0] = ends
        inner = (share > 0.0) & (share < 1.0)
        points[inner] = self._raised(points[inner])
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        found: list[Floats | None] = []
        for k, first in enumerate(np.cumsum(count) - count):
            own = steps[first : first + count[k] - 1]
            even = (
                own.max() <= self.options.uneven * spacing and own.sum() <= self.options.longest * length[k] + spacing
            )
            found.append(self._cleared(points[first : first + count[k]], chordal, closest) if even else None)
        return found

    def _raised(self, points: Floats) -> Floats:
        """Return points (N, 3), those that are too near to the part moved onto the surface."""
        low = self.tree.closest(points, self.radius)[2] >= 0
        points = points.copy()
        points[low] = self.on_level(points[low])
        return points

    def _cleared(self, points: Floats, chordal: float, closest: float) -> Floats | None:
        """Return a line with its chords halved until all are clear by radius − chordal; None where it jumps."""
        for _ in range(self.options.rounds):
            bad = np.flatnonzero(self._clearances(points[:-1], points[1:]) < self.radius - chordal)
            if not len(bad):
                return points
            middles = 0.5 * (points[bad] + points[bad + 1])
            if np.linalg.norm(points[bad + 1] - points[bad], axis=1).min() < closest:
                return None
            points = np.insert(points, bad + 1, self._raised(middles), axis=0)
        return None

    def normals(self, points: Floats) -> Floats:
        """Return unit normals (N, 3) of the offset at points on it: away from the part's closest points."""
        return normalised(self.tree.closest(points)[1])

    def _clearances(self, starts: Floats, ends: Floats) -> Floats:
        """Return the least distances (M,) of chords from the part, metres; what is over the radius counts as that."""
        from pentapod.mesh.query.segment_kernels import nearest_all  # noqa: PLC0415  loads numba

        count, tree = len(starts), self.tree
        distances, where = np.full(count, self.radius), np.zeros((count, 4))
        facets = np.full(count, -1, dtype=np.intp)
        nearest_all(
            starts, ends - starts, tree.corners, tree.boxes, tree.starts, self.radius, False, distances, where, facets
        )
        return distances


def smoothed(passes: Passes, window: float) -> Floats:
    """Return unit normals (N, 3) of passes, averaged along each over `window` metres, less near its ends."""
    place = np.concatenate([[0.0], np.cumsum(np.where(passes.within, passes.steps, 0.0))])
    first, last = place[passes.starts[:-1]][passes.pass_of_point], place[passes.starts[1:] - 1][passes.pass_of_point]
    half = np.minimum(0.5 * window, np.minimum(place - first, last - place))
    middles = 0.5 * (passes.normals[1:] + passes.normals[:-1]) * passes.steps[:, None]
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(middles, axis=0)])
    total = np.stack(
        [np.interp(place + half, place, sums[:, k]) - np.interp(place - half, place, sums[:, k]) for k in range(3)],
        axis=1,
    )
    return normalised(np.where(half[:, None] > 0.0, total, passes.normals))
