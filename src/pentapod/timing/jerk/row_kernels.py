"""Linear rows of the jerk-limited subproblem: those that can bind, gathered with their bounds; compiled.

Where the legs' directions hardly change, most rows of a gridpoint are multiples of one of them, smaller than it. Rows
that cannot bind while the largest row holds are left out: a third to a half remain.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.kernels import kernel

LEAST_SHARE = 1e-9
"""x is held above this share of x_k."""


class Rows(NamedTuple):
    """Rows ±p·v + lean x ≤ bound: p (M, 3), lean (M,), bound (M, 2); those of gridpoint i from start[i] (N + 1,) on."""

    p: Floats
    lean: Floats
    bound: Floats
    start: Ints


@kernel
def binding_rows(
    a0: Floats, a1: Floats, c: Floats, varies: int, jerks: Floats, top: Floats, index: Ints, start: Ints
) -> int:
    """Fill index (N (R + K + 1),) with the numbers of the rows that can bind, start (N + 1,); return their number.

    Arguments as for `minimise_duration`. A row is α times the one with the largest last coefficient, plus a rest that
    is bounded by the largest x and |x′|.
    """
    count, rows = a0.shape
    more, m = jerks.shape[1], 0
    for i in range(count):
        start[i] = m
        x, slope, at = top[i], np.inf, i * varies
        most, sharpest = 0, 0
        for j in range(rows):
            slope = min(slope, (1.0 + abs(c[at, j]) + abs(a0[i, j]) * x) / abs(a1[i, j]))
            most = j if abs(a1[i, j]) > abs(a1[i, most]) else most
        for j in range(rows):
            share = a1[i, j] / a1[i, most]
            use = abs(share) * (1.0 + abs(c[at, most])) + abs(a0[i, j] - share * a0[i, most]) * x + abs(c[at, j])
            if j == most or not use <= 1.0:
                index[m] = j
                m += 1
        for j in range(more):
            sharpest = j if abs(jerks[i, j, 2]) > abs(jerks[i, sharpest, 2]) else sharpest
        for j in range(more):
            share = jerks[i, j, 2] / jerks[i, sharpest, 2]
            rest = abs(jerks[i, j, 1] - share * jerks[i, sharpest, 1]) * slope
            rest += abs(jerks[i, j, 0] - share * jerks[i, sharpest, 0]) * x
            if j == sharpest or not abs(share) + np.sqrt(x) * rest <= 1.0:
                index[m] = rows + j
                m += 1
        index[m] = rows + more
        m += 1
    start[count] = m
    return m


@kernel
def gathered(
    a0: Floats, a1: Floats, c: Floats, varies: int, jerks: Floats, x_k: Floats, top: Floats, index: Ints, start: Ints
) -> Rows:
    """Return the rows that `index` (M,) and `start` (N + 1,) name; other arguments as for `minimise_duration`."""
    count, rows = a0.shape
    more, size = jerks.shape[1], len(index)
    p, lean, bound = np.zeros((size, 3)), np.zeros(size), np.empty((size, 2))
    for i in range(count):
        root = np.sqrt(x_k[i])
        for m in range(start[i], start[i + 1]):
            j = index[m]
            if j < rows:
                p[m, 0], p[m, 1] = a0[i, j], a1[i, j]
                bound[m, 0], bound[m, 1] = 1.0 + c[i * varies, j], 1.0 - c[i * varies, j]
            elif j < rows + more:
                for d in range(3):
                    p[m, d] = root * jerks[i, j - rows, d]
                lean[m] = 0.5 / x_k[i]
                bound[m, 0], bound[m, 1] = 1.5, 1.5
            else:
                p[m, 0] = 1.0 / top[i]
                bound[m, 0], bound[m, 1] = 1.0, -LEAST_SHARE * x_k[i] / top[i]
    return Rows(p, lean, bound, start)
