"""Slicing: a mesh cut by many parallel planes at once.

Each vertex gets the number of planes at or below it, an integer; from these follow without any tolerance
which planes cross which edge, and each crossing's own number. A facet crossed by a plane gives one directed
piece, from the side where its boundary comes down through the plane to the side where it goes up, so that
neighbours' pieces join head to tail. Pieces are then chained by pointer doubling. The time is proportional
to the number of crossings (times the logarithm of the longest chain), whatever the number of planes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Bools, Floats, Ints
from pentapod.toolpath.mesh import Mesh
from pentapod.toolpath.passes import Passes
from pentapod.toolpath.region import Region
from pentapod.toolpath.topology import components


@dataclass(frozen=True)
class Planes:
    """`count` planes x · normal = first + k · step, metres; normal (3,) of unit length."""

    normal: Floats
    first: float
    step: float
    count: int

    def bins(self, points: Floats) -> Ints:
        """Return the highest plane (...) at or below each of points (..., 3); −1 below all."""
        level = np.floor((points @ self.normal - self.first) / self.step)
        return np.clip(level, -1, self.count - 1).astype(np.intp)


def crossings(mesh: Mesh, planes: Planes) -> int:
    """Return how many times facets of the mesh are crossed by planes: what slicing will cost."""
    bins = planes.bins(mesh.vertices)[mesh.faces]
    return int((bins.max(axis=1) - bins.min(axis=1)).sum())


def slice_mesh(mesh: Mesh, planes: Planes, region: Region) -> Passes:
    """Return the lines in which the planes cut the mesh within the region, ordered by plane.

    A line ends at the region's edge, at a border of the mesh, at a crease, and where neighbouring facets
    disagree (winding, more than two at an edge). Closed lines begin and end in the same point. Seen with the
    surface's outside up and the planes' normal to the left, they run forward.
    """
    topology = mesh.topology
    bins = planes.bins(mesh.vertices)
    of_facet = bins[mesh.faces]
    low = of_facet.min(axis=1)
    count = np.where(region.facets(mesh), of_facet.max(axis=1) - low, 0)
    facet = np.repeat(np.arange(len(mesh.faces)), count)
    plane = np.arange(len(facet)) - np.repeat(np.cumsum(count) - count, count) + low[facet] + 1

    above = of_facet[facet] >= plane[:, None]
    after = np.roll(above, -1, axis=1)
    sides = [np.argmax(above & ~after, axis=1), np.argmax(~above & after, axis=1)]  # coming down, going up
    ends = [_crossing(mesh, planes, facet, plane, side) for side in sides]
    points, normals = np.stack([e[0] for e in ends]), np.stack([e[1] for e in ends])

    # Every crossing of an edge by a plane has a number of its own.
    edge_bins = bins[topology.edges]
    first_node = np.cumsum(np.abs(edge_bins[:, 1] - edge_bins[:, 0]))
    edges = [topology.edge_of_side[facet, side] for side in sides]
    nodes = [first_node[e] - (plane - edge_bins[e].min(axis=1)) for e in edges]
    joins = np.zeros(len(topology.edges), dtype=np.bool_)
    joins[topology.pair_edges[mesh.smooth_pairs]] = True

    t0, t1 = region.clip(points, normals)
    kept = np.flatnonzero(t1 > t0)
    open_start, open_end = joins[edges[0]] & (t0 <= 0.0), joins[edges[1]] & (t1 >= 1.0)
    after_row = _following(len(first_node) and int(first_node[-1]), nodes, open_start, open_end, kept)
    order, chain = chained(after_row)

    step, turn = points[1] - points[0], normals[1] - normals[0]
    row = kept[order]
    tails, heads = (
        [points[0][row] + t[row, None] * step[row], normals[0][row] + t[row, None] * turn[row]] for t in (t0, t1)
    )
    return _assembled(tails, heads, chain, plane[row])


def _crossing(mesh: Mesh, planes: Planes, facet: Ints, plane: Ints, side: Ints) -> tuple[Floats, Floats]:
    """Return where (R, 3) planes cross sides of facets, and the interpolated normals (R, 3) there.

    The side is taken from its lower vertex to its higher, so that both its facets get the same bits.
    """
    faces = mesh.faces
    a, b = side, (side + 1) % 3
    swap = faces[facet, a] > faces[facet, b]
    a, b = np.where(swap, b, a), np.where(swap, a, b)
    start, end = mesh.vertices[faces[facet, a]], mesh.vertices[faces[facet, b]]
    rise = (end - start) @ planes.normal
    level = planes.first + plane * planes.step - start @ planes.normal
    t = np.clip(level / np.where(rise == 0.0, 1.0, rise), 0.0, 1.0)[:, None]
    normals = mesh.corner_normals
    return start + t * (end - start), (1.0 - t) * normals[facet, a] + t * normals[facet, b]


def _following(node_count: int, nodes: list[Ints], open_start: Bools, open_end: Bools, kept: Ints) -> Ints:
    """Return for each kept piece (K,) the kept piece that goes on where it ends, or −1."""
    begins_at = np.full(node_count, -1, dtype=np.intp)
    starting = np.flatnonzero(open_start[kept])
    begins_at[nodes[0][kept[starting]]] = starting
    return np.where(open_end[kept], begins_at[nodes[1][kept]], -1)


def chained(after: Ints) -> tuple[Ints, Ints]:
    """Return an order (K,) of items in which each stands right behind its predecessor, and its chain (K,).

    after (K,): the item that follows each, or −1; no item follows two. Closed chains are cut before their
    lowest item. Chains are ordered by their first items.
    """
    count = len(after)
    before = np.full(count, -1, dtype=np.intp)
    linked = np.flatnonzero(after >= 0)
    before[after[linked]] = linked
    number, label = components(count, linked, after[linked])
    headed = np.zeros(number, dtype=np.bool_)
    headed[label[before < 0]] = True
    lowest = np.full(number, count, dtype=np.intp)
    np.minimum.at(lowest, label, np.arange(count))
    before[lowest[~headed]] = -1  # closed chains

    # Pointer doubling: `jump` leads 2^k items back, `distance` is how far that was.
    jump = np.where(before < 0, np.arange(count), before)
    distance = (before >= 0).astype(np.intp)
    while True:
        further = distance[jump]
        if not further.any():
            break
        distance, jump = distance + further, jump[jump]
    order = np.lexsort((distance, jump))
    return order, np.cumsum(distance[order] == 0) - 1


def _assembled(tails: list[Floats], heads: list[Floats], chain: Ints, plane: Ints) -> Passes:
    """Return passes from pieces (K,) in order: each chain's first tail, then all its heads."""
    count = len(chain)
    chains = int(chain[-1]) + 1 if count else 0
    at = np.arange(count) + chain + 1
    first = np.flatnonzero(np.diff(chain, prepend=-1))
    arrays: list[Floats] = []
    for tail, head in zip(tails, heads, strict=True):
        array = np.empty((count + chains, 3))
        array[at] = head
        array[at[first] - 1] = tail[first]
        arrays.append(array)
    starts = np.concatenate([at[first] - 1, [count + chains]]).astype(np.intp)
    # By plane first; within a plane in the order of the facets, which is the mesh's.
    passes = Passes(arrays[0], arrays[1], starts, plane[first])
    return _by_plane(passes)


def _by_plane(passes: Passes) -> Passes:
    order = np.argsort(passes.planes, kind="stable")
    counts = np.diff(passes.starts)[order]
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.intp)
    index = np.repeat(passes.starts[order] - starts[:-1], counts) + np.arange(len(passes.points))
    return Passes(passes.points[index], passes.normals[index], starts, passes.planes[order])
