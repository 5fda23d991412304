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
    """Return the pieces, two to `most`, into which a path that does not fit is partitioned; or a refusal.

    whole: the refusal of the undivided path. Schemes, each with its least number of pieces: the path in a row, between
    its passes; the part in slabs across its longest or its second extent; the same with each slab in two, three, …
    columns. Greedy: each piece in turn is made as large as still fits. Every part of a piece that fits fits too, so no
    partition of the same scheme has fewer pieces. style: of the links where cuts are left out.
    """
    search = _Search(toolpath, fits, style, progress)
    best: tuple[Piece, ...] = ()
    for scheme in _schemes(toolpath, most):
        limit = len(best) - 1 if best else most
        if limit // scheme.columns < 2:
            continue
        found = search.split(scheme, limit)
        best = found if found else best
        if len(best) == 2:
            break
    return best if best else _refusal(search, most, whole)


@dataclass(frozen=True, eq=False)
class _Scheme:
    """A scheme of partition. ends (E,): possible ends of pieces, ascending, the last is the path's end.

    along: direction 0, 1 or 2 along which ends are coordinates in metres, None where they are waypoints; columns:
    number of pieces side by side, in the direction `across`.
    """

    name: str
    ends: Floats
    along: int | None = None
    columns: int = 1
    across: int = 0


def _schemes(toolpath: Toolpath, most: int) -> Iterator[_Scheme]:
    ends = pass_ends(toolpath).astype(np.float64)
    ends[-1] = len(toolpath) - 1
    yield _Scheme("between passes", ends)
    middles = (0.5 * (toolpath.tips[:-1] + toolpath.tips[1:]))[cutting_intervals(toolpath)]
    low, extent = middles.min(axis=0), np.ptp(middles, axis=0)
    longest, second = np.argsort(-extent, kind="stable")[:2].tolist()
    for columns in range(1, most // 2 + 1):
        for along, across in ((longest, second), (second, longest)):
            # Whole micrometres, so that they can be read and stored in files.
            steps = np.round(low[along] + extent[along] * np.arange(1, SLICES) / SLICES, 6)
            steps = steps[(steps > low[along]) & (steps < low[along] + extent[along])]
            name = f"across {'xyz'[along]}" + (f" in {columns} columns" if columns > 1 else "")
            yield _Scheme(name, np.append(np.unique(steps), np.inf), along, columns, across)


@dataclass(eq=False)
class _Search:
    """Searches for partitions.

    ended: schemes with too few pieces: the cuts (N − 1,) of all slabs but a last one, and where that begins; None where
    nothing fits there.
    """

    toolpath: Toolpath
    fits: Fits
    style: LinkStyle
    progress: Progress

    def __post_init__(self) -> None:
        self.cutting = cutting_intervals(self.toolpath)
        self.ended: list[tuple[Bools, _Scheme, int | None]] = []

    def split(self, scheme: _Scheme, most: int) -> tuple[Piece, ...]:
        """Return the fewest pieces of one scheme, at most `most`; none where they are not enough."""
        pieces: list[Piece] = []
        reached, start, slabs = np.zeros_like(self.cutting), 0, 0
        while start < len(scheme.ends):
            room = (most - len(pieces)) // scheme.columns
            self.progress("set-ups", float(reached.mean() / self.cutting.mean()), f"{scheme.name}: {slabs} so far")
            # How far the last slab reaches matters only where there is no partition.
            found = self._furthest(scheme, start, rest=start > 0) if room > 1 else self._rest(scheme, start)
            if found is None:
                self.ended.append((reached, scheme, start if room == 1 else None))
                return ()
            (start, more), slabs = found, slabs + 1
            pieces += more
            for piece in more:
                reached |= piece.cuts(self.toolpath)
        even = self._even(scheme, slabs)
        return tuple(even if 0 < len(even) <= len(pieces) else pieces)

    def _even(self, scheme: _Scheme, slabs: int) -> list[Piece]:
        """Return the pieces of as many slabs of even size, if they fit; none where they do not."""
        edges = [0, *(len(scheme.ends) * k // slabs for k in range(1, slabs + 1))]
        pieces = [piece for a, b in pairwise(edges) if b > a for piece in self._pieces(scheme, a, b - 1)]
        return pieces if self._all_fit(pieces) else []

    def _rest(self, scheme: _Scheme, start: int) -> tuple[int, list[Piece]] | None:
        """As `_furthest`, for the last slab that may be: all that is left, or nothing."""
        pieces = self._pieces(scheme, start, len(scheme.ends) - 1)
        return (len(scheme.ends), pieces) if self._all_fit(pieces) else None

    def most_reached(self) -> Bools:
        """Return the cuts of the best partition, its last slab as large as fits."""
        reached, scheme, start = max(self.ended, key=lambda each: (np.count_nonzero(each[0]), each[2] is not None))
        last = None if start is None else self._furthest(scheme, start, rest=False)
        for piece in () if last is None else last[1]:
            reached = reached | piece.cuts(self.toolpath)
        return reached

    def _all_fit(self, pieces: list[Piece]) -> bool:
        return all(self.fits(part_of(self.toolpath, piece, self.style)) for piece in pieces)

    def _furthest(self, scheme: _Scheme, start: int, *, rest: bool) -> tuple[int, list[Piece]] | None:
        """Return the index after the last end that fits, at `start` or later, and the pieces; by bisection.

        rest: whether all that is left may fit. The whole does not, nor in columns: slabs across the other direction
        would have fitted.
        """
        low, high, best = start - 1, len(scheme.ends) - (not rest), None
        middle = start  # the smallest piece first: if it does not fit, none does
        while high - low > 1:
            pieces = self._pieces(scheme, start, middle)
            if self._all_fit(pieces):
                # Then the whole rest, which often fits.
                low, middle = middle, high - 1 if rest and middle == start else (middle + high) // 2
                best = (low + 1, pieces)
            elif middle == start:
                return None
            else:
                high = middle
                middle = (low + high) // 2
        return best

    def _pieces(self, scheme: _Scheme, start: int, end: int) -> list[Piece]:
        """Return the pieces between two ends of a scheme, one for each column; those with cuts."""
        last = len(self.toolpath) - 1
        before, after = scheme.ends[start - 1] if start > 0 else -np.inf, scheme.ends[end]
        if scheme.along is None:
            return [Piece(0 if start == 0 else int(before), int(after))]
        slab = _bounded(Piece(0, last), scheme.along, before, after)
        candidates, cuts = [slab], slab.cuts(self.toolpath)
        if scheme.columns > 1 and cuts.any():
            middles = 0.5 * (self.toolpath.tips[:-1] + self.toolpath.tips[1:])[cuts, scheme.across]
            inner = np.linspace(float(middles.min()), float(middles.max()), scheme.columns + 1)[1:-1].round(6)
            borders = [-np.inf, *inner.tolist(), np.inf]
            candidates = [_bounded(slab, scheme.across, a, b) for a, b in pairwise(borders) if a < b]
        return [piece for piece in candidates if piece.cuts(self.toolpath).any()]


def _bounded(piece: Piece, along: int, low: float, high: float) -> Piece:
    """Return a piece with its box bounded in one direction."""
    lows, highs = list(piece.low), list(piece.high)
    lows[along], highs[along] = float(low), float(high)
    return replace(piece, low=(lows[0], lows[1], lows[2]), high=(highs[0], highs[1], highs[2]))


def _refusal(search: _Search, most: int, whole: Refusal) -> Refusal:
    """Return the refusal of a path in set-ups: the cuts left over, and the diagnosis of the whole."""
    made = search.most_reached()
    left = tuple((a, b) for a, b in marked_runs(search.cutting & ~made).tolist())
    share = 100.0 * float(made.sum() / search.cutting.sum())
    reached = f"the best partition found makes {share:.0f} % of the cuts"
    cause = f"{most} set-ups are not enough: {reached}; in one set-up {whole.cause}"
    over = Shortfall(f"beyond {most} set-ups", left, 0.0, "")
    return replace(whole, cause=cause, diagnosis=(over, *whole.diagnosis))
