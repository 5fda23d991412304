"""One convex pass below a jerk limit, compiled: a banded interior point method, and the spline's basis.

x(s) = ṡ² is a cubic B-spline with coefficients y. At each gridpoint all that the rows ask is v = (x, x′, x″), three
numbers of four coefficients; so a gridpoint's rows are summed into a 3×3 matrix before they meet the basis. Rows:
|A₁ x′ + A₀ x − c| ≤ 1 (accelerations), r |J₂ x″ + J₁ x′ + J₀ x| + x / (2 x_k) ≤ 3/2 with r = √x_k (jerks, 1/√x
replaced by its tangent at x_k, which lies below it), x ≤ top and x ≥ 0. Objective: the duration Σ w / √x itself.
Mehrotra's predictor and corrector, from a start that need not be feasible.
"""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.compiled import kernel

_FLOOR = 1e-9
"""x is held above this share of its top."""


@kernel
def cubic_basis(knots: Floats, s: Floats, basis: Floats, first: Ints) -> None:
    """Fill the four cubic B-splines that are not zero at sorted s (N,), and two derivatives: basis (N, 3, 4).

    knots (K + 6,): ends given four times. first (N,): index of the first of the four coefficients.
    """
    m, last = 3, len(knots) - 5
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
def _factor(band: Floats, n: int) -> None:
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
def _solve(band: Floats, n: int, right: Floats) -> None:
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


@kernel
def _values(basis: Floats, first: Ints, y: Floats, v: Floats) -> None:
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
def row_vectors(a0: Floats, a1: Floats, jerks: Floats, around: Floats, top: Floats, i: int, p: Floats) -> None:
    """Fill the vectors p (R + K + 1, 3) of gridpoint i: of accelerations, jerks, and x over its top."""
    rows, more = a0.shape[1], jerks.shape[1]
    for j in range(rows):
        p[j, 0], p[j, 1], p[j, 2] = a0[i, j], a1[i, j], 0.0
    root = np.sqrt(around[i])
    for j in range(more):
        for d in range(3):
            p[rows + j, d] = root * jerks[i, j, d]
    p[rows + more, 0], p[rows + more, 1], p[rows + more, 2] = 1.0 / top[i], 0.0, 0.0


@kernel
def _spread(basis: Floats, i: int, g: Floats, b: int, right: Floats) -> None:
    for k in range(4):
        right[b + k] += basis[i, 0, k] * g[0] + basis[i, 1, k] * g[1] + basis[i, 2, k] * g[2]


@kernel
def convex_pass(
    basis: Floats,
    first: Ints,
    a0: Floats,
    a1: Floats,
    c: Floats,
    moves: int,
    jerks: Floats,
    around: Floats,
    top: Floats,
    weight: Floats,
    fixed: Ints,
    warm: float,
    most: int,
    tolerance: float,
    y: Floats,
) -> tuple[int, float, float]:
    """Improve the coefficients y (n,) in their place; those in `fixed` (1 or 0) stay.

    a0, a1 (N, R); c (N, R) or (1, R); jerks (N, K, 3): J₀, J₁, J₂; around, top, weight (N,). warm: slacks and
    multipliers start on that level. Returns the iterations, −1 − their number where it did not converge, the gap over
    the objective, and the largest breach of a row.
    """
    count, n = len(first), len(y)
    rows, more = a0.shape[1], jerks.shape[1]
    pairs = rows + more + 1
    s, z = np.empty((count, pairs, 2)), np.empty((count, pairs, 2))
    ds, dz, off = np.empty((count, pairs, 2)), np.empty((count, pairs, 2)), np.empty((count, pairs, 2))
    v, dv = np.empty((count, 3)), np.empty((count, 3))
    band, right, down, step = np.empty((n, 4)), np.empty(n), np.empty(n), np.empty(n)
    p = np.zeros((count, pairs, 3))
    bound = np.empty((count, pairs, 2))
    lean = np.zeros((count, pairs))
    g, g2, hess = np.empty(3), np.empty(3), np.empty(6)
    _values(basis, first, y, v)
    for i in range(count):
        row_vectors(a0, a1, jerks, around, top, i, p[i])
        for j in range(pairs):
            if j < rows:
                bound[i, j, 0], bound[i, j, 1] = 1.0 + c[i * moves, j], 1.0 - c[i * moves, j]
            elif j < rows + more:
                bound[i, j, 0] = bound[i, j, 1] = 1.5
                lean[i, j] = 0.5 / around[i]
            else:
                bound[i, j, 0], bound[i, j, 1] = 1.0, -_FLOOR
            q = p[i, j, 0] * v[i, 0] + p[i, j, 1] * v[i, 1] + p[i, j, 2] * v[i, 2]
            e = lean[i, j] * v[i, 0]
            s[i, j, 0] = max(bound[i, j, 0] - q - e, warm)
            s[i, j, 1] = max(bound[i, j, 1] + q - e, warm)
            z[i, j, 0], z[i, j, 1] = warm * 0.1 / s[i, j, 0], warm * 0.1 / s[i, j, 1]
    gap, breach, objective = 1.0, 1.0, 1.0
    for attempt in range(most):
        band[:], right[:], down[:] = 0.0, 0.0, 0.0
        mu, breach, objective = 0.0, 0.0, 0.0
        for i in range(count):
            g[:], g2[:], hess[:] = 0.0, 0.0, 0.0
            x = max(v[i, 0], 1e-6 * top[i])
            power = weight[i] / (x * np.sqrt(x))
            objective += power * x
            g[0] = -0.5 * power
            hess[0] = 0.75 * power / x
            for j in range(pairs):
                q = p[i, j, 0] * v[i, 0] + p[i, j, 1] * v[i, 1] + p[i, j, 2] * v[i, 2]
                e = lean[i, j] * v[i, 0]
                for side in range(2):
                    sign = 1.0 - 2.0 * side
                    p0, p1, p2 = sign * p[i, j, 0] + lean[i, j], sign * p[i, j, 1], sign * p[i, j, 2]
                    si, zi = s[i, j, side], z[i, j, side]
                    rp = sign * q + e + si - bound[i, j, side]
                    off[i, j, side] = rp
                    breach = max(breach, abs(rp))
                    mu += si * zi
                    w = zi / si
                    g[0], g[1], g[2] = g[0] + zi * p0, g[1] + zi * p1, g[2] + zi * p2
                    t = w * rp - zi
                    g2[0], g2[1], g2[2] = g2[0] + t * p0, g2[1] + t * p1, g2[2] + t * p2
                    hess[0] += w * p0 * p0
                    hess[1] += w * p0 * p1
                    hess[2] += w * p0 * p2
                    hess[3] += w * p1 * p1
                    hess[4] += w * p1 * p2
                    hess[5] += w * p2 * p2
            b = first[i]
            _spread(basis, i, g, b, right)
            _spread(basis, i, g2, b, down)
            for k in range(4):
                u0, u1, u2 = basis[i, 0, k], basis[i, 1, k], basis[i, 2, k]
                h0 = hess[0] * u0 + hess[1] * u1 + hess[2] * u2
                h1 = hess[1] * u0 + hess[3] * u1 + hess[4] * u2
                h2 = hess[2] * u0 + hess[4] * u1 + hess[5] * u2
                for m in range(k + 1):
                    band[b + k, k - m] += basis[i, 0, m] * h0 + basis[i, 1, m] * h1 + basis[i, 2, m] * h2
        gap = mu / objective
        mu /= 2.0 * count * pairs
        if gap < tolerance and breach < 1e-7:
            return attempt, gap, breach
        for k in range(n):
            if fixed[k]:
                for m in range(4):
                    band[k, m] = 0.0
                    if k + m < n:
                        band[k + m, m] = 0.0
                band[k, 0] = 1.0
            else:
                band[k, 0] *= 1.0 + 1e-12
        _factor(band, n)
        for k in range(n):
            step[k] = 0.0 if fixed[k] else -right[k] - down[k]
        _solve(band, n, step)
        _values(basis, first, step, dv)
        primal, dual = 1.0, 1.0
        sz, szd, sdz, dd = 0.0, 0.0, 0.0, 0.0
        for i in range(count):
            for j in range(pairs):
                q = p[i, j, 0] * dv[i, 0] + p[i, j, 1] * dv[i, 1] + p[i, j, 2] * dv[i, 2]
                e = lean[i, j] * dv[i, 0]
                for side in range(2):
                    si, zi = s[i, j, side], z[i, j, side]
                    d = -off[i, j, side] - (1.0 - 2.0 * side) * q - e
                    f = -zi - zi * d / si
                    if d < 0.0:
                        primal = min(primal, -si / d)
                    if f < 0.0:
                        dual = min(dual, -zi / f)
                    sz += si * zi
                    szd += zi * d
                    sdz += si * f
                    dd += d * f
                    ds[i, j, side] = d * f
        after = max(sz + primal * szd + dual * sdz + primal * dual * dd, 0.0)
        aim = mu * (after / sz) ** 3
        down[:] = 0.0
        for i in range(count):
            g2[:] = 0.0
            for j in range(pairs):
                for side in range(2):
                    sign = 1.0 - 2.0 * side
                    si, zi = s[i, j, side], z[i, j, side]
                    t = (zi * off[i, j, side] - (si * zi - aim + ds[i, j, side])) / si
                    g2[0] += t * (sign * p[i, j, 0] + lean[i, j])
                    g2[1] += t * sign * p[i, j, 1]
                    g2[2] += t * sign * p[i, j, 2]
            _spread(basis, i, g2, first[i], down)
        for k in range(n):
            step[k] = 0.0 if fixed[k] else -right[k] - down[k]
        _solve(band, n, step)
        _values(basis, first, step, dv)
        primal, dual = 1e300, 1e300
        for i in range(count):
            for j in range(pairs):
                q = p[i, j, 0] * dv[i, 0] + p[i, j, 1] * dv[i, 1] + p[i, j, 2] * dv[i, 2]
                e = lean[i, j] * dv[i, 0]
                for side in range(2):
                    si, zi = s[i, j, side], z[i, j, side]
                    d = -off[i, j, side] - (1.0 - 2.0 * side) * q - e
                    f = (-(si * zi - aim + ds[i, j, side]) - zi * d) / si
                    if d < 0.0:
                        primal = min(primal, -si / d)
                    if f < 0.0:
                        dual = min(dual, -zi / f)
                    ds[i, j, side], dz[i, j, side] = d, f
        primal, dual = min(1.0, 0.99 * primal), min(1.0, 0.99 * dual)
        for i in range(count):
            for j in range(pairs):
                for side in range(2):
                    s[i, j, side] += primal * ds[i, j, side]
                    z[i, j, side] += dual * dz[i, j, side]
        for k in range(n):
            y[k] += primal * step[k]
        _values(basis, first, y, v)
        if not np.isfinite(y[0]):
            break
    return -1 - most, gap, breach
