"""Sharp edges of a surface: which they are, and chains of them; lines along creases that passes do not cross."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import angle_between
from pentapod.geometry.polyline import arc_length, spaced
from pentapod.geometry.runs import marked_runs
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch

Line = tuple[Floats, Floats]
"""Points and normals (n, 3) of a line."""


@dataclass(frozen=True)
class CreaseOptions:
    """How creases of a drive surface are found.

    sharpest: angle between both sides, radians, from which a crease counts. corner: a line ends where the crease turns
    by more than this angle, radians. touch: distance from a pass, as a share of the ball's radius, at which the pass
    crosses a crease. gap: distance along a crease between passes that cross it from which it is followed, in stepovers.
    join: longest way between the ends of two lines that are one, in edges of the mesh; where a crease runs aslant
    through the mesh, some of its edges are blunt. same: ends that are nearer to each other, as a share of that way, are
    one point, whichever way one lies from the other. shortest: line, in radii of the ball; closed ones, such as the
    foot of a narrow pit, may be shorter, and those under which passes leave more than `left` ridges between passes.
    """

    sharpest: float = float(np.radians(30.0))
    corner: float = float(np.radians(60.0))
    touch: float = 0.05
    gap: float = 1.04
    join: float = 3.0
    same: float = 0.1
    shortest: float = 1.0
    left: float = 1.1


def crease_lines(
    patch: Patch,
    sharpest: float | None = None,
    also: Bools | None = None,
    options: CreaseOptions = CreaseOptions(),
) -> Passes:
    """Return the concave edges of a patch as lines: where a cutter touches two sides of a corner.

    sharpest: in place of the options'. also (E,): further edges.
    """
    chosen = sharp_edges(patch, options.sharpest if sharpest is None else sharpest, concave=True)
    chosen = chosen if also is None else chosen | also
    edges = patch.topology.edges
    lines: list[Line] = []
    normals = np.zeros_like(patch.vertices)
    np.add.at(normals, patch.faces.ravel(), patch.normals.reshape(-1, 3))
    normals = unit_or_zero(normals)
    for chain in edge_chains(patch.vertices, edges, chosen, options.corner):
        vertices = [v for _, v in chain]
        vertices.append(other_end(edges, *chain[-1]))
        known = np.flatnonzero(normals[vertices].any(axis=1))
        if len(known):  # between walls that face each other normals cancel: the nearest one on the line counts
            nearest = known[np.abs(np.arange(len(vertices))[:, None] - known).argmin(axis=1)]
            lines.append((patch.vertices[vertices], normals[vertices][nearest]))
    sides = patch.vertices[edges[chosen, 1]] - patch.vertices[edges[chosen, 0]]
    longest = options.join * float(np.median(np.linalg.norm(sides, axis=1))) if len(sides) else 0.0
    lines = joined_ends(lines, longest, options.corner, options.same * longest)
    return Passes.of(lines, np.arange(len(lines)))


def joined_ends(lines: list[Line], longest: float, corner: float, same: float = 0.0) -> list[Line]:
    """Return lines, points and normals (n, 3), joined end to end where they go on within `longest` metres.

    The nearest ends first, of those that are one point the straightest. Neither line turns by more than `corner`
    radians against the other, or against the way between them; ends within `same` metres become one.
    """
    if len(lines) < 2:
        return lines
    ends = np.stack([points[row] for points, _ in lines for row in (0, -1)])
    # Directions out of a line, seen from as far inside as ends may be apart.
    out = np.stack([_outwards(points[::step], longest) for points, _ in lines for step in (-1, 1)])
    pairs = KDTree(ends).query_pairs(longest, output_type="ndarray")
    pairs = pairs[pairs[:, 0] // 2 != pairs[:, 1] // 2]
    a, b = pairs.T
    way = ends[b] - ends[a]
    length = np.linalg.norm(way, axis=1)
    on = length > same
    least = np.cos(corner)
    straight = -(out[a] * out[b]).sum(axis=1)
    suits = straight > least
    suits &= ~on | ((out[a] * way).sum(axis=1) > least * length) & (-(out[b] * way).sum(axis=1) > least * length)
    other = np.full(len(ends), -1, dtype=np.intp)
    for k in np.lexsort((b, a, -straight, np.where(on, length, 0.0))).tolist():
        if suits[k] and other[a[k]] < 0 and other[b[k]] < 0:
            other[a[k]], other[b[k]] = b[k], a[k]
    done = np.zeros(len(lines), dtype=np.bool_)
    result: list[Line] = []
    # Chains begin at free ends; what is left are rings.
    for first in [*np.flatnonzero(other < 0).tolist(), *range(0, len(ends), 2)]:
        at, parts = int(first), list[Line]()
        while at >= 0 and not done[at // 2]:
            done[at // 2] = True
            step = 1 if at % 2 == 0 else -1
            points, normals = lines[at // 2][0][::step], lines[at // 2][1][::step]
            again = int(bool(parts) and float(np.linalg.norm(points[0] - parts[-1][0][-1])) <= same)
            parts.append((points[again:], normals[again:]))
            leaving = at ^ 1
            at = int(other[leaving])
        if parts:
            if at >= 0:  # a ring
                again = int(float(np.linalg.norm(parts[0][0][0] - parts[-1][0][-1])) <= same)
                parts[-1] = parts[-1][0][: len(parts[-1][0]) - again], parts[-1][1][: len(parts[-1][1]) - again]
                parts.append((parts[0][0][:1], parts[0][1][:1]))
            result.append(tuple(np.concatenate([part[k] for part in parts]) for k in range(2)))  # type: ignore[arg-type]
    return result


def _outwards(points: Floats, reach: float) -> Floats:
    """Return the unit direction (3,) in which a line (n, 3) ends, over its last `reach` metres."""
    away = np.linalg.norm(points - points[-1], axis=1)
    inside = points[int(np.flatnonzero(away <= max(reach, away[-2]))[0])]
    direction = points[-1] - inside
    return direction / max(float(np.linalg.norm(direction)), 1e-300)


def uncrossed(
    creases: Passes, passes: Passes, stepover: float, radius: float, options: CreaseOptions = CreaseOptions()
) -> Passes:
    """Return the stretches of creases that passes leave out: between crossings, more than a stepover apart.

    A pass beside a crease, even a near one, does not reach into it. Beyond the last crossing half a stepover counts. A
    crease without any crossing is left out where passes beside it are nearer than the ridge between passes is high, and
    a short one where no more than such a ridge is left under it. radius: of the ball, metres.
    """
    if not len(creases) or not len(passes):
        return creases
    tree, step, half = KDTree(passes.points), options.touch * radius, min(0.5 * stepover, radius)
    ridge, shortest = radius - float(np.sqrt(radius**2 - half**2)), options.shortest * radius
    parts: list[Line] = []
    for k, closed in enumerate(creases.closed.tolist()):
        line, normals = creases.points[creases.rows(k)], creases.normals[creases.rows(k)]
        points = spaced(line, step)
        away = np.asarray(tree.query(points)[0])
        if away.min() > step:
            under = np.asarray(tree.query(line - radius * normals)[0]) - radius
            if away.max() > ridge and (closed or creases.lengths[k] > shortest or under.max() > options.left * ridge):
                parts.append((line, normals))
            continue
        if closed:  # it begins where a pass crosses it
            first = int(np.linalg.norm(line[:-1] - points[away.argmin()], axis=1).argmin())
            line, normals = (np.concatenate([a[first:-1], a[: first + 1]]) for a in (line, normals))
            points = spaced(line, step)
            away = np.asarray(tree.query(points)[0])
        place, at = arc_length(line), arc_length(points)
        for a, b in marked_runs(away > step).tolist():
            first, last = at[max(a - 1, 0)], at[min(b, len(at) - 1)]
            needed = options.gap * stepover * (0.5 if not closed and (a == 0 or b == len(at)) else 1.0)
            if last - first > max(needed, shortest):
                inner = (place > first) & (place < last)
                where = np.concatenate([[first], place[inner], [last]])
                parts.append((_interpolated(where, place, line), _interpolated(where, place, normals)))
    return Passes.of(parts, np.arange(len(parts)))


def _interpolated(where: Floats, place: Floats, values: Floats) -> Floats:
    """Return values (n, 3) at places (n,) of a line, between those (N, 3) at `place` (N,)."""
    return np.stack([np.interp(where, place, values[:, axis]) for axis in range(3)], axis=1)


def sharp_edges(patch: Patch, angle: float, *, concave: bool = False) -> Bools:
    """Return which edges (E,) have an angle of more than `angle` radians between the normals of their two facets.

    Only convex edges, or only concave ones.
    """
    a, b = patch.topology.side_pairs
    normal_a, normal_b = patch.facet_normals[a // 3], patch.facet_normals[b // 3]
    # An edge is convex where the third corner of one facet lies behind the plane of the other.
    corners = patch.faces.ravel()
    third = patch.vertices[corners[b - b % 3 + (b + 2) % 3]]
    height = ((third - patch.vertices[corners[a]]) * normal_a).sum(axis=1)
    wanted = height > 0.0 if concave else height < 0.0
    cosine = (normal_a * normal_b).sum(axis=1)
    sharp = np.zeros(len(patch.topology.edges), dtype=np.bool_)
    sharp[patch.topology.pair_edges] = wanted & patch.topology.pair_agrees & (cosine < np.cos(angle))
    return sharp


def edge_chains(points: Floats, edges: Ints, marked: Bools, corner: float) -> list[list[tuple[int, int]]]:
    """Return the marked edges in chains without corners or branches: each edge, and the vertex where it is entered."""
    numbers = np.flatnonzero(marked)
    at: dict[int, list[int]] = {}
    for e in numbers.tolist():
        for v in edges[e].tolist():
            at.setdefault(v, []).append(e)

    def next_edge(e: int, v: int) -> int | None:
        """Return the edge that continues edge e beyond vertex v, if it is the only one and straight enough."""
        others = [other for other in at[v] if other != e]
        if len(others) != 1:
            return None
        arriving = points[v] - points[other_end(edges, e, v)]
        leaving = points[other_end(edges, others[0], v)] - points[v]
        return others[0] if float(angle_between(arriving, leaving)) < corner else None

    done: set[int] = set()
    chains: list[list[tuple[int, int]]] = []
    for first in numbers.tolist():
        if first in done:
            continue
        # Back to the beginning of the chain, or once round a closed one.
        e, v = first, int(edges[first, 0])
        while (back := next_edge(e, v)) is not None and back != first:
            e, v = back, other_end(edges, back, v)
        chain: list[tuple[int, int]] = []
        step: int | None = e
        while step is not None and step not in done:
            done.add(step)
            chain.append((step, v))
            v = other_end(edges, step, v)
            step = next_edge(step, v)
        chains.append(chain)
    return chains


def other_end(edges: Ints, e: int, v: int) -> int:
    """Return the vertex of edge e that is not v."""
    a, b = edges[e]
    return int(b if a == v else a)
