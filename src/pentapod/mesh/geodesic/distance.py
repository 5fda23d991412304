"""Geodesic distance from lines on a surface, by windows on edges (Mitchell, Mount, Papadimitriou 1987).

Each edge holds intervals that a front reaches straight from a virtual source, a point or a straight line: the facets
between are laid into one plane. So the distance is exact on whatever can be unrolled, however long and thin the facets
are, at vertices and inside facets. Where the surface is curved, neighbouring windows are merged within a tolerance
(Surazhsky et al. 2005), so that the time grows about as the number of facets. Segments as sources: Bommes and
Kobbelt 2007.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, read_only
from pentapod.mesh.geodesic.places import PatchOn
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.slicing import LevelSet

if TYPE_CHECKING:
    from pentapod.mesh.geodesic.front_kernels import Layout
    from pentapod.mesh.geodesic.window_kernels import Fronts


@dataclass(frozen=True)
class GeodesicOptions:
    """How distances are computed.

    slack: error for each step of distance up to which neighbouring windows are merged. turn:
    change of direction up to which they are, radians. excess: angle, radians, by which
    the facets at a vertex exceed a full turn, from which on shortest ways may turn there.
    """

    slack: float = 3e-4
    turn: float = 5e-3
    excess: float = 1e-6


@dataclass(frozen=True, eq=False)
class Sources:
    """S straight segments on a patch from which distances are measured: a point where both ends are equal.

    facets (S,): in which each lies. begins, ends (S, 3): barycentric weights.
    """

    facets: Ints
    begins: Floats
    ends: Floats

    @classmethod
    def points(cls, facets: Ints, weights: Floats) -> Sources:
        """Return points of facets (S,) at barycentric weights (S, 3)."""
        return cls(facets, weights, weights)

    @classmethod
    def sides(cls, patch: Patch, edges: Bools) -> Sources:
        """Return the edges (E,) of a patch that are marked."""
        side = np.flatnonzero(edges[patch.topology.edge_of_side.ravel()])
        _, first = np.unique(patch.topology.edge_of_side.ravel()[side], return_index=True)
        facet, s = np.divmod(side[first], 3)
        corners = np.eye(3)
        return cls(facet, corners[s], corners[(s + 1) % 3])

    @classmethod
    def along(cls, level_set: LevelSet, spacing: float, shortest: float = 0.0) -> Sources:
        """Return the level lines of a quantity on a patch; those shorter than `shortest` metres are left out.

        Where facets cut them into shorter pieces than `spacing` metres, points at that spacing stand for them.
        """
        facets, begins, ends, line = level_set.segments()
        corners = level_set.patch.vertices[level_set.patch.faces[facets]]
        length = np.linalg.norm(((ends - begins)[:, :, None] * corners).sum(axis=1), axis=1)
        if shortest > 0.0 and len(line):
            long = np.bincount(line, weights=length)[line] >= shortest
            facets, line, begins, ends, length = facets[long], line[long], begins[long], ends[long], length[long]
        short = length < spacing
        last = np.append(line[1:] != line[:-1], True)[: len(line)]
        part = np.floor(np.cumsum(length) / spacing)
        point = short & (last | (np.diff(part, prepend=-1.0) > 0.0) | ~np.append(True, short[:-1])[: len(line)])
        kept = ~short | point
        return cls(facets[kept], np.where(point[:, None], ends, begins)[kept], ends[kept])

    def placed(self, on: PatchOn) -> Sources:
        """Return the same segments on the patch on which theirs lies."""
        facets, begins = on.places(self.facets, self.begins)
        return Sources(facets, begins, on.places(self.facets, self.ends)[1])

    @classmethod
    def joined(cls, parts: list[Sources]) -> Sources:
        """Return all segments of several sources on one patch."""
        return cls(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("facets", "begins", "ends")))


@dataclass(frozen=True, eq=False)
class GeodesicField:
    """Geodesic distance on a patch, in steps, from the nearest of its sources.

    lengths (E,): of the patch's edges, steps. limit: steps; distances beyond it are not shortest. values (V,): the
    distance of each vertex; infinite where the surface is not connected to a source.
    """

    patch: Patch
    sources: Sources
    lengths: Floats
    limit: float
    values: Floats
    _layout: Layout
    _fronts: Fronts

    @classmethod
    def of(
        cls,
        patch: Patch,
        sources: Sources,
        slowness: Floats | float = 1.0,
        *,
        limit: float = np.inf,
        options: GeodesicOptions = GeodesicOptions(),
    ) -> GeodesicField:
        """Return the distance from sources over a patch. slowness, or (V,) at vertices: steps per metre.

        A slowness that changes over the surface must be about the same at both ends of an edge.
        """
        from pentapod.mesh.geodesic.source_kernels import solve  # noqa: PLC0415  numba is heavy

        edges = patch.topology.edges
        at = np.broadcast_to(np.asarray(slowness, dtype=np.float64), (len(patch.vertices),))[edges].mean(axis=1)
        lengths = np.linalg.norm(patch.vertices[edges[:, 1]] - patch.vertices[edges[:, 0]], axis=1) * at
        layout = _layout(patch, lengths, options)
        order = np.argsort(sources.facets, kind="stable")
        begins, ends = (np.ascontiguousarray(a[order]) for a in (sources.begins, sources.ends))
        sources = Sources(sources.facets[order], begins, ends)
        fronts = _no_fronts(len(patch.vertices), len(edges))
        fronts = solve(fronts, layout, sources.facets, sources.begins, sources.ends, limit, options.slack, options.turn)
        return cls(patch, sources, lengths, limit, fronts.distance, layout, fronts)

    def at(self, facets: Ints, weights: Floats) -> Floats:
        """Return the distance (N,), steps, of points of facets (N,) at barycentric weights (N, 3)."""
        from pentapod.mesh.geodesic.source_kernels import inside  # noqa: PLC0415  numba is heavy

        found = np.empty(len(facets))
        facets, weights = np.asarray(facets, dtype=np.intp), np.ascontiguousarray(weights, dtype=np.float64)
        inside(self._fronts, self._layout, self._in_facets, facets, weights, found)
        return found

    @cached_property
    def _in_facets(self) -> tuple[Ints, Floats, Floats]:
        first = np.searchsorted(self.sources.facets, np.arange(len(self.patch.faces) + 1)).astype(np.intp)
        return first, self.sources.begins, self.sources.ends


def _layout(patch: Patch, lengths: Floats, options: GeodesicOptions) -> Layout:
    """Return a patch's facets laid flat, with edges of the given lengths (E,)."""
    from pentapod.mesh.geodesic.front_kernels import Layout  # noqa: PLC0415  numba is heavy

    topology, faces = patch.topology, read_only(patch.faces.astype(np.intp, copy=False))
    edges = np.ascontiguousarray(topology.edge_of_side, dtype=np.intp)
    side = lengths[edges]
    after, before = np.roll(side, -1, axis=1), np.roll(side, 1, axis=1)
    # Corner s + 2 is `before` away from corner s and `after` away from corner s + 1.
    base = np.maximum(side, 1e-300)
    x = 0.5 * (side + (before - after) * (before + after) / base)
    half = 0.5 * (side + after + before)
    square = half * np.maximum(half - side, 0.0) * np.maximum(half - after, 0.0) * np.maximum(half - before, 0.0)
    apex = np.stack([x, 2.0 * np.sqrt(square) / base], axis=2)
    turning = np.zeros(len(patch.vertices), dtype=np.bool_)
    turning[topology.edges[topology.facets_at_edge != 2]] = True
    angles = np.arctan2(apex[:, :, 1], apex[:, :, 0])
    turning |= np.bincount(faces.ravel(), angles.ravel(), len(patch.vertices)) > 2.0 * np.pi + options.excess
    beside, around = (np.argsort(a.ravel(), kind="stable") for a in (edges, faces))
    first = np.searchsorted(edges.ravel()[beside], np.arange(len(lengths) + 1)).astype(np.intp)
    start = np.searchsorted(faces.ravel()[around], np.arange(len(patch.vertices) + 1)).astype(np.intp)
    along = faces == topology.edges[edges, 0]
    narrowest = np.full(len(lengths), np.inf)
    np.minimum.at(narrowest, edges.ravel(), np.repeat(apex[:, :, 1].min(axis=1), 3))
    return Layout(faces, edges, along, lengths, apex, beside, first, around, start, turning, narrowest)


def _no_fronts(vertices: int, edges: int) -> Fronts:
    """Return an empty set of windows for a mesh with that many vertices and edges."""
    from pentapod.mesh.geodesic.window_kernels import COLUMNS, Fronts  # noqa: PLC0415  numba is heavy

    rows = 4 * edges + 1024
    return Fronts(
        np.empty((rows, COLUMNS)), np.empty((rows, 3), dtype=np.intp),
        np.full(edges, -1, dtype=np.intp), np.zeros(edges, dtype=np.intp), np.array([1, -1], dtype=np.intp),
        np.full(edges, np.inf), np.full(vertices, np.inf), np.zeros(vertices, dtype=np.bool_),
        np.empty(4), np.empty(2), np.empty(2), np.empty((1024, 2)), np.empty(1024, dtype=np.intp), np.empty(3),
    )  # fmt: skip
