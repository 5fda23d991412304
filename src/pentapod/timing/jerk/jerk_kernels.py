"""One convex pass below a jerk limit, compiled: a banded interior point method.

x(s) = ṡ² is a cubic B-spline with coefficients y. At each gridpoint all that the rows ask is v = (x, x′, x″), three
numbers of four coefficients; so a gridpoint's rows are summed into a 3×3 matrix before they meet the basis. Rows:
|A₁ x′ + A₀ x − c| ≤ 1 (accelerations), r |J₂ x″ + J₁ x′ + J₀ x| + x / (2 x_k) ≤ 3/2 with r = √x_k (jerks, 1/√x
replaced by its tangent at x_k, which lies below it), x ≤ top and x ≥ 0. Objective: the duration Σ w / √x itself.
Mehrotra's predictor and corrector, from a start that need not be feasible.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.kernels import kernel
from pentapod.timing.jerk.spline_kernels import (
    BEND_BEND,
    factor_banded,
    solve_banded,
    spline_values,
    spread,
    spread_matrix,
)

_FLOOR = 1e-9
"""x is held above this share of x_k."""
_BREACH = 1e-7


@kernel
def _set_up(
    a0: Floats,
    a1: Floats,
    c: Floats,
    moves: int,
    jerks: Floats,
    around: Floats,
    top: Floats,
    p: Floats,
    lean: Floats,
    bound: Floats,
) -> None:
    """Fill the rows: ±p·v + lean x ≤ bound, p (N, P, 3), lean (N, P), bound (N, P, 2)."""
    count, rows = a0.shape
    more = jerks.shape[1]
    for i in range(count):
        for j in range(rows):
            p[i, j, 0], p[i, j, 1], p[i, j, 2], lean[i, j] = a0[i, j], a1[i, j], 0.0, 0.0
            bound[i, j, 0], bound[i, j, 1] = 1.0 + c[i * moves, j], 1.0 - c[i * moves, j]
        root = np.sqrt(around[i])
        for j in range(rows, rows + more):
            for d in range(3):
                p[i, j, d] = root * jerks[i, j - rows, d]
            lean[i, j] = 0.5 / around[i]
            bound[i, j, 0], bound[i, j, 1] = 1.5, 1.5
        j = rows + more
        p[i, j, 0], p[i, j, 1], p[i, j, 2], lean[i, j] = 1.0 / top[i], 0.0, 0.0, 0.0
        bound[i, j, 0], bound[i, j, 1] = 1.0, -_FLOOR * around[i] / top[i]


@kernel
def _begin(p: Floats, lean: Floats, bound: Floats, v: Floats, warm: float, s: Floats, z: Floats) -> None:
    """Fill slacks s and multipliers z (N, P, 2) to start from."""
    for i in range(len(v)):
        for j in range(p.shape[1]):
            q = p[i, j, 0] * v[i, 0] + p[i, j, 1] * v[i, 1] + p[i, j, 2] * v[i, 2]
            e = lean[i, j] * v[i, 0]
            s[i, j, 0] = max(bound[i, j, 0] - q - e, warm)
            s[i, j, 1] = max(bound[i, j, 1] + q - e, warm)
            z[i, j, 0], z[i, j, 1] = warm * 0.1 / s[i, j, 0], warm * 0.1 / s[i, j, 1]


@kernel
def _assemble(
    basis: Floats,
    first: Ints,
    p: Floats,
    lean: Floats,
    bound: Floats,
    weight: Floats,
    around: Floats,
    v: Floats,
    s: Floats,
    z: Floats,
    off: Floats,
    band: Floats,
    right: Floats,
    down: Floats,
) -> tuple[float, float, float]:
    """Fill the Newton matrix, the dual residual `right`, the predictor's `down` and the rows' residuals `off`.

    Returns Σ s z, the objective and the largest residual.
    """
    band[:], right[:], down[:] = 0.0, 0.0, 0.0
    g, g2, h = np.empty(3), np.empty(3), np.empty(6)
    total, breach, objective = 0.0, 0.0, 0.0
    for i in range(len(first)):
        x = max(v[i, 0], 1e-6 * around[i])
        power = weight[i] / (x * np.sqrt(x))
        objective += power * x
        g[0], g[1], g[2] = -0.5 * power, 0.0, 0.0
        g2[:], h[:] = 0.0, 0.0
        h[0] = 0.75 * power / x
        for j in range(p.shape[1]):
            q = p[i, j, 0] * v[i, 0] + p[i, j, 1] * v[i, 1] + p[i, j, 2] * v[i, 2]
            e = lean[i, j] * v[i, 0]
            sign = 1.0
            for side in range(2):
                p0, p1, p2 = sign * p[i, j, 0] + lean[i, j], sign * p[i, j, 1], sign * p[i, j, 2]
                si, zi = s[i, j, side], z[i, j, side]
                rp = sign * q + e + si - bound[i, j, side]
                off[i, j, side] = rp
                breach = max(breach, abs(rp))
                total += si * zi
                w = zi / si
                t = w * rp - zi
                g[0], g[1], g[2] = g[0] + zi * p0, g[1] + zi * p1, g[2] + zi * p2
                g2[0], g2[1], g2[2] = g2[0] + t * p0, g2[1] + t * p1, g2[2] + t * p2
                w0, w1 = w * p0, w * p1
                h[0] += w0 * p0
                h[1] += w0 * p1
                h[2] += w0 * p2
                h[3] += w1 * p1
                h[4] += w1 * p2
                h[BEND_BEND] += w * p2 * p2
                sign = -1.0
        spread(basis, i, g, first[i], right)
        spread(basis, i, g2, first[i], down)
        spread_matrix(basis, i, h, first[i], band)
    return total, objective, breach


@kernel
def _hold(band: Floats, fixed: Ints) -> None:
    """Take the fixed coefficients out of the matrix, and keep its factor from breaking down by rounding."""
    n = len(fixed)
    for k in range(n):
        if fixed[k]:
            for m in range(4):
                band[k, m] = 0.0
                if k + m < n:
                    band[k + m, m] = 0.0
            band[k, 0] = 1.0
        else:
            band[k, 0] *= 1.0 + 1e-12


@kernel
def _predict(
    p: Floats, lean: Floats, dv: Floats, s: Floats, z: Floats, off: Floats, product: Floats
) -> tuple[float, float]:
    """Fill Δs Δz of the step to the boundary; return Σ s z now and after that step."""
    primal, dual = 1.0, 1.0
    sz, szd, sdz, dd = 0.0, 0.0, 0.0, 0.0
    for i in range(len(dv)):
        for j in range(p.shape[1]):
            q = p[i, j, 0] * dv[i, 0] + p[i, j, 1] * dv[i, 1] + p[i, j, 2] * dv[i, 2]
            e = lean[i, j] * dv[i, 0]
            for side in range(2):
                si, zi = s[i, j, side], z[i, j, side]
                d = -off[i, j, side] - q - e
                ratio = d / si
                f = -zi - zi * ratio
                if ratio * primal < -1.0:
                    primal = -1.0 / ratio
                if f < -zi and dual * (1.0 + ratio) > 1.0:
                    dual = 1.0 / (1.0 + ratio)
                sz += si * zi
                szd += zi * d
                sdz += si * f
                dd += d * f
                product[i, j, side] = d * f
                q = -q
    return sz, max(sz + primal * szd + dual * sdz + primal * dual * dd, 0.0)


@kernel
def _correct(
    basis: Floats,
    first: Ints,
    p: Floats,
    lean: Floats,
    s: Floats,
    z: Floats,
    off: Floats,
    product: Floats,
    aim: float,
    down: Floats,
) -> None:
    """Fill the corrector's `down`; product becomes the complementarity residual s z − aim + Δs Δz."""
    down[:] = 0.0
    g = np.empty(3)
    for i in range(len(first)):
        g[:] = 0.0
        for j in range(p.shape[1]):
            sign = 1.0
            for side in range(2):
                si, zi = s[i, j, side], z[i, j, side]
                rest = si * zi - aim + product[i, j, side]
                product[i, j, side] = rest
                t = (zi * off[i, j, side] - rest) / si
                g[0] += t * (sign * p[i, j, 0] + lean[i, j])
                g[1] += t * sign * p[i, j, 1]
                g[2] += t * sign * p[i, j, 2]
                sign = -1.0
        spread(basis, i, g, first[i], down)


@kernel
def _step(p: Floats, lean: Floats, dv: Floats, s: Floats, z: Floats, off: Floats, rest: Floats) -> tuple[float, float]:
    """Turn `off` into Δs and `rest` into Δz; return how far each may go."""
    primal, dual = 1e300, 1e300
    for i in range(len(dv)):
        for j in range(p.shape[1]):
            q = p[i, j, 0] * dv[i, 0] + p[i, j, 1] * dv[i, 1] + p[i, j, 2] * dv[i, 2]
            e = lean[i, j] * dv[i, 0]
            for side in range(2):
                si, zi = s[i, j, side], z[i, j, side]
                d = -off[i, j, side] - q - e
                f = (-rest[i, j, side] - zi * d) / si
                if d < 0.0 and -si > primal * d:
                    primal = -si / d
                if f < 0.0 and -zi > dual * f:
                    dual = -zi / f
                off[i, j, side], rest[i, j, side] = d, f
                q = -q
    return min(1.0, 0.99 * primal), min(1.0, 0.99 * dual)


@kernel
def _newton(band: Floats, right: Floats, down: Floats, fixed: Ints, step: Floats) -> None:
    """Fill the step of the coefficients from the factored matrix."""
    for k in range(len(fixed)):
        step[k] = 0.0 if fixed[k] else -right[k] - down[k]
    solve_banded(band, len(fixed), step)


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
    """Improve the coefficients y (n,) in their place; those marked 1 in `fixed` (n,) stay.

    a0, a1 (N, R): A₀ and A₁; c (N, R), or (1, R) where `moves` is 0; jerks (N, K, 3): J₀, J₁, J₂; around (N,): x_k;
    top, weight (N,). warm: slacks and multipliers start on that level. Returns the iterations, or −1 where `most` did
    not converge, the gap over the objective, and the largest breach of a row.
    """
    count, n = len(first), len(y)
    pairs = a0.shape[1] + jerks.shape[1] + 1
    p, lean, bound = np.empty((count, pairs, 3)), np.empty((count, pairs)), np.empty((count, pairs, 2))
    s, z = np.empty((count, pairs, 2)), np.empty((count, pairs, 2))
    off, rest = np.empty((count, pairs, 2)), np.empty((count, pairs, 2))
    v, dv, band = np.empty((count, 3)), np.empty((count, 3)), np.empty((n, 4))
    right, down, step = np.empty(n), np.empty(n), np.empty(n)
    _set_up(a0, a1, c, moves, jerks, around, top, p, lean, bound)
    spline_values(basis, first, y, v)
    _begin(p, lean, bound, v, warm, s, z)
    gap, breach = np.inf, np.inf
    for attempt in range(most):
        total, objective, breach = _assemble(
            basis, first, p, lean, bound, weight, around, v, s, z, off, band, right, down
        )
        gap = total / objective
        if gap < tolerance and breach < _BREACH:
            return attempt, gap, breach
        if not np.isfinite(gap):
            break
        _hold(band, fixed)
        factor_banded(band, n)
        _newton(band, right, down, fixed, step)
        spline_values(basis, first, step, dv)
        before, after = _predict(p, lean, dv, s, z, off, rest)
        aim = total / (2.0 * count * pairs) * (after / before) ** 3
        _correct(basis, first, p, lean, s, z, off, rest, aim, down)
        _newton(band, right, down, fixed, step)
        spline_values(basis, first, step, dv)
        primal, dual = _step(p, lean, dv, s, z, off, rest)
        for i in range(count):
            for j in range(pairs):
                for side in range(2):
                    s[i, j, side] += primal * off[i, j, side]
                    z[i, j, side] += dual * rest[i, j, side]
        for k in range(n):
            y[k] += primal * step[k]
        spline_values(basis, first, y, v)
    return -1, gap, breach
