"""Sparse rows of a banded program times vectors and times themselves, compiled.

Hard rows: slopes (R, 2) times the lean at waypoint point[r], which is weights[w] (4,) of the coefficients from first[w]
on. Soft rows: windows (S, B) times B of the unknowns, from starts[s] on; an unknown is one number of a coefficient.
What of a window reaches beyond the last unknown is zero.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.kernels import kernel

Rows = tuple[Floats, Ints, Ints, Floats, Floats, Ints]
"""weights (W, 4), first (W,), point (R,) ascending, slopes (R, 2), windows (S, B), starts (S,)."""


@kernel
def row_values(rows: Rows, c: Floats, hard: Floats, soft: Floats) -> None:
    """Fill the left sides of hard and soft rows, (R,) and (S,), of coefficients c (K, 2)."""
    weights, first, point, slopes, windows, starts = rows
    for r in range(len(point)):
        w, u, v = point[r], 0.0, 0.0
        for k in range(4):
            u += weights[w, k] * c[first[w] + k, 0]
            v += weights[w, k] * c[first[w] + k, 1]
        hard[r] = slopes[r, 0] * u + slopes[r, 1] * v
    x = c.ravel()
    for s in range(len(starts)):
        total = 0.0
        for k in range(min(windows.shape[1], len(x) - starts[s])):
            total += windows[s, k] * x[starts[s] + k]
        soft[s] = total


@kernel
def add_rows(rows: Rows, hard: Floats, soft: Floats, x: Floats) -> None:
    """Add to x (2K,) the sum of all rows, each times its number: hard (R,) and soft (S,)."""
    weights, first, point, slopes, windows, starts = rows
    r = 0
    while r < len(point):
        w, u, v = point[r], 0.0, 0.0
        while r < len(point) and point[r] == w:
            u += hard[r] * slopes[r, 0]
            v += hard[r] * slopes[r, 1]
            r += 1
        for k in range(4):
            x[2 * (first[w] + k)] += weights[w, k] * u
            x[2 * (first[w] + k) + 1] += weights[w, k] * v
    for s in range(len(starts)):
        for k in range(min(windows.shape[1], len(x) - starts[s])):
            x[starts[s] + k] += soft[s] * windows[s, k]


@kernel
def add_products(rows: Rows, hard: Floats, soft: Floats, lower: Floats) -> None:
    """Add to a symmetric matrix, lower (B, 2K), the products of all rows with themselves, each times its number."""
    weights, first, point, slopes, windows, starts = rows
    size = lower.shape[1]
    block = np.zeros((2, 2))
    r = 0
    while r < len(point):
        w = point[r]
        block[:] = 0.0
        while r < len(point) and point[r] == w:
            for a in range(2):
                for b in range(2):
                    block[a, b] += hard[r] * slopes[r, a] * slopes[r, b]
            r += 1
        for k in range(8):
            for j in range(k + 1):
                product = weights[w, k // 2] * weights[w, j // 2] * block[k % 2, j % 2]
                lower[k - j, 2 * first[w] + j] += product
    for s in range(len(starts)):
        reach = min(windows.shape[1], size - starts[s])
        for j in range(reach):
            weighed = soft[s] * windows[s, j]
            for k in range(j, reach):
                lower[k - j, starts[s] + j] += weighed * windows[s, k]


@kernel
def longest_step(values: Floats, change: Floats) -> float:
    """Return the largest step in [0, 1] that keeps values ≥ 0."""
    step = 1.0
    for k in range(len(values)):
        if change[k] * step < -values[k]:
            step = -values[k] / change[k]
    return step
