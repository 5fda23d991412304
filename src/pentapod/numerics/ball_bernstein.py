"""Bernstein polynomials on [0, 1] with balls as coefficients: coefficients first, (n + 1, ...).

The laws are those of `numerics.bernstein`; what is read off the results holds in spite of rounding (lemmas 5 and 6 of
docs/proofs.md).
"""

from __future__ import annotations

from math import comb

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ArrayError
from pentapod.numerics.balls import Ball

_LARGEST = 1 << 1020


def multiply(a: Ball, b: Ball) -> Ball:
    """Return the product (n + m + 1, ...) of polynomials (n + 1, ...) and (m + 1, ...); what follows broadcasts.

    Raises ArrayError for a degree n + m above 1020.
    """
    n, m = len(a.mid) - 1, len(b.mid) - 1
    weights = _binomials(n + m, max(a.mid.ndim - 1, b.mid.ndim))
    first, second = _weighted(a), _weighted(b)
    total: Ball | None = None
    for j in range(n + 1):
        term = first[j] * second
        pad = [(j, n - j)] + [(0, 0)] * (term.mid.ndim - 1)
        padded = Ball(np.pad(term.mid, pad), np.pad(term.rad, pad))
        total = padded if total is None else total + padded
    if total is None:
        raise ValueError("a polynomial has at least one coefficient")
    return total / weights


def elevate(a: Ball, by: int) -> Ball:
    """Return the same polynomials (n + 1, ...) written with degree n + by."""
    return multiply(Ball.exact(np.ones((by + 1,) + (1,) * (a.mid.ndim - 1))), a) if by else a


def blossom(a: Ball, at: list[Floats]) -> Ball:
    """Return the blossom (..., N) at n arguments (N,) each, short binary fractions, of coefficients (n + 1, ..., N).

    At n equal arguments it is the value there; see `restricted` for others.
    """
    for t in at:
        a = a[:-1] * (1.0 - t) + a[1:] * t
    return a[0]


def restricted(a: Ball, start: Floats, width: Floats) -> Ball:
    """Return the coefficients (n + 1, ..., N) of the same polynomials on [start, start + width], (N,) each."""
    n = len(a.mid) - 1
    if (start == 0.0).all() and (width == 1.0).all():
        return a
    return stack([blossom(a, [start] * (n - j) + [start + width] * j) for j in range(n + 1)])


def stack(parts: list[Ball]) -> Ball:
    """Return balls stacked along a new first axis."""
    return Ball(np.stack([part.mid for part in parts]), np.stack([part.rad for part in parts]))


def hull(a: Ball) -> Ball:
    """Return the ball (...) that contains all coefficients (n + 1, ...), and with them the polynomial's values."""
    return Ball.between(Ball.exact(a.lower.min(axis=0)), Ball.exact(a.upper.max(axis=0)))


def _weighted(a: Ball) -> Ball:
    return a * _binomials(len(a.mid) - 1, a.mid.ndim)


def _binomials(n: int, axes: int) -> Ball:
    """Return C(n, 0), ..., C(n, n) along the first of so many axes: exact up to 2⁵³, from n = 57 on rounded."""
    exact = [comb(n, j) for j in range(n + 1)]
    if exact[n // 2] > _LARGEST:
        raise ArrayError("polynomials of this degree cannot be multiplied", value=n, expected="1020 or less")
    rounded = [float(c) for c in exact]
    errors = [float(abs(c - int(r))) for c, r in zip(exact, rounded, strict=True)]  # of few digits, so exact
    shape = (-1,) + (1,) * (axes - 1)
    return Ball(np.array(rounded).reshape(shape), np.array(errors).reshape(shape))
