"""Facets on a grid of cells: which cells their union covers, how near the nearest facet is, and the union's border.

Every facet is cut by the middle line of each row of cells; a row is covered where such a cut covers a cell's middle.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.runs import members
from pentapod.mesh.query.slicing import chained

AT_ONCE = 2_000_000
"""Cells that are treated at once, so that memory stays small."""

STRAIGHT = 4
"""Sides of cells in a row that are taken for a straight line."""

RIM = 2
"""Empty cells around the facets."""


@dataclass(frozen=True, eq=False)
class Cuts:
    """Cuts of facets by the middle lines of rows.

    rows (S,); starts, ends (S,): first column whose middle is covered, and the one after the last. heights (S,): of the
    facet at the middle of the first column; slopes (S,): by how much it rises to the next column.
    """

    rows: Ints
    starts: Ints
    ends: Ints
    heights: Floats
    slopes: Floats


@dataclass(frozen=True, eq=False)
class Grid:
    """Cells of a plane: low (2,) of the lower left corner, step: their width, shape: rows and columns."""

    low: Floats
    step: float
    shape: tuple[int, int]

    @classmethod
    def around(cls, low: Floats, high: Floats, cells: int) -> Grid:
        """Return the grid around a box, with lower left and upper right corners (2,); `cells` along its longer side."""
        step = max(float((high - low).max()), 1e-9) / cells
        columns, rows = np.ceil((high - low) / step - 1e-6).astype(np.intp) + 2 * RIM
        return cls(low - RIM * step, step, (int(rows), int(columns)))

    def cells(self, points: Floats) -> Floats:
        """Return points (..., 2) counted in cells from the lower left corner."""
        return (points - self.low) / self.step

    def points(self, cells: Floats) -> Floats:
        """Return the points (..., 2) of places counted in cells."""
        return self.low + self.step * cells

    def cuts(self, corners: Floats) -> Cuts:
        """Return the cuts of facets (F, 3, 3): to the right, upwards, and towards the viewer."""
        places = self.cells(corners[..., :2])
        order = np.argsort(places[..., 1], axis=1)
        x, y = (np.take_along_axis(places[..., k], order, axis=1) for k in (0, 1))
        z = np.take_along_axis(corners[..., 2], order, axis=1)
        first, last = (np.ceil(y[:, k] - 0.5).astype(np.intp) for k in (0, 2))
        facet, number = members(last - first)
        rows = first[facet] + number
        line, x, y, z = rows + 0.5, x[facet], y[facet], z[facet]
        lower = line < y[:, 1]
        here, there = np.where(lower, 0, 1), np.where(lower, 1, 2)
        item = np.arange(len(rows))
        ends: list[Floats] = []
        for a, b in ((np.zeros_like(here), np.full_like(here, 2)), (here, there)):
            start, end = y[item, a], y[item, b]
            share = np.clip((line - start) / np.where(end > start, end - start, 1.0), 0.0, 1.0)
            ends += [v[item, a] + share * (v[item, b] - v[item, a]) for v in (x, z)]
        x0, z0, x1, z1 = ends
        swap = x0 > x1
        left, right = np.where(swap, x1, x0), np.where(swap, x0, x1)
        at_left, at_right = np.where(swap, z1, z0), np.where(swap, z0, z1)
        wide = right - left
        slopes: Floats = np.where(wide > 1e-9, (at_right - at_left) / np.where(wide > 1e-9, wide, 1.0), 0.0)
        starts, stops = (np.ceil(v - 0.5).astype(np.intp) for v in (left, right))
        heights: Floats = at_left + slopes * (starts + 0.5 - left)
        kept = stops > starts
        return Cuts(rows[kept], starts[kept], stops[kept], heights[kept], slopes[kept])

    def covered(self, cuts: Cuts) -> Bools:
        """Return which cells (rows, columns) are covered."""
        rows, columns = self.shape
        count, wide = rows * (columns + 1), columns + 1
        begun = np.bincount(cuts.rows * wide + cuts.starts, minlength=count)
        ended = np.bincount(cuts.rows * wide + cuts.ends, minlength=count)
        return np.cumsum((begun - ended).reshape(rows, wide), axis=1)[:, :-1] > 0

    def nearest(self, cuts: Cuts) -> Floats:
        """Return how far towards the viewer the nearest facet is at each cell (rows, columns); −inf where none is."""
        rows, columns = self.shape
        found = np.full(rows * columns, -np.inf)
        for part in _parts(cuts.ends - cuts.starts):
            cut, number = members((cuts.ends - cuts.starts)[part])
            cut = cut + part.start
            cell = cuts.rows[cut] * columns + cuts.starts[cut] + number
            np.maximum.at(found, cell, cuts.heights[cut] + cuts.slopes[cut] * number)
        return found.reshape(rows, columns)


def _parts(counts: Ints) -> Iterator[slice]:
    """Yield slices of runs whose members are about AT_ONCE together."""
    block = np.cumsum(counts) // AT_ONCE
    edges = [0, *(np.flatnonzero(np.diff(block)) + 1).tolist(), len(counts)]
    yield from (slice(a, b) for a, b in pairwise(edges) if b > a)


def borders(covered: Bools) -> list[Floats]:
    """Return the closed lines (K, 2) around covered cells, counted in cells; the covered side is on their left.

    They go through the middles of the cells' sides, so that steps become slopes, and through corners between straight
    parts of at least STRAIGHT sides. They end where they begin. Holes are lines of their own.
    """
    rows, columns = covered.shape
    wide = columns + 1
    inside = np.zeros((rows + 2, columns + 2), dtype=np.bool_)
    inside[1:-1, 1:-1] = covered
    here = inside[1:-1, 1:-1]
    sides: list[tuple[Ints, Ints, Ints]] = []
    # Of each covered cell the sides to cells that are not: below, right, above, left; counterclockwise.
    for (dr, dc), start, end in (
        ((-1, 0), (0, 0), (0, 1)),
        ((0, 1), (0, 1), (1, 1)),
        ((1, 0), (1, 1), (1, 0)),
        ((0, -1), (1, 0), (0, 0)),
    ):
        r, c = np.nonzero(here & ~inside[1 + dr : rows + 1 + dr, 1 + dc : columns + 1 + dc])
        sides.append((r * columns + c, (r + start[0]) * wide + c + start[1], (r + end[0]) * wide + c + end[1]))
    cell, start, end = (np.concatenate(part) for part in zip(*sides, strict=True))
    if not len(cell):
        return []
    order, chain = chained(_after(cell, start, end))
    ends = np.stack([start % wide, start // wide, end % wide, end // wide], axis=1)[order].astype(np.float64)
    return [_line(side[:, :2], side[:, 2:]) for side in np.split(ends, np.flatnonzero(np.diff(chain)) + 1)]


def _line(starts: Floats, ends: Floats) -> Floats:
    """Return the closed line (K, 2) along sides of cells (N, 2) that follow each other."""
    headings = ends - starts
    turns = np.flatnonzero((headings != np.roll(headings, 1, axis=0)).any(axis=1))
    starts, ends = np.roll(starts, -turns[0], axis=0), np.roll(ends, -turns[0], axis=0)
    at = turns - turns[0]
    lengths = np.diff(np.append(at, len(starts)))
    sharp = at[np.minimum(lengths, np.roll(lengths, 1)) >= STRAIGHT]
    line = np.insert(0.5 * (starts + ends), sharp, starts[sharp], axis=0)
    return np.concatenate([line, line[:1]])


def _after(cell: Ints, start: Ints, end: Ints) -> Ints:
    """Return the side (K,) after each. Where two cells touch in a corner, a line stays with its cell."""
    order = np.lexsort((cell, start))
    first = np.searchsorted(start[order], end)
    second = np.minimum(first + 1, len(order) - 1)
    two = (start[order[second]] == end) & (second > first)
    other = two & (cell[order[first]] != cell) & (cell[order[second]] == cell)
    return np.where(other, order[second], order[first])


def simplified(points: Floats, tolerance: float) -> Floats:
    """Return those of points (N, 2) of a line that keep it within a distance of what it was; the ends are kept."""
    kept = np.zeros(len(points), dtype=np.bool_)
    kept[[0, -1]] = True
    open_parts = [(0, len(points) - 1)]
    while open_parts:
        a, b = open_parts.pop()
        if b - a < 2:
            continue
        along, between = points[b] - points[a], points[a + 1 : b] - points[a]
        length = float(np.hypot(along[0], along[1]))
        if length > 0.0:
            share = np.clip(between @ along / length**2, 0.0, 1.0)
            off = np.hypot(*(between - share[:, None] * along).T)
        else:
            off = np.hypot(between[:, 0], between[:, 1])
        worst = int(off.argmax())
        if off[worst] > tolerance:
            k = a + 1 + worst
            kept[k] = True
            open_parts += [(a, k), (k, b)]
    return points[kept]
