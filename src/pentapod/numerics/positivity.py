"""Positivity of Bernstein polynomials on [0, 1] by subdivision: proven with a bound, refuted, or undecided and where.

Lemma 6 of docs/proofs.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.values import Value
from pentapod.numerics.bernstein import split

DOUBT_HALVINGS = 6
"""Halvings to which the undecided part of an interval is located: to 1/64."""


@dataclass(frozen=True, eq=False)
class Positivity(Value):
    """Positivity of N polynomials on [0, 1].

    low (N,): a proven positive lower bound, 0 where positivity is not proven. refuted (N,): proven to be
    negative somewhere. doubt (N, 2): the part of [0, 1] outside which positivity is proven; where it is proven
    throughout, NaN; where it is refuted, a part with a value below zero in it.
    What is neither proven nor refuted is undecided.
    """

    low: Floats
    refuted: Bools
    doubt: Floats


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Parts of [0, 1] under examination: their polynomial's index, coefficients, start and width."""

    owner: np.ndarray
    coefficients: Floats
    start: Floats
    width: float

    def __getitem__(self, chosen: np.ndarray) -> _Pieces:
        return _Pieces(self.owner[chosen], self.coefficients[chosen], self.start[chosen], self.width)

    def halved(self) -> _Pieces:
        starts = np.concatenate([self.start, self.start + 0.5 * self.width])
        halves = np.concatenate(split(self.coefficients))
        return _Pieces(np.concatenate([self.owner, self.owner]), halves, starts, 0.5 * self.width)


def positivity(
    coefficients: Floats, error: Floats, error_per_split: Floats, depth: int, rounding: Floats | None = None
) -> Positivity:
    """Decide whether polynomials (N, n + 1) are positive on [0, 1].

    coefficients: computed Bernstein coefficients. error (N,): how far each may be from that of any polynomial
    which the answer is to cover. error_per_split (N,): what one halving adds to that. rounding (N,): the part
    of the error that the polynomial itself has, where the answer covers more than one; `error` by default.
    depth: how often an interval may be halved.

    A polynomial is between its least and its largest coefficient on an interval, and its end coefficients are
    its values there: a piece is done when all its coefficients exceed the error; the polynomial is refuted
    by an end value below minus the rounding. A piece with no coefficient beyond the error cannot be decided: its
    polynomial stays undecided, and the doubtful part is found to 1/64. One that keeps touching zero to within
    the error would be halved without end: it is undecided once more than 2n + 8 of its pieces are open. So is
    one with non-finite coefficients.

    Raises nothing.
    """
    count, most = len(coefficients), 2 * coefficients.shape[-1] + 6
    rounding = error if rounding is None else rounding
    low = coefficients.min(axis=-1) - error
    doubt = np.full((count, 2), np.nan)
    refuted = np.zeros(count, dtype=np.bool_)
    todo = np.flatnonzero(~(low > 0.0) | ~np.isfinite(low))
    pieces = _Pieces(todo, coefficients[todo], np.zeros(len(todo)), 1.0)
    low[todo] = np.inf  # from here on the least over the pieces that are done
    lost = np.zeros(count, dtype=np.bool_)
    for level in range(depth + 1):
        if not pieces.owner.size:
            break
        if level:
            pieces = pieces.halved()
        owner, slack = pieces.owner, level * error_per_split[pieces.owner]
        least = pieces.coefficients.min(axis=-1) - (error[owner] + slack)
        done = (least > 0.0) & np.isfinite(least)
        np.minimum.at(low, owner[done], least[done])
        ends = np.minimum(pieces.coefficients[:, 0], pieces.coefficients[:, -1])
        bad = ends < -(rounding[owner] + slack)
        refuted[owner[bad]] = True
        _include(doubt, pieces[bad])
        undecidable = ~done & ~((pieces.coefficients.max(axis=-1) > error[owner] + slack) & np.isfinite(least))
        lost[owner[undecidable]] = True
        _include(doubt, pieces[undecidable & ~refuted[owner]])
        pieces = pieces[~(done | undecidable | refuted[owner])]
        still_open = np.bincount(pieces.owner, minlength=count)[pieces.owner]
        given_up = (still_open > most) | (lost[pieces.owner] & (level >= DOUBT_HALVINGS))
        _include(doubt, pieces[given_up])
        pieces = pieces[~given_up]
    _include(doubt, pieces)
    return Positivity(np.where(np.isnan(doubt[:, 0]), low, 0.0), refuted, doubt)


def _include(doubt: Floats, pieces: _Pieces) -> None:
    """Widen the doubtful parts (N, 2) to hold the pieces."""
    np.fmin.at(doubt[:, 0], pieces.owner, pieces.start)
    np.fmax.at(doubt[:, 1], pieces.owner, pieces.start + pieces.width)
