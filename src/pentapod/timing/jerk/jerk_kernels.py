"""Banded interior-point method for one convex subproblem of the jerk limits, compiled.

x(s) = ṡ² is a cubic B-spline with coefficients y. At each gridpoint the rows depend on v = (x, x′, x″) alone; they are
summed into a 3×3 matrix before they meet the basis. Rows: |A₁ x′ + A₀ x − c| ≤ 1 (accelerations),
r |J₂ x″ + J₁ x′ + J₀ x| + x / (2 x_k) ≤ 3/2 with r = √x_k (jerks, 1/√x replaced by its tangent at x_k, which lies below
it), x ≤ top and x ≥ 0. Objective: the duration Σ w / √x. Mehrotra's predictor and corrector, from any start.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.kernels import kernel
from pentapod.timing.jerk.spline_kernels import (
    BEND_BEND,
    add_gradient,
    add_hessian,
    factor_banded,
    solve_banded,
    spline_values,
)

LEAST_SHARE = 1e-9
"""x is held above this share of x_k."""

LARGEST_RESIDUAL = 1e-7
"""Residual of a row below which the method may stop."""


class JerkRows(NamedTuple):
    """Rows ±p·v + lean x ≤ bound: p (N, P, 3), lean (N, P), bound (N, P, 2)."""

    p: Floats
    lean: Floats
    bound: Floats


class Iterate(NamedTuple):
    """Slacks s and multipliers z (N, P, 2); off: residuals of the rows, then Δs; rest: of complementarity, then Δz."""

    s: Floats
    z: Floats
    off: Floats
    rest: Floats


@kernel
def _rows(a0: Floats, a1: Floats, c: Floats, varies: int, jerks: Floats, x_k: Floats, top: Floats) -> JerkRows:
    """Return all rows; arguments as for `minimise_duration`."""
    count, rows = a0.shape
    more = jerks.shape[1]
    pairs = rows + more + 1
    p, lean, bound = np.empty((count, pairs, 3)), np.empty((count, pairs)), np.empty((count, pairs, 2))
    for i in range(count):
        for j in range(rows):
            p[i, j, 0], p[i, j, 1], p[i, j, 2], lean[i, j] = a0[i, j], a1[i, j], 0.0, 0.0
            bound[i, j, 0], bound[i, j, 1] = 1.0 + c[i * varies, j], 1.0 - c[i * varies, j]
        root = np.sqrt(x_k[i])
        for j in range(rows, rows + more):
            for d in range(3):
                p[i, j, d] = root * jerks[i, j - rows, d]
            lean[i, j] = 0.5 / x_k[i]
            bound[i, j, 0], bound[i, j, 1] = 1.5, 1.5
        j = rows + more
        p[i, j, 0], p[i, j, 1], p[i, j, 2], lean[i, j] = 1.0 / top[i], 0.0, 0.0, 0.0
        bound[i, j, 0], bound[i, j, 1] = 1.0, -LEAST_SHARE * x_k[i] / top[i]
    return JerkRows(p, lean, bound)


@kernel
def _start(rows: JerkRows, v: Floats, level: float) -> Iterate:
    """Return slacks and multipliers to start from, on a level, and room for the rest."""
    p, lean, bound = rows
    s, z, off, rest = np.empty_like(bound), np.empty_like(bound), np.empty_like(bound), np.empty_like(bound)
    for i in range(len(v)):
        for j in range(p.shape[1]):
            q = p[i, j, 0] * v[i, 0] + p[i, j, 1] * v[i, 1] + p[i, j, 2] * v[i, 2]
            e = lean[i, j] * v[i, 0]
            s[i, j, 0] = max(bound[i, j, 0] - q - e, level)
            s[i, j, 1] = max(bound[i, j, 1] + q - e, level)
            z[i, j, 0], z[i, j, 1] = level * 0.1 / s[i, j, 0], level * 0.1 / s[i, j, 1]
    return Iterate(s, z, off, rest)


@kernel
def _assemble(
    basis: Floats,
    first: Ints,
    rows: JerkRows,
    weight: Floats,
    x_k: Floats,
    v: Floats,
    iterate: Iterate,
    band: Floats,
    right: Floats,
    down: Floats,
) -> tuple[float, float, float]:
    """Fill the Newton matrix `band`, the dual residual `right`, the predictor's `down` and the rows' residuals.

    Returns Σ s z, the objective and the largest residual.
    """
    p, lean, bound = rows
    s, z, off, _ = iterate
    band[:], right[:], down[:] = 0.0, 0.0, 0.0
    g, g2, h = np.empty(3), np.empty(3), np.empty(6)
    total, largest, objective = 0.0, 0.0, 0.0
    for i in range(len(first)):
        x = max(v[i, 0], 1e-6 * x_k[i])
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
                largest = max(largest, abs(rp))
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
        add_gradient(basis, i, g, first[i], right)
        add_gradient(basis, i, g2, first[i], down)
        add_hessian(basis, i, h, first[i], band)
    return total, objective, largest


@kernel
def _fix(band: Floats, fixed: Ints) -> None:
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
def _predict(rows: JerkRows, dv: Floats, iterate: Iterate) -> tuple[float, float]:
    """Fill Δs Δz of the step to the boundary; return Σ s z now and after that step."""
    p, lean, _ = rows
    s, z, off, product = iterate
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
def _correct(basis: Floats, first: Ints, rows: JerkRows, iterate: Iterate, aim: float, down: Floats) -> None:
    """Fill the corrector's `down`, and the complementarity residual s z − aim + Δs Δz."""
    p, lean, _ = rows
    s, z, off, product = iterate
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
        add_gradient(basis, i, g, first[i], down)


@kernel
def _step(rows: JerkRows, dv: Floats, iterate: Iterate) -> tuple[float, float]:
    """Turn the residuals into Δs and Δz; return how far each may go."""
    p, lean, _ = rows
    s, z, off, rest = iterate
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
def minimise_duration(
    basis: Floats,
    first: Ints,
    a0: Floats,
    a1: Floats,
    c: Floats,
    varies: int,
    jerks: Floats,
    x_k: Floats,
    top: Floats,
    weight: Floats,
    fixed: Ints,
    level: float,
    iterations: int,
    tolerance: float,
    y: Floats,
) -> tuple[bool, float, float]:
    """Improve the coefficients y (n,) in their place; those marked 1 in `fixed` (n,) stay.

    a0, a1 (N, R): A₀ and A₁; c (N, R), or (1, R) where `varies` is 0; jerks (N, K, 3): J₀, J₁, J₂; x_k, top, weight
    (N,). level: where slacks and multipliers start. Returns whether the method converged, the duality gap over the
    objective, and the largest residual of a row.
    """
    count, n = len(first), len(y)
    v, dv, band = np.empty((count, 3)), np.empty((count, 3)), np.empty((n, 4))
    right, down, step = np.empty(n), np.empty(n), np.empty(n)
    rows = _rows(a0, a1, c, varies, jerks, x_k, top)
    spline_values(basis, first, y, v)
    iterate = _start(rows, v, level)
    s, z, off, rest = iterate
    gap, residual = np.inf, np.inf
    for _ in range(iterations):
        total, objective, residual = _assemble(basis, first, rows, weight, x_k, v, iterate, band, right, down)
        gap = total / objective
        if gap < tolerance and residual < LARGEST_RESIDUAL:
            return True, gap, residual
        if not np.isfinite(gap):
            break
        _fix(band, fixed)
        factor_banded(band, n)
        _newton(band, right, down, fixed, step)
        spline_values(basis, first, step, dv)
        before, after = _predict(rows, dv, iterate)
        aim = total / s.size * (after / before) ** 3
        _correct(basis, first, rows, iterate, aim, down)
        _newton(band, right, down, fixed, step)
        spline_values(basis, first, step, dv)
        primal, dual = _step(rows, dv, iterate)
        for i in range(count):
            for j in range(s.shape[1]):
                for side in range(2):
                    s[i, j, side] += primal * off[i, j, side]
                    z[i, j, side] += dual * rest[i, j, side]
        y += primal * step
        spline_values(basis, first, y, v)
    return False, gap, residual
