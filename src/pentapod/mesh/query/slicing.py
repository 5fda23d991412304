"""Level lines (isolines) of a quantity on a triangle mesh, for many values at once.

The quantity (height along a direction, geodesic distance, a winding phase) is known at the vertices and linear on
facets. Each vertex gets the number of levels at or below it, an integer; these tell without any tolerance which levels
cross which edge. A facet crossed by a level gives one directed segment, from the side where its boundary falls through
the level to the side where it rises, so that segments of neighbours join head to tail. They are chained by pointer
doubling. The time is proportional to the number of crossings times the logarithm of the longest chain.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.runs import members, run_starts
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.topology import components


@dataclass(frozen=True, eq=False)
class LevelSet:
    """A quantity on a patch, and the levels of its lines.

    values (V,): at the vertices. levels (L,): ascending. turns (F, 3) or None: for a quantity that grows by one with
    each turn about a point, integers that each facet adds to its corners' values; both facets at an edge add the same
    but for a constant. The levels are then all integers, and `levels` is not used.
    """

    patch: Patch
    values: Floats
    levels: Floats
    turns: Ints | None = None

    @cached_property
    def corner_bins(self) -> Ints:
        """The highest level (F, 3) at or below each corner; −1 below all."""
        if self.turns is None:
            return self._vertex_bins[self.patch.faces]
        return self._vertex_bins[self.patch.faces] + self.turns

    @cached_property
    def _vertex_bins(self) -> Ints:
        if self.turns is None:
            return np.searchsorted(self.levels, self.values, side="right") - 1
        return np.floor(self.values).astype(np.intp)

    @property
    def crossings(self) -> int:
        """Number of crossings of facets by levels: the cost of `lines`."""
        return int((self.corner_bins.max(axis=1, initial=-1) - self.corner_bins.min(axis=1, initial=1 << 40)).sum())

    def level_values(self, level: Ints) -> Floats:
        """Return the quantity on levels (R,)."""
        return self.levels[level] if self.turns is None else level.astype(np.float64)

    @cached_property
    def edge_bins(self) -> tuple[Ints, Ints]:
        """Each edge's lowest level (E,), in the count of its first vertex; number (E + 1,) of its first crossing."""
        edges = self.patch.topology.edges
        first, second = self._vertex_bins[edges[:, 0]], self._vertex_bins[edges[:, 1]]
        if self.turns is not None:
            # The difference of the turns at both ends is the same in each of the edge's facets.
            side = np.empty(len(edges), dtype=np.intp)
            side[self.patch.topology.edge_of_side.ravel()] = np.arange(3 * len(self.patch.faces))
            here, after = side, side - side % 3 + (side + 1) % 3
            swap = self.patch.faces.ravel()[here] != edges[:, 0]
            here, after = np.where(swap, after, here), np.where(swap, here, after)
            second = second + self.turns.ravel()[after] - self.turns.ravel()[here]
        between = np.abs(second - first)
        return np.minimum(first, second), run_starts(between)

    def lines(self) -> Passes:
        """Return the lines, ordered by level.

        A line ends at the patch's border, at a crease, at an edge of opposite winding, and at an edge of more than two
        facets. Closed lines begin and end in the same point. Seen from outside, the quantity grows to the left of a
        line's direction.
        """
        patch, topology = self.patch, self.patch.topology
        bins = self.corner_bins
        low = bins.min(axis=1, initial=1 << 40)
        count = np.maximum(bins.max(axis=1, initial=-1) - low, 0)
        facet, number = members(count)
        level = number + low[facet] + 1
        above = bins[facet] >= level[:, None]
        after = np.roll(above, -1, axis=1)
        sides = [np.argmax(above & ~after, axis=1), np.argmax(~above & after, axis=1)]  # falling, rising
        ends = [self._crossing(facet, level, side) for side in sides]
        nodes, edges = [e[2] for e in ends], [topology.edge_of_side[facet, side] for side in sides]
        joins = [patch.joins[edge] for edge in edges]
        begins_at = np.full(int(self.edge_bins[1][-1]), -1, dtype=np.intp)
        begins_at[nodes[0][joins[0]]] = np.flatnonzero(joins[0])
        order, chain = chained(np.where(joins[1], begins_at[nodes[1]], -1))
        tails, heads = ([values[order] for values in end[:2]] for end in ends)
        return _assembled(tails, heads, chain, level[order])

    def _crossing(self, facet: Ints, level: Ints, side: Ints) -> tuple[Floats, Floats, Ints]:
        """Return where (R, 3) levels cross sides of facets, the normals (R, 3) there, and the crossing's number.

        Computed from the side's lower vertex to its higher, so that both its facets get the same bits.
        """
        faces, edge = self.patch.faces, self.patch.topology.edge_of_side[facet, side]
        a, b = side, (side + 1) % 3
        swap = faces[facet, a] > faces[facet, b]
        a, b = np.where(swap, b, a), np.where(swap, a, b)
        first, second = faces[facet, a], faces[facet, b]
        base, more = np.intp(0), np.intp(0)
        if self.turns is not None:
            base = self.turns[facet, a]
            more = self.turns[facet, b] - base
        start, end = self.values[first], self.values[second] + more
        lowest, first_number = self.edge_bins
        number = first_number[edge] + (level - base - lowest[edge] - 1)
        rise = end - start
        t = (self.level_values(level - base) - start) / np.where(rise == 0.0, 1.0, rise)
        t = np.clip(t, 0.0, 1.0)[:, None]
        points = self.patch.vertices[first] + t * (self.patch.vertices[second] - self.patch.vertices[first])
        normals = self.patch.normals
        return points, (1.0 - t) * normals[facet, a] + t * normals[facet, b], number


def chained(after: Ints) -> tuple[Ints, Ints]:
    """Return an order (K,) of items in which each follows its predecessor, and the chain (K,) of each.

    after (K,): the item after each, or −1; no item is after two. Closed chains are cut before their lowest item. Chains
    are ordered by their first items.
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

    # Pointer doubling: `jump` is the item up to 2^k places before, `distance` the number of places.
    jump = np.where(before < 0, np.arange(count), before)
    distance = (before >= 0).astype(np.intp)
    while True:
        farther = distance[jump]
        if not farther.any():
            break
        distance, jump = distance + farther, jump[jump]
    order = np.lexsort((distance, jump))
    return order, np.cumsum(distance[order] == 0) - 1


def _assembled(tails: list[Floats], heads: list[Floats], chain: Ints, level: Ints) -> Passes:
    """Return passes from segments (K,) in order: each chain's first tail, then all its heads."""
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
    return Passes(arrays[0], arrays[1], starts, level[first]).by_level()
