"""Proven bounds of distances and angles between curves in Bernstein form, for all times at once."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.ball_bernstein import elevate, hull, multiply, restricted, stack
from pentapod.numerics.balls import ROUND_UP, Ball

_PARTS = 8


def distance_bound(a: Ball, b: Ball, error: Floats) -> Floats:
    """Return upper bounds (M,) of |a(t) − b(t)| on [0, 1] where a may be off by error (3, M) in each coordinate.

    a (n + 1, 3, M), b (m + 1, 3, M). A curve's distance from 0 is at most that of its farthest control point; on
    eighths of the interval this is close.
    """
    n, m = len(a.mid) - 1, len(b.mid) - 1
    apart = elevate(a, max(m - n, 0)) - elevate(b, max(n - m, 0))
    return (_longest(apart) + _norm(error)) * ROUND_UP


def angle_bound(a: Ball, b: Ball, error: Floats) -> Floats:
    """Return upper bounds (M,) in radians of the angle between a(t), of length 1 once corrected by error, and b(t).

    As `distance_bound`. The sine of the angle is |a × b| / |b|. π where less than a right angle is not proven.
    """
    off = _norm(error)
    along = hull(b)
    ahead = along.mid / np.linalg.norm(along.mid, axis=0)
    shortest = _dot(b, Ball.exact(np.broadcast_to(ahead, (1, *ahead.shape)))).lower.min(axis=0)
    shortest = shortest / (np.linalg.norm(ahead, axis=0) * (1.0 + 2.0**-50))
    longest = _longest(b)
    sine = (_longest(_cross(a, b)) + off * longest * ROUND_UP) * ROUND_UP / shortest * ROUND_UP
    acute = (_dot(a, b).lower.min(axis=0) - off * longest * ROUND_UP > 0.0) & (shortest > 0.0) & (sine < 1.0)
    return np.where(acute, np.arcsin(np.where(acute, sine, 0.0)) * (1.0 + 2.0**-40), np.pi)


def _longest(a: Ball) -> Floats:
    """Return upper bounds (M,) of |a(t)| on [0, 1]."""
    if not a.mid.shape[-1]:
        return np.zeros(0)
    worst = np.zeros(a.mid.shape[-1])
    for part in range(_PARTS):
        piece = restricted(a, np.full(1, part / _PARTS), np.full(1, 1.0 / _PARTS))
        worst = np.maximum(worst, _norm(piece.magnitude.swapaxes(0, 1)).max(axis=0))
    return worst


def _norm(vectors: Floats) -> Floats:
    """Return norms (...) of vectors (3, ...), rounded up."""
    return np.sqrt((vectors**2).sum(axis=0)) * ROUND_UP


def _dot(a: Ball, b: Ball) -> Ball:
    return multiply(a[:, 0], b[:, 0]) + multiply(a[:, 1], b[:, 1]) + multiply(a[:, 2], b[:, 2])


def _cross(a: Ball, b: Ball) -> Ball:
    """Return a × b (n + m + 1, 3, M)."""
    parts = [multiply(a[:, j], b[:, k]) - multiply(a[:, k], b[:, j]) for j, k in ((1, 2), (2, 0), (0, 1))]
    whole = stack(parts)
    return Ball(whole.mid.swapaxes(0, 1), whole.rad.swapaxes(0, 1))
