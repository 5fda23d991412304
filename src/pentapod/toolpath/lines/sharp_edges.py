"""Sharp edges of a surface: which they are, and chains of them; lines along creases that passes do not cross."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import angle_between
from pentapod.geometry.polyline import spaced
from pentapod.geometry.runs import marked_runs
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch


@dataclass(frozen=True)
class CreaseOptions:
    """How creases of a drive surface are found.

    sharpest: angle between both sides, radians, from which a crease counts. corner: a line ends where the crease turns
    by more than this angle, radians. touch: distance from a pass, as a share of the ball's radius, at which the pass
    crosses a crease. gap: distance along a crease between passes that cross it from which it is followed, in stepovers.
    shortest: line, in radii of the ball.
    """

    sharpest: float = float(np.radians(30.0))
    corner: float = float(np.radians(60.0))
    touch: float = 0.05
    gap: float = 1.04
    shortest: float = 1.0


def crease_lines(patch: Patch, sharpest: float | None = None, options: CreaseOptions = CreaseOptions()) -> Passes:
    """Return the concave edges of a patch as lines: where a ball touches two sides of a corner.

    sharpest: in place of the options'.
    """
    chosen = sharp_edges(patch, options.sharpest if sharpest is None else sharpest, concave=True)
    edges = patch.topology.edges
    lines: list[tuple[Floats, Floats]] = []
    normals = np.zeros_like(patch.vertices)
    np.add.at(normals, patch.faces.ravel(), patch.normals.reshape(-1, 3))
    normals = unit_or_zero(normals)
    for chain in edge_chains(patch.vertices, edges, chosen, options.corner):
        vertices = [v for _, v in chain]
        vertices.append(other_end(edges, *chain[-1]))
        lines.append((patch.vertices[vertices], normals[vertices]))
    return Passes.of(lines, np.arange(len(lines)))


def uncrossed(
    creases: Passes, passes: Passes, stepover: float, radius: float, options: CreaseOptions = CreaseOptions()
) -> Passes:
    """Return the stretches of creases that passes leave out: between crossings, more than a stepover apart.

    A pass beside a crease, even a near one, does not reach into it. radius: of the ball, metres.
    """
    if not len(creases) or not len(passes):
        return creases
    tree, step = KDTree(passes.points), options.touch * radius
    parts: list[tuple[Floats, Floats]] = []
    for k in range(len(creases)):
        line = creases.points[creases.rows(k)]
        place = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
        points = spaced(line, step)
        at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        crossed = np.asarray(tree.query(points, distance_upper_bound=step)[0]) <= step
        for a, b in marked_runs(~crossed).tolist():
            first, last = at[max(a - 1, 0)], at[min(b, len(at) - 1)]
            if last - first > max(options.gap * stepover, options.shortest * radius):
                inner = (place > first) & (place < last)
                where = np.concatenate([[first], place[inner], [last]])
                parts.append(
                    tuple(  # type: ignore[arg-type]
                        np.stack([np.interp(where, place, v[:, axis]) for axis in range(3)], axis=1)
                        for v in (line, creases.normals[creases.rows(k)])
                    )
                )
    return Passes.of(parts, np.arange(len(parts)))


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
