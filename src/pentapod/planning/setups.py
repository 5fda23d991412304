"""Set-ups: partition of a path into the fewest pieces that fit the machine one by one, each clamped anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.progress import Progress, silent
from pentapod.base.refusal import Refusal, Shortfall
from pentapod.geometry.runs import marked_runs
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.linking.partition import Piece, cutting_intervals, part_of, pass_ends
from pentapod.toolpath.toolpath import Toolpath

Fits = Callable[[Toolpath], bool]

SLICES = 32
"""Number of places along the part's extent where a box may end."""


def setups(
    toolpath: Toolpath, fits: Fits, style: LinkStyle, most: int, whole: Refusal, progress: Progress = silent
) -> tuple[Piece, ...] | Refusal:
    """Return the pieces, at most `most` and at least two, into which a path that does not fit is split; or a refusal.

    whole: the refusal of the path in one. Ways to split, each taken with as few pieces as it has: the path in a row,
    between its passes; the part in slabs across its longest or its second extent; the same with each slab in two,
    three, … columns. Each piece in turn is made as large as still fits: a piece of what fits fits too, so that no split
    of the same way has fewer. style: of the ways between cuts where others are left out.
    """
    search = _Search(toolpath, fits, style, progress)
    best: tuple[Piece, ...] = ()
    for way in _ways(toolpath, most):
        limit = len(best) - 1 if best else most
        if limit // way.columns < 2:
            continue
        found = search.split(way, limit)
        best = found if found else best
        if len(best) == 2:
            break
    return best if best else _refusal(search, most, whole)


@dataclass(frozen=True, eq=False)
class _Way:
    """A way to split. ends (E,): where a piece may end, rising, the last being the path's end.

    along: direction 0, 1 or 2 to which ends are coordinates in metres, None where they are waypoints; columns: so many
    pieces side by side at once, in the direction `across`.
    """

    name: str
    ends: Floats
    along: int | None = None
    columns: int = 1
    across: int = 0


def _ways(toolpath: Toolpath, most: int) -> Iterator[_Way]:
    ends = pass_ends(toolpath).astype(np.float64)
    ends[-1] = len(toolpath) - 1
    yield _Way("between passes", ends)
    middles = (0.5 * (toolpath.tips[:-1] + toolpath.tips[1:]))[cutting_intervals(toolpath)]
    low, extent = middles.min(axis=0), np.ptp(middles, axis=0)
    longest, second = np.argsort(-extent, kind="stable")[:2].tolist()
    for columns in range(1, most // 2 + 1):
        for along, across in ((longest, second), (second, longest)):
            # In micrometres, so that people can read them and files hold them.
            steps = np.round(low[along] + extent[along] * np.arange(1, SLICES) / SLICES, 6)
            steps = steps[(steps > low[along]) & (steps < low[along] + extent[along])]
            name = f"across {'xyz'[along]}" + (f" in {columns} columns" if columns > 1 else "")
            yield _Way(name, np.append(np.unique(steps), np.inf), along, columns, across)


@dataclass(eq=False)
class _Search:
    """Looks for splits, and remembers the one that left the least: reached (N − 1,) are the cuts of its pieces."""

    toolpath: Toolpath
    fits: Fits
    style: LinkStyle
    progress: Progress

    def __post_init__(self) -> None:
        self.cutting = cutting_intervals(self.toolpath)
        self.reached: Bools = np.zeros_like(self.cutting)

    def split(self, way: _Way, most: int) -> tuple[Piece, ...]:
        """Return the fewest pieces of one way, at most `most`; none where they are not enough."""
        pieces: list[Piece] = []
        reached, start, shelves = np.zeros_like(self.cutting), 0, 0
        while start < len(way.ends):
            found = None
            if len(pieces) + way.columns <= most:
                self.progress("set-ups", float(reached.mean() / self.cutting.mean()), f"{way.name}: {shelves} so far")
                found = self._furthest(way, start)
            if found is None:
                self.reached = max(self.reached, reached, key=np.count_nonzero)
                return ()
            (start, more), shelves = found, shelves + 1
            pieces += more
            for piece in more:
                reached |= piece.cuts(self.toolpath)
        self.reached = reached
        even = self._even(way, shelves)
        return tuple(even if 0 < len(even) <= len(pieces) else pieces)

    def _even(self, way: _Way, shelves: int) -> list[Piece]:
        """Return as many pieces that share the way evenly, where they fit: none is then tighter than it must be."""
        edges = [0, *(len(way.ends) * k // shelves for k in range(1, shelves + 1))]
        pieces = [piece for a, b in pairwise(edges) if b > a for piece in self._pieces(way, a, b - 1)]
        return pieces if self._all_fit(pieces) else []

    def _all_fit(self, pieces: list[Piece]) -> bool:
        return all(self.fits(part_of(self.toolpath, piece, self.style)) for piece in pieces)

    def _furthest(self, way: _Way, start: int) -> tuple[int, list[Piece]] | None:
        """Return the place after the last end that fits, from the one at `start` on, and the pieces; by halving."""
        # All at once is known not to fit, in columns neither: slabs across the other direction would have.
        low, high, best = start - 1, len(way.ends) - (start == 0), None
        middle = start  # the least comes first: where it does not fit nothing does
        while high - low > 1:
            pieces = self._pieces(way, start, middle)
            if self._all_fit(pieces):
                # The rest may well fit as a whole.
                low, middle = middle, (middle + high) // 2 if middle > start or start == 0 else high - 1
                best = (low + 1, pieces)
            elif middle == start:
                return None
            else:
                high = middle
                middle = (low + high) // 2
        return best

    def _pieces(self, way: _Way, start: int, end: int) -> list[Piece]:
        """Return what lies between two ends of a way: one piece, or one for each column; those that hold cuts."""
        last = len(self.toolpath) - 1
        before, after = way.ends[start - 1] if start > 0 else -np.inf, way.ends[end]
        if way.along is None:
            return [Piece(0 if start == 0 else int(before), int(after))]
        shelf = _bounded(Piece(0, last), way.along, before, after)
        if way.columns == 1:
            candidates = [shelf]
        else:
            middles = 0.5 * (self.toolpath.tips[:-1] + self.toolpath.tips[1:])[shelf.cuts(self.toolpath), way.across]
            inner = np.linspace(*_ends(middles), way.columns + 1)[1:-1].round(6)
            borders = [-np.inf, *inner.tolist(), np.inf]
            candidates = [_bounded(shelf, way.across, a, b) for a, b in pairwise(borders) if a < b]
        return [piece for piece in candidates if piece.cuts(self.toolpath).any()]


def _ends(values: Floats) -> tuple[float, float]:
    return (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)


def _bounded(piece: Piece, along: int, low: float, high: float) -> Piece:
    """Return a piece with its box bounded in one direction."""
    lows, highs = list(piece.low), list(piece.high)
    lows[along], highs[along] = float(low), float(high)
    return replace(piece, low=(lows[0], lows[1], lows[2]), high=(highs[0], highs[1], highs[2]))


def _refusal(search: _Search, most: int, whole: Refusal) -> Refusal:
    """Return the refusal of a path in set-ups: what was left over, and what was in the way of the whole."""
    left = tuple((a, b) for a, b in marked_runs(search.cutting & ~search.reached).tolist())
    share = 100.0 * float(search.reached.sum() / search.cutting.sum())
    reached = f"the best split found reaches {share:.0f} % of the cuts"
    cause = f"{most} set-ups are not enough: {reached}; in one set-up {whole.cause}"
    over = Shortfall(f"beyond {most} set-ups", left, 0.0, "")
    return replace(whole, cause=cause, diagnosis=(over, *whole.diagnosis), remedy=f"Try more set-ups. {whole.remedy}")
