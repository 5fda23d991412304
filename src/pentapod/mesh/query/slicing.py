"""Level lines (isolines) of a quantity on a triangle mesh, for many values at once.

The quantity (height along a direction, geodesic distance, a winding phase) is known at the vertices, and linear on
facets unless it can be asked for inside them. Each vertex gets the number of levels at or below it, an integer; these
tell without any tolerance which levels cross which edge. A facet crossed by a level gives one directed segment, from
the side where its boundary falls through the level to the side where it rises, so that segments of neighbours join
head to tail. They are chained by pointer doubling. The time is proportional to the number of crossings times the
logarithm of the longest chain.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.runs import members, run_starts
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.topology import components

QuantityInside = Callable[[Ints, Floats], Floats]
"""The quantity (N,) at places of facets (N,), from their barycentric weights (N, 3)."""

ROUNDS = 40
"""Steps in which crossings of a quantity that is not linear are found: each at least halves what is left."""

SAME_PLACE = 1e-7
"""Metres up to which points of a line are the same."""

ON_LEVEL = 1e-9
"""Difference from a level, as a share of the change along an edge, that is good enough."""


@dataclass(frozen=True, eq=False)
class LevelSet:
    """A quantity on a patch, and the levels of its lines.

    values (V,): at the vertices. levels (L,): ascending. turns (F, 3) or None: for a quantity that grows by one with
    each turn about a point, integers that each facet adds to its corners' values; both facets at an edge add the same
    but for a constant. The levels are then all integers, and `levels` is not used. inside: the quantity inside facets,
    turns included, if it is not linear there: then lines cross each edge where it truly is at their level.
    """

    patch: Patch
    values: Floats
    levels: Floats
    turns: Ints | None = None
    inside: QuantityInside | None = None

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
    def _edge_sides(self) -> tuple[Ints, Ints, Ints]:
        """A side (E,) of each edge as 3 f + s, and the flat indices 3 f + k (E,), (E,) of its first and second end."""
        edges = self.patch.topology.edges
        side = np.empty(len(edges), dtype=np.intp)
        side[self.patch.topology.edge_of_side.ravel()] = np.arange(3 * len(self.patch.faces))
        here, after = side, side - side % 3 + (side + 1) % 3
        swap = self.patch.faces.ravel()[here] != edges[:, 0]
        return side, np.where(swap, after, here), np.where(swap, here, after)

    @cached_property
    def _second_turns(self) -> Ints:
        """The turns (E,) at each edge's second vertex, in the count of its first: the same in each of its facets."""
        if self.turns is None:
            return np.zeros(len(self.patch.topology.edges), dtype=np.intp)
        _, first, second = self._edge_sides
        return self.turns.ravel()[second] - self.turns.ravel()[first]

    @cached_property
    def edge_bins(self) -> tuple[Ints, Ints]:
        """Each edge's lowest level (E,), in the count of its first vertex; number (E + 1,) of its first crossing."""
        edges = self.patch.topology.edges
        first, second = self._vertex_bins[edges[:, 0]], self._vertex_bins[edges[:, 1]] + self._second_turns
        return np.minimum(first, second), run_starts(np.abs(second - first))

    @cached_property
    def _shares(self) -> Floats:
        """Where (N,) crossings are on their edges: the share of the way from the first vertex to the second."""
        lowest, numbers = self.edge_bins
        edge, number = members(np.diff(numbers))
        level = self.level_values(number + lowest[edge] + 1)
        ends = self.patch.topology.edges[edge]
        start, end = self.values[ends[:, 0]], self.values[ends[:, 1]] + self._second_turns[edge]
        rise = end - start
        t = np.clip((level - start) / np.where(rise == 0.0, 1.0, rise), 0.0, 1.0)
        return t if self.inside is None else self._solved(edge, level, t, (start - level, end - level))

    def _solved(self, edge: Ints, level: Floats, t: Floats, ends: tuple[Floats, Floats]) -> Floats:
        """Return where (N,) the quantity inside edges is at a level, from linear guesses, by the Illinois method.

        ends: its difference from the level at both ends, of different signs.
        """
        _, first, second = (a[edge] for a in self._edge_sides)
        count = np.zeros(len(edge)) if self.turns is None else self.turns.ravel()[first]
        low, high = np.zeros(len(edge)), np.ones(len(edge))
        at_low, at_high, rising = ends[0].copy(), ends[1].copy(), ends[1] >= 0.0
        enough, going = ON_LEVEL * np.abs(at_high - at_low), np.arange(len(edge))
        inside = self.inside or (lambda _, weights: weights[:, 0])
        for _ in range(ROUNDS):
            weights = np.zeros((len(going), 3))
            rows = np.arange(len(going))
            weights[rows, first[going] % 3], weights[rows, second[going] % 3] = 1.0 - t[going], t[going]
            at = inside(first[going] // 3, weights) - count[going] - level[going]
            upper = (at >= 0.0) == rising[going]
            up, down = going[upper], going[~upper]
            high[up], at_high[up], at_low[up] = t[up], at[upper], 0.5 * at_low[up]
            low[down], at_low[down], at_high[down] = t[down], at[~upper], 0.5 * at_high[down]
            going = going[(np.abs(at) > enough[going]) & (high[going] - low[going] > ON_LEVEL)]
            if not len(going):
                break
            guess = high[going] - at_high[going] * (high[going] - low[going]) / (at_high[going] - at_low[going])
            between = (guess > low[going]) & (guess < high[going])
            t[going] = np.where(between, guess, 0.5 * (low[going] + high[going]))
        return t

    def _crossings(self) -> tuple[Ints, Ints, list[Ints]]:
        """Return the facets (R,) that levels cross, the levels (R,), and the two sides (R,), (R,) where they do.

        They cross from the side where the quantity falls, walking around the facet, to the one where it rises.
        """
        bins = self.corner_bins
        low = bins.min(axis=1, initial=1 << 40)
        count = np.maximum(bins.max(axis=1, initial=-1) - low, 0)
        facet, number = members(count)
        level = number + low[facet] + 1
        above = bins[facet] >= level[:, None]
        after = np.roll(above, -1, axis=1)
        return facet, level, [np.argmax(above & ~after, axis=1), np.argmax(~above & after, axis=1)]

    @cached_property
    def _chains(self) -> tuple[Ints, Ints, list[Ints], Ints]:
        """As `_crossings`, in the order in which segments follow each other, and the line (R,) of each."""
        facet, level, sides = self._crossings()
        nodes = [self._crossing(facet, level, side)[2] for side in sides]
        joins = [self.patch.joins[self.patch.topology.edge_of_side[facet, side]] for side in sides]
        begins_at = np.full(int(self.edge_bins[1][-1]), -1, dtype=np.intp)
        begins_at[nodes[0][joins[0]]] = np.flatnonzero(joins[0])
        order, chain = chained(np.where(joins[1], begins_at[nodes[1]], -1))
        return facet[order], level[order], [side[order] for side in sides], chain

    def segments(self) -> tuple[Ints, Floats, Floats, Ints]:
        """Return the lines' segments: facets (R,), barycentric weights (R, 3) of both ends there, and the line (R,).

        Those of a line follow each other.
        """
        facet, level, sides, chain = self._chains
        rows, ends = np.arange(len(facet)), []
        for side in sides:
            a, b, _, t = self._crossing(facet, level, side)
            weights = np.zeros((len(facet), 3))
            weights[rows, a], weights[rows, b] = 1.0 - t, t
            ends.append(weights)
        return facet, ends[0], ends[1], chain

    def lines(self) -> Passes:
        """Return the lines, ordered by level.

        A line ends at the patch's border, at a crease, at an edge of opposite winding, and at an edge of more than two
        facets. Closed lines begin and end in the same point. Seen from outside, the quantity grows to the left of a
        line's direction.
        """
        facet, level, sides, chain = self._chains
        ends = [self._crossing_point(facet, level, side) for side in sides]
        found = _assembled([end[0] for end in ends], chain, level, [end[1] for end in ends])
        # A line through a corner of facets may go along one of their edges and back.
        return found if self.inside is None else found.without_spikes(SAME_PLACE)

    def _crossing(self, facet: Ints, level: Ints, side: Ints) -> tuple[Ints, Ints, Ints, Floats]:
        """Return where levels (R,) cross sides (R,) of facets: both corners, the crossing's number, and the share.

        From the side's lower vertex to its higher, so that both its facets get the same bits.
        """
        faces, edge = self.patch.faces, self.patch.topology.edge_of_side[facet, side]
        a, b = side, (side + 1) % 3
        swap = faces[facet, a] > faces[facet, b]
        a, b = np.where(swap, b, a), np.where(swap, a, b)
        base = np.intp(0) if self.turns is None else self.turns[facet, a]
        lowest, first_number = self.edge_bins
        number = first_number[edge] + (level - base - lowest[edge] - 1)
        return a, b, number, self._shares[number]

    def _crossing_point(self, facet: Ints, level: Ints, side: Ints) -> tuple[Floats, Floats]:
        """Return where (R, 3) levels cross sides of facets, and the normals (R, 3) there."""
        a, b, _, share = self._crossing(facet, level, side)
        t, first, second = share[:, None], self.patch.faces[facet, a], self.patch.faces[facet, b]
        points = self.patch.vertices[first] + t * (self.patch.vertices[second] - self.patch.vertices[first])
        normals = self.patch.normals
        return points, (1.0 - t) * normals[facet, a] + t * normals[facet, b]


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


def _assembled(points: list[Floats], chain: Ints, level: Ints, normals: list[Floats]) -> Passes:
    """Return passes from segments (K,) in order, with their tails' and heads' points and normals.

    Each chain's first tail, then all its heads.
    """
    count = len(chain)
    chains = int(chain[-1]) + 1 if count else 0
    at = np.arange(count) + chain + 1
    first = np.flatnonzero(np.diff(chain, prepend=-1))
    arrays: list[Floats] = []
    for tail, head in (points, normals):
        array = np.empty((count + chains, 3))
        array[at] = head
        array[at[first] - 1] = tail[first]
        arrays.append(array)
    starts = np.concatenate([at[first] - 1, [count + chains]]).astype(np.intp)
    return Passes(arrays[0], arrays[1], starts, level[first]).by_level()
