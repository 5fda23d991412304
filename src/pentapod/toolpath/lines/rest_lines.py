"""Rest lines: further passes where a ball still leaves more than the ridge between passes, measured on its offset.

At a centre on the offset surface with normal n, what is higher than t above the limit of what the ball can cut is
cleared where a pass comes within a radius r of centre − (r − t) n. In hollows hardly wider than the ball, and at the
ends of creases, passes that keep their distance along the offset surface do not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import normalised
from pentapod.geometry.runs import distinct, members
from pentapod.mesh.normals import corner_angles, unit_or_zero
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.topology import components
from pentapod.numerics.threads import nearest_points

Rising = tuple[Ints, Floats]
"""Sides (S,) of facets at which a patch ends in a corner, and the normals (S, 3) of what rises beyond."""


@dataclass(frozen=True)
class RestOptions:
    """How rest is found.

    allowed: height of what may be left, in ridges between passes on a plane. coarse: share of that with which facets
    are looked at first; edge: of the facets that are looked at again, in stepovers. sample, along: largest distance of
    the points that stand for a pass, in radii, and in halves of the stepover: else what lies between two passes seems
    farther from both. bent: angle between facets, radians, from which directions between their normals are looked at;
    folded: from which there are none. negligible: share of the area that rest without lines may have in total, with
    what the ball touches from its vertices. rounds: of lines. rings: facets around rest through which its line may run.
    core: share of the most that is left from which a line begins and ends. shortest: line, in stepovers; shorter ones
    run through all of their piece, and what lies about it. smoothing: rounds in which points of a line are averaged
    with both neighbours.
    """

    allowed: float = 1.25
    coarse: float = 0.85
    edge: float = 0.15
    sample: float = 0.05
    along: float = 0.25
    bent: float = float(np.radians(10.0))
    folded: float = float(np.radians(179.0))
    negligible: float = 5e-5
    rounds: int = 3
    rings: int = 2
    core: float = 0.7
    shortest: float = 0.5
    smoothing: int = 3


def rest_lines(
    patch: Patch,
    passes: Passes,
    radius: float,
    stepover: float,
    hides: Callable[[Floats], Bools],
    rising: Callable[[Patch], Rising],
    shortest: float = 0.0,
    options: RestOptions = RestOptions(),
) -> Passes:
    """Return lines over what passes leave on a patch of the offset surface of a ball of `radius` metres.

    stepover: between the passes, metres. hides: tells which points (N, 3) cannot be machined. rising: finds
    where a patch ends in a corner. shortest: metres; what is shorter is no pass.
    """
    half = min(0.5 * stepover, radius)
    height = options.allowed * (radius - float(np.sqrt(radius**2 - half**2)))
    if height >= radius:  # passes so far apart are meant to leave the surface between them
        return Passes.joined([])
    step, whole = min(options.sample * radius, options.along * half), float(patch.areas.sum())
    passes = passes.split(~hides(passes.points))
    centres, parts = _dense(passes.where(passes.lengths >= shortest), step), list[Passes]()
    if not len(centres):
        return Passes.joined([])
    coarse = _left(patch, rising(patch), KDTree(centres), radius, options.coarse * height, options) > 0.0
    coarse[coarse] = ~hides(patch.vertices[patch.faces[coarse]].mean(axis=1))
    near = patch.only(_about(patch, _grown(patch, coarse, 1), options.shortest * stepover))
    near = near.refined(options.edge * stepover)
    ends = rising(near)
    for _ in range(options.rounds):
        left = _left(near, ends, KDTree(centres), radius, height, options)
        left[left > 0.0] *= ~hides(near.vertices[near.faces[left > 0.0]].mean(axis=1))
        lines = _lines(near, ends, left, radius, options.negligible * whole, options.shortest * stepover, options)
        if not len(lines):
            break
        parts.append(lines)
        centres = np.concatenate([centres, _dense(lines, step)])
    return Passes.joined(parts)


def _dense(passes: Passes, step: float) -> Floats:
    """Return points (N, 3) along passes, at most `step` metres apart."""
    rows = np.flatnonzero(passes.within)
    start, along = passes.points[rows], passes.points[rows + 1] - passes.points[rows]
    counts = np.ceil(np.linalg.norm(along, axis=1) / step).astype(np.intp) + 1
    owner, number = members(counts)
    return start[owner] + (number / np.maximum(counts - 1, 1)[owner])[:, None] * along[owner]


def _left(patch: Patch, rising: Rising, tree: KDTree, radius: float, height: float, options: RestOptions) -> Floats:
    """Return by how much (F,) each facet is not cleared down to a height, metres; 0 where it is."""
    normals, corners = patch.facet_normals, patch.vertices[patch.faces]
    depth, left = radius - height, np.zeros(len(patch.faces))
    if not len(left):
        return left
    middles = corners.mean(axis=1)
    left = _beyond(tree, middles - depth * normals, middles, radius)
    # Between the normals of two facets at a concave edge the ball's arc answers, not the facets.
    a, b = (side // 3 for side in patch.topology.side_pairs)
    edges = patch.vertices[patch.topology.edges[patch.topology.pair_edges]].mean(axis=1)
    cosine = np.einsum("ij,ij->i", normals[a], normals[b])
    flat: Bools = np.asarray(~normals.any(axis=1))  # facets without an area
    bent = (cosine < np.cos(options.bent)) & (cosine > np.cos(options.folded)) & ~flat[a] & ~flat[b]
    a, b, edges = a[bent], b[bent], edges[bent]
    for share in (0.25, 0.5, 0.75):
        between = normalised((1.0 - share) * normals[a] + share * normals[b])
        more = _beyond(tree, edges - depth * between, edges, radius)
        np.maximum.at(left, a, more)
        np.maximum.at(left, b, more)
    # The half of an arc that is nearer to what rises beyond the patch is not under it.
    sides, beyond = rising
    # A facet may be folded onto what rises there: no direction is between them.
    apart = np.einsum("ij,ij->i", normals[sides // 3], beyond) > np.cos(options.folded)
    sides, beyond = sides[apart], beyond[apart]
    ends = patch.vertices[patch.side_ends(sides)].mean(axis=1)
    for share in (0.25, 0.5):
        between = normalised((1.0 - share) * normals[sides // 3] + share * beyond)
        np.maximum.at(left, sides // 3, _beyond(tree, ends - depth * between, ends, radius))
    return np.maximum(left, _left_in_pits(patch, rising, tree, radius, depth, options)[patch.faces].max(axis=1))


def _left_in_pits(
    patch: Patch, rising: Rising, tree: KDTree, radius: float, depth: float, options: RestOptions
) -> Floats:
    """Return by how much (V,) each vertex is not cleared along the mean of the normals around it, metres.

    At the bottom of a pit, where the ball touches three walls, that is where most is left. 0 where it is not bent.
    """
    sides, beyond = rising
    corners = np.concatenate([patch.faces.ravel(), patch.side_ends(sides).ravel()])
    normals = np.concatenate([np.repeat(patch.facet_normals, 3, axis=0), np.repeat(beyond, 2, axis=0)])
    mean = np.stack([np.bincount(corners, weights=normals[:, k], minlength=len(patch.vertices)) for k in range(3)], 1)
    mean = mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    least = np.ones(len(mean))
    np.minimum.at(least, corners, np.einsum("ij,ij->i", normals, mean[corners]))
    left, bent = np.zeros(len(mean)), least < np.cos(0.5 * options.bent)
    left[bent] = _beyond(tree, patch.vertices[bent] - depth * mean[bent], patch.vertices[bent], radius)
    return left


def _beyond(tree: KDTree, places: Floats, above: Floats, radius: float) -> Floats:
    """Return by how much (N,) places (N, 3) are farther from the tree's points than the radius, up to twice that.

    above (N, 3): on the surface that the tree's points lie on. Of a place below it many points are almost equally far,
    and the nearest is found slowly; the point that is nearest to `above` mostly tells that none is left.
    """
    index = np.asarray(nearest_points(tree, above, distance_upper_bound=2.0 * radius)[1])
    there = np.flatnonzero(index < tree.n)
    beyond = np.full(len(places), np.inf)
    beyond[there] = np.linalg.norm(places[there] - tree.data[index[there]], axis=1) - radius
    doubtful = np.flatnonzero(beyond > 0.0)
    far = np.asarray(nearest_points(tree, places[doubtful], distance_upper_bound=2.0 * radius)[0])
    beyond[doubtful] = np.minimum(far, 2.0 * radius) - radius
    return np.maximum(beyond, 0.0)


def _grown(patch: Patch, wanted: Bools, rings: int) -> Bools:
    """Return the facets (F,) that are wanted, or in one of the rings around them."""
    for _ in range(rings):
        at = np.zeros(len(patch.vertices), dtype=np.bool_)
        at[patch.faces[wanted]] = True
        wanted = np.asarray(at[patch.faces].any(axis=1))
    return wanted


def _about(patch: Patch, wanted: Bools, reach: float) -> Bools:
    """Return the facets (F,) that are wanted, or whose middles are within `reach` metres of those of one."""
    if not wanted.any():
        return wanted
    middles = patch.vertices[patch.faces].mean(axis=1)
    return np.asarray(nearest_points(KDTree(middles[wanted]), middles, distance_upper_bound=reach)[0]) < np.inf


def _spread(patch: Patch, rising: Rising, radius: float) -> Floats:
    """Return the area (V,) of the ball that touches the part from each vertex, as far as its facets leave it open.

    At the bottom of a pit, such as over a hole narrower than the ball, that is much, though the pit has hardly any
    area. By the theorem of Gauss and Bonnet the normals about a vertex span what its angles lack of a full turn. Where
    the patch ends between two walls, they span a triangle with those of the walls.
    """
    topology, faces = patch.topology, patch.faces
    around = np.bincount(faces.ravel(), corner_angles(patch.vertices, faces).ravel(), len(patch.vertices))
    lacks = np.maximum(2.0 * np.pi - around, 0.0)
    lacks[topology.edges[topology.facets_at_edge != 2]] = 0.0
    sides, beyond = rising
    corners = patch.side_ends(sides)
    inner, walls = np.zeros_like(patch.vertices), np.zeros((2, *patch.vertices.shape))
    for end in (0, 1):
        inner[corners[:, end]] += patch.facet_normals[sides // 3]
        walls[end, corners[:, end]] = beyond
    ends = np.flatnonzero(walls.any(axis=2).all(axis=0))
    a, b, c = unit_or_zero(inner[ends]), *walls[:, ends]
    cosines = sum(np.einsum("ni,ni->n", *pair) for pair in ((a, b), (b, c), (c, a)))
    lacks[ends] = 2.0 * np.abs(np.arctan2(np.einsum("ni,ni->n", a, np.cross(b, c)), 1.0 + cosines))
    return radius**2 * lacks


def _lines(
    patch: Patch,
    rising: Rising,
    left: Floats,
    radius: float,
    negligible: float,
    shortest: float,
    options: RestOptions,
) -> Passes:
    """Return a line through each connected piece of the facets on which something is left (F,)."""
    rest = left > 0.0
    if not rest.any():
        return Passes.of([])
    grown = _grown(patch, rest, options.rings)
    of_facets = np.stack([patch.faces, np.roll(patch.faces, -1, axis=1)], axis=-1)
    sides, every = of_facets[grown].reshape(-1, 2), of_facets.reshape(-1, 2)
    piece = components(len(patch.vertices), *sides.T)[1]
    owner = piece[patch.faces[:, 0]]
    area = np.bincount(owner[rest], weights=patch.areas[rest], minlength=int(piece.max()) + 1)
    at = distinct(patch.faces[rest])
    area += np.bincount(piece[at], weights=_spread(patch, rising, radius)[at], minlength=len(area))
    order = np.argsort(area, kind="stable")
    needed = order[np.cumsum(area[order]) > negligible]
    height = np.zeros(len(patch.vertices))
    np.maximum.at(height, patch.faces[rest].ravel(), np.repeat(left[rest], 3))
    normals = np.zeros_like(patch.vertices)
    np.add.at(normals, patch.faces.ravel(), np.repeat(patch.facet_normals * patch.areas[:, None], 3, axis=0))
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    found: list[tuple[Floats, Floats]] = []
    for one in needed[area[needed] > 0.0].tolist():
        own = sides[piece[sides[:, 0]] == one]
        if np.ptp(patch.vertices[own].reshape(-1, 3), axis=0).max() < shortest:
            top = own.ravel()[height[own].argmax()]
            around = np.linalg.norm(patch.vertices - patch.vertices[top], axis=1) <= shortest
            own = np.concatenate([own, every[around[every].all(axis=1)]])
        line = _middle_line(patch.vertices, own, height, shortest, options)
        points = patch.vertices[line]
        for _ in range(options.smoothing):
            points[1:-1] = 0.25 * points[:-2] + 0.5 * points[1:-1] + 0.25 * points[2:]
        if len(points) > 1:
            found.append((points, normals[line]))
    return Passes.of(found, np.arange(len(found)))


def _middle_line(vertices: Floats, sides: Ints, height: Floats, shortest: float, options: RestOptions) -> Ints:
    """Return the vertices (n,) of a line from end to end of a piece, given by its sides (S, 2), where most is left.

    It is at least `shortest` metres long where the piece allows it; one that would be shorter leads through the place
    where most is left.
    """
    used, index = np.unique(sides, return_inverse=True)
    a, b = index.reshape(sides.shape).T
    length = np.linalg.norm(vertices[used[b]] - vertices[used[a]], axis=1)
    most = float(height[used].max())
    # Where nothing is left a way counts ten times.
    cost = length / np.maximum(0.5 * (height[used[a]] + height[used[b]]) / most, 0.1)
    plain, weighed = (_graph(a, b, weights, len(used)) for weights in (length, cost))
    inner = height[used] >= options.core * most
    top = int(height[used].argmax())
    first = via = _farthest(plain, top, inner)
    last = _farthest(plain, first, inner)
    if float(dijkstra(plain, directed=False, indices=first)[last]) < shortest:
        first, via = _farthest(plain, top, inner | True), top
        last = _farthest(plain, first, inner | True)
    _, before = dijkstra(weighed, directed=False, indices=via, return_predecessors=True)
    ways: list[list[int]] = []
    for end in (first, last):
        way = [end]
        while way[-1] != via:
            way.append(int(before[way[-1]]))
        ways.append(way)
    return used[[*ways[0], *ways[1][-2::-1]]]


def _graph(a: Ints, b: Ints, weights: Floats, count: int) -> csr_array:
    """Return the graph of `count` vertices with weights on its sides, each once."""
    pairs, first = np.unique(np.stack([np.minimum(a, b), np.maximum(a, b)]), axis=1, return_index=True)
    return csr_array((weights[first], tuple(pairs)), shape=(count, count))


def _farthest(graph: csr_array, start: int, wanted: Bools) -> int:
    """Return the wanted vertex that is farthest from a vertex, of those that it is connected to."""
    away = dijkstra(graph, directed=False, indices=start)
    return int(np.where(wanted & np.isfinite(away), away, -1.0).argmax())
