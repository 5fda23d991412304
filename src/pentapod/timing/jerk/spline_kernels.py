"""Cubic splines and the banded matrices of their coefficients, compiled."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.kernels import kernel

BEND_BEND = 6 - 1
"""Index of x″x″, the last, in a packed Hessian."""


@kernel
def cubic_basis(knots: Floats, s: Floats, basis: Floats, first: Ints) -> None:
    """Fill the four cubic B-splines that are not zero at sorted s (N,), and two derivatives: basis (N, 3, 4).

    knots (K + 6,): ends given four times. first (N,): index of the first of the four coefficients.
    """
    m, last = 3, len(knots) - 4 - 1
    one, two, slope = np.zeros(2), np.zeros(3), np.zeros(3)
    for i in range(len(s)):
        x = s[i]
        while m < last and knots[m + 1] <= x:
            m += 1
        first[i] = m - 3
        h = knots[m + 1] - knots[m]
        one[0], one[1] = (knots[m + 1] - x) / h, (x - knots[m]) / h
        p, q = knots[m + 1] - knots[m - 1], knots[m + 2] - knots[m]
        two[0] = (knots[m + 1] - x) / p * one[0]
        two[1] = (x - knots[m - 1]) / p * one[0] + (knots[m + 2] - x) / q * one[1]
        two[2] = (x - knots[m]) / q * one[1]
        slope[0] = -2.0 * one[0] / p
        slope[1] = 2.0 * (one[0] / p - one[1] / q)
        slope[2] = 2.0 * one[1] / q
        for k in range(4):
            value, rate, bend = 0.0, 0.0, 0.0
            j = m - 3 + k
            if k > 0:
                d = knots[j + 3] - knots[j]
                value += (x - knots[j]) / d * two[k - 1]
                rate += 3.0 * two[k - 1] / d
                bend += 3.0 * slope[k - 1] / d
            if k < 3:
                d = knots[j + 4] - knots[j + 1]
                value += (knots[j + 4] - x) / d * two[k]
                rate -= 3.0 * two[k] / d
                bend -= 3.0 * slope[k] / d
            basis[i, 0, k], basis[i, 1, k], basis[i, 2, k] = value, rate, bend


@kernel
def spline_values(basis: Floats, first: Ints, y: Floats, v: Floats) -> None:
    """Fill v (N, 3): x, x′, x″ of the coefficients y."""
    for i in range(len(first)):
        b = first[i]
        for d in range(3):
            v[i, d] = (
                basis[i, d, 0] * y[b]
                + basis[i, d, 1] * y[b + 1]
                + basis[i, d, 2] * y[b + 2]
                + basis[i, d, 3] * y[b + 3]
            )


@kernel
def add_gradient(basis: Floats, i: int, g: Floats, b: int, right: Floats) -> None:
    """Add gridpoint i's gradient g (3,), by x, x′ and x″, to that by the coefficients."""
    for k in range(4):
        right[b + k] += basis[i, 0, k] * g[0] + basis[i, 1, k] * g[1] + basis[i, 2, k] * g[2]


@kernel
def add_hessian(basis: Floats, i: int, h: Floats, b: int, band: Floats) -> None:
    """Add gridpoint i's Hessian h (6,): xx, xx′, xx″, x′x′, x′x″, x″x″."""
    for k in range(4):
        u0, u1, u2 = basis[i, 0, k], basis[i, 1, k], basis[i, 2, k]
        h0 = h[0] * u0 + h[1] * u1 + h[2] * u2
        h1 = h[1] * u0 + h[3] * u1 + h[4] * u2
        h2 = h[2] * u0 + h[4] * u1 + h[BEND_BEND] * u2
        for m in range(k + 1):
            band[b + k, k - m] += basis[i, 0, m] * h0 + basis[i, 1, m] * h1 + basis[i, 2, m] * h2


@kernel
def factor_banded(band: Floats, n: int) -> None:
    """Cholesky's factor of a symmetric matrix, band[i, k] = A[i, i − k], in its place."""
    for i in range(n):
        for k in range(min(3, i), -1, -1):
            j = i - k
            value = band[i, k]
            for m in range(1, 4 - k):
                if j - m >= 0:
                    value -= band[i, k + m] * band[j, m]
            if k == 0:
                band[i, 0] = np.sqrt(max(value, 1e-300))
            else:
                band[i, k] = value / band[j, 0]


@kernel
def solve_banded(band: Floats, n: int, right: Floats) -> None:
    """Solve with that factor, in the place of `right`."""
    for i in range(n):
        value = right[i]
        for k in range(1, min(3, i) + 1):
            value -= band[i, k] * right[i - k]
        right[i] = value / band[i, 0]
    for i in range(n - 1, -1, -1):
        value = right[i]
        for k in range(1, min(3, n - 1 - i) + 1):
            value -= band[i + k, k] * right[i + k]
        right[i] = value / band[i, 0]
