"""MeshDistance: exact signed distance of points, segments and tools from a mesh, negative inside a closed one.

The sign is that of the angle-weighted normal at the nearest mesh point (Bærentzen and Aanæs 2005). Only a closed,
consistently wound mesh has an inside; distances from an open sheet are never negative.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, Ints, as_floats
from pentapod.geometry.solids import Solid
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.query.swept_depth import TouchingBody, touch
from pentapod.mesh.query.tree import FacetTree
from pentapod.numerics.threads import for_rows

TOOL_RESOLUTION_M = 1e-6
"""Gaps of tools are exact to this."""


@dataclass(frozen=True)
class DistanceOptions:
    """on_feature: a nearest point whose barycentric weight is smaller than this lies on the opposite side of its facet.

    samples: points tested on a segment that passes through the mesh, and again around the deepest of them.
    contact: metres; at smaller distances the vector between the nearest points has no direction.
    """

    on_feature: float = 1e-7
    samples: int = 33
    contact: float = 1e-12


OPTIONS = DistanceOptions()


@dataclass(frozen=True, eq=False)
class Gap:
    """Distances of M points or segments from a mesh.

    distance (M,): metres, negative inside; capped at the distance asked for. place (M,): of the nearest point, 0 to 1
    along a segment. normal (M, 3): unit gradient of the distance at that point; 0 where unknown.
    """

    distance: Floats
    place: Floats
    normal: Floats


@dataclass(frozen=True, eq=False)
class Feet:
    """Nearest mesh points of M points.

    points (M, 3): the nearest points. facets (M,): the mesh's facets they lie on. sides (M,): 1 in front of the
    surface, -1 behind it, by the winding of the facets; an open sheet has two sides, too.
    """

    points: Floats
    facets: Ints
    sides: Floats


@dataclass(frozen=True, eq=False)
class MeshDistance:
    """Distances to one mesh, in its own frame, metres. Build one with `MeshDistance.of`.

    features (F, 7, 3): outward normals of each facet of the tree, of its sides and of its corners, sides opposite the
    corner of the same number; None for a mesh without inside. bounds (2, 3): of the mesh.
    """

    mesh: Mesh
    tree: FacetTree
    features: Floats | None
    bounds: Floats

    @classmethod
    def of(cls, mesh: Mesh) -> MeshDistance:
        """Prepare the distances from a mesh, which may be open."""
        tree = FacetTree.of(mesh)
        found = mesh.diagnosis
        closed = found.watertight and found.consistent
        features = _features(mesh, tree) if closed else None
        features = -features if features is not None and found.inverted else features
        return cls(mesh, tree, features, mesh.bounds)

    @property
    def closed(self) -> bool:
        """Whether the mesh has an inside."""
        return self.features is not None

    def points(self, points: ArrayLike, within: float = np.inf) -> Gap:
        """Return the distances of points (M, 3), capped at `within`."""
        at = as_floats(points, "points", (None, 3))
        distance, offset, facet = self.tree.closest(at, within)
        inside = self._inside(at, offset, facet)
        distance = np.where(inside, -distance, distance)
        return Gap(distance, np.zeros(len(at)), np.where(inside[:, None], -1.0, 1.0) * unit_or_zero(offset))

    def feet(self, points: ArrayLike) -> Feet:
        """Return the nearest points on the mesh of points (M, 3), and on which side of it they are."""
        at = as_floats(points, "points", (None, 3))
        _, offset, facet = self.tree.closest(at)
        on = _feature(self.tree.corners[facet], at - offset)
        normals = self._outward[facet, on]
        sides = np.where(np.einsum("ij,ij->i", normals, offset) < 0.0, -1.0, 1.0)
        return Feet(at - offset, self.tree.facets[facet], sides)

    @cached_property
    def _outward(self) -> Floats:
        """Features as in `features`, of an open sheet too."""
        return _features(self.mesh, self.tree) if self.features is None else self.features

    def segments(self, starts: ArrayLike, ends: ArrayLike, within: float = np.inf) -> Gap:
        """Return the distances, capped at `within`, of segments from starts to ends (M, 3).

        Exact where the segment stays outside. Inside, the depth is that of the deepest of dense samples: exact to a few
        hundredths of the mesh's size.
        """
        a, b = as_floats(starts, "starts", (None, 3)), as_floats(ends, "ends", (None, 3))
        distance, place, offset, facet = self._nearest(a, b - a, within)
        normal = unit_or_zero(offset)
        if self.closed:
            at = a + place[:, None] * (b - a)
            through = np.flatnonzero((distance < OPTIONS.contact) & (facet >= 0) | self._inside(at, offset, facet))
            if len(through):
                distance[through], place[through], normal[through] = self._deepest(a[through], b[through])
        return Gap(distance, place, normal)

    def bodies(self, solids: Sequence[Solid], tips: Floats, axes: Floats, within: float) -> tuple[Floats, Floats]:
        """Return distances (M,) of tools made of `solids`, with tips and unit axes (M, 3), and the mesh points (M, 3).

        Lower bounds, exact to TOOL_RESOLUTION_M outside and 1 % more inside; negative where a mesh point lies inside
        the tool. They are capped at `within`; the point is NaN there.
        """
        body = TouchingBody(tuple(solids))
        touched = touch(self.tree, body, tips, axes, threshold=-within, resolution=TOOL_RESOLUTION_M)
        kind, rows = touched.depths.argmax(axis=1), np.arange(len(tips))
        found = -touched.depths[rows, kind]
        found = np.where(np.isfinite(found), found, within + TOOL_RESOLUTION_M)
        gap = np.minimum(found - TOOL_RESOLUTION_M + 0.01 * np.minimum(found, 0.0), within)
        return gap, touched.points[rows, kind]

    def contains(self, points: ArrayLike) -> Bools:
        """Return which points (M, 3) a closed mesh encloses, by winding numbers; slow for many points."""
        at = as_floats(points, "points", (None, 3))
        if not self.closed:
            return np.zeros(len(at), dtype=np.bool_)
        turns = np.empty(len(at))
        for k, point in enumerate(at):
            a, b, c = np.moveaxis(self.tree.corners - point, 1, 0)
            la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
            # Solid angle of each facet: Van Oosterom and Strackee 1983.
            above = np.einsum("ij,ij->i", a, np.cross(b, c))
            dots = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
            turns[k] = np.arctan2(above, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb).sum() / (2 * np.pi)
        return np.abs(turns) > 0.5

    def _nearest(self, starts: Floats, travels: Floats, within: float) -> tuple[Floats, Floats, Floats, Ints]:
        """Return distances, shares of the travels, offsets from the mesh, and facets in tree order (−1: too far)."""
        from pentapod.mesh.query.kernels.segment_kernels import nearest_all  # noqa: PLC0415  loads numba

        count = len(starts)
        distance, where = np.full(count, within), np.zeros((count, 4))
        facet = np.full(count, -1, dtype=np.intp)
        tree = self.tree
        points, travels = np.ascontiguousarray(starts), np.ascontiguousarray(travels)
        given = (tree.corners, tree.boxes, tree.starts, within, True)
        for_rows(nearest_all, (points, travels), given, (distance, where, facet))
        offset = np.where(facet[:, None] >= 0, starts + where[:, :1] * travels - where[:, 1:], 0.0)
        return distance, where[:, 0], offset, facet

    def _inside(self, points: Floats, offset: Floats, facet: Ints) -> Bools:
        """Return which points lie inside, from their offsets from the nearest mesh points."""
        inside = np.zeros(len(points), dtype=np.bool_)
        if self.features is None:
            return inside
        boxed = (points >= self.bounds[0]).all(axis=1) & (points <= self.bounds[1]).all(axis=1)
        rows = np.flatnonzero(boxed & (facet >= 0))
        on = _feature(self.tree.corners[facet[rows]], points[rows] - offset[rows])
        outward = self.features[facet[rows], on]
        inside[rows] = np.einsum("ij,ij->i", outward, offset[rows]) < 0.0
        return inside

    def _deepest(self, a: Floats, b: Floats) -> tuple[Floats, Floats, Floats]:
        """Return distance, place and normal of the deepest points of segments that pass through the mesh."""
        low, high = _part_in_box(a, b - a, self.bounds)
        shares, rows = np.linspace(0.0, 1.0, OPTIONS.samples), np.arange(len(a))

        def sampled() -> tuple[Gap, Floats, Ints]:
            places = low[:, None] + (high - low)[:, None] * shares
            gaps = self.points((a[:, None] + places[..., None] * (b - a)[:, None]).reshape(-1, 3))
            return gaps, places, gaps.distance.reshape(places.shape).argmin(axis=1)

        _, places, worst = sampled()
        low, high = places[rows, np.maximum(worst - 1, 0)], places[rows, np.minimum(worst + 1, OPTIONS.samples - 1)]
        gaps, places, worst = sampled()
        flat = rows * OPTIONS.samples + worst
        return np.minimum(gaps.distance[flat], 0.0), places[rows, worst], gaps.normal[flat]


_FEATURES: WeakKeyDictionary[FacetTree, Floats] = WeakKeyDictionary()
"""See `_features`: made once for each tree."""


def _features(mesh: Mesh, tree: FacetTree) -> Floats:
    """Return normals (F, 7, 3) of the tree's facets, of the sides opposite corners 0, 1, 2, and of corners 0, 1, 2."""
    if tree not in _FEATURES:
        _FEATURES[tree] = _features_of(mesh)[tree.facets]
    return _FEATURES[tree]


def _features_of(mesh: Mesh) -> Floats:
    """Return the same in the order of the mesh."""
    facets, count = mesh.facet_normals, len(mesh.faces)
    sides = np.zeros((3 * count, 3))
    first, second = mesh.topology.side_pairs
    both = facets[first // 3] + facets[second // 3]
    sides[first], sides[second] = both, both
    # Side s runs from corner s to s + 1, opposite corner s + 2.
    opposite = np.roll(sides.reshape(count, 3, 3), 2, axis=1)
    return np.concatenate([facets[:, None], opposite, mesh.vertex_normals[mesh.faces]], axis=1)


def _feature(corners: Floats, points: Floats) -> Ints:
    """Return on which of its 7 features (see `_features`) each facet (M, 3, 3) has its point (M, 3)."""
    ab, ac, ap = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    normal = np.cross(ab, ac)
    square = np.einsum("ij,ij->i", normal, normal)
    second = np.einsum("ij,ij->i", np.cross(ap, ac), normal) / square
    third = np.einsum("ij,ij->i", np.cross(ab, ap), normal) / square
    shares = np.stack([1.0 - second - third, second, third], axis=1)
    zero = shares < OPTIONS.on_feature
    on_side, on_corner = zero.sum(axis=1) == 1, zero.sum(axis=1) >= 2
    return np.where(on_corner, 4 + shares.argmax(axis=1), np.where(on_side, 1 + shares.argmin(axis=1), 0))


def _part_in_box(start: Floats, travel: Floats, bounds: Floats) -> tuple[Floats, Floats]:
    """Return the shares (M,), (M,) between which each segment is in the box; 0 and 1 where it never is."""
    safe = np.where(travel == 0.0, 1e-300, travel)
    with np.errstate(over="ignore"):
        first, second = (bounds[0] - start) / safe, (bounds[1] - start) / safe
    low = np.clip(np.minimum(first, second).max(axis=1), 0.0, 1.0)
    high = np.clip(np.maximum(first, second).min(axis=1), 0.0, 1.0)
    return np.where(low <= high, low, 0.0), np.where(low <= high, high, 1.0)
