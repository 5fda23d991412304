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
from pentapod.timing.jerk.row_kernels import Rows, gathered
from pentapod.timing.jerk.spline_kernels import (
    BEND_BEND,
    add_gradient,
    add_hessian,
    factor_banded,
    solve_banded,
    spline_values,
)

LARGEST_RESIDUAL = 1e-7
"""Residual of a row below which the method may stop."""


class Iterate(NamedTuple):
    """Slacks s and multipliers z (M, 2); off: residuals of the rows, then Δs; rest: of complementarity, then Δz."""

    s: Floats
    z: Floats
    off: Floats
    rest: Floats


@kernel
def _start(rows: Rows, v: Floats, level: float, index: Ints, multipliers: Floats) -> Iterate:
    """Return slacks and multipliers to start from: those given (N, P, 2), where they are above the level."""
    p, lean, bound, start = rows
    s, z, off, rest = np.empty_like(bound), np.empty_like(bound), np.empty_like(bound), np.empty_like(bound)
    for i in range(len(v)):
        for m in range(start[i], start[i + 1]):
            q = p[m, 0] * v[i, 0] + p[m, 1] * v[i, 1] + p[m, 2] * v[i, 2]
            e = lean[m] * v[i, 0]
            s[m, 0] = max(bound[m, 0] - q - e, level)
            s[m, 1] = max(bound[m, 1] + q - e, level)
            for side in range(2):
                z[m, side] = max(multipliers[i, index[m], side], level * 0.1 / s[m, side])
    return Iterate(s, z, off, rest)


@kernel
def _assemble(
    basis: Floats,
    first: Ints,
    rows: Rows,
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
    p, lean, bound, start = rows
    s, z, off, _ = iterate
    band[:], right[:], down[:] = 0.0, 0.0, 0.0
    g, g2, h = np.empty(3), np.empty(3), np.empty(6)
    total, largest, objective = 0.0, 0.0, 0.0
    for i in range(len(first)):
        v0, v1, v2 = v[i, 0], v[i, 1], v[i, 2]
        x = max(v0, 1e-6 * x_k[i])
        power = weight[i] / (x * np.sqrt(x))
        objective += power * x
        g[0], g[1], g[2] = -0.5 * power, 0.0, 0.0
        g2[:], h[:] = 0.0, 0.0
        h[0] = 0.75 * power / x
        for m in range(start[i], start[i + 1]):
            p0, p1, p2, e = p[m, 0], p[m, 1], p[m, 2], lean[m]
            q, s0, s1, z0, z1 = p0 * v0 + p1 * v1 + p2 * v2, s[m, 0], s[m, 1], z[m, 0], z[m, 1]
            off0, off1 = q + e * v0 + s0 - bound[m, 0], e * v0 - q + s1 - bound[m, 1]
            off[m, 0], off[m, 1] = off0, off1
            largest = max(largest, abs(off0), abs(off1))
            total += s0 * z0 + s1 * z1
            w0, w1 = z0 / s0, z1 / s1
            t0, t1 = w0 * off0 - z0, w1 * off1 - z1
            up, low = e + p0, e - p0
            g[0] += z0 * up + z1 * low
            g[1] += (z0 - z1) * p1
            g[2] += (z0 - z1) * p2
            g2[0] += t0 * up + t1 * low
            g2[1] += (t0 - t1) * p1
            g2[2] += (t0 - t1) * p2
            both, across = w0 + w1, w0 * up - w1 * low
            h[0] += w0 * up * up + w1 * low * low
            h[1] += across * p1
            h[2] += across * p2
            h[3] += both * p1 * p1
            h[4] += both * p1 * p2
            h[BEND_BEND] += both * p2 * p2
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
def _predict(rows: Rows, dv: Floats, iterate: Iterate) -> tuple[float, float]:
    """Fill Δs Δz of the step to the boundary; return Σ s z now and after that step."""
    p, lean, _, start = rows
    s, z, off, product = iterate
    primal, dual = 1.0, 1.0
    sz, szd, sdz, dd = 0.0, 0.0, 0.0, 0.0
    for i in range(len(dv)):
        for m in range(start[i], start[i + 1]):
            q = p[m, 0] * dv[i, 0] + p[m, 1] * dv[i, 1] + p[m, 2] * dv[i, 2]
            e = lean[m] * dv[i, 0]
            for side in range(2):
                si, zi = s[m, side], z[m, side]
                d = -off[m, side] - q - e
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
                product[m, side] = d * f
                q = -q
    return sz, max(sz + primal * szd + dual * sdz + primal * dual * dd, 0.0)


@kernel
def _correct(basis: Floats, first: Ints, rows: Rows, iterate: Iterate, aim: float, down: Floats) -> None:
    """Fill the corrector's `down`, and the complementarity residual s z − aim + Δs Δz."""
    p, lean, _, start = rows
    s, z, off, product = iterate
    down[:] = 0.0
    g = np.empty(3)
    for i in range(len(first)):
        g[:] = 0.0
        for m in range(start[i], start[i + 1]):
            sign = 1.0
            for side in range(2):
                si, zi = s[m, side], z[m, side]
                rest = si * zi - aim + product[m, side]
                product[m, side] = rest
                t = (zi * off[m, side] - rest) / si
                g[0] += t * (sign * p[m, 0] + lean[m])
                g[1] += t * sign * p[m, 1]
                g[2] += t * sign * p[m, 2]
                sign = -1.0
        add_gradient(basis, i, g, first[i], down)


@kernel
def _step(rows: Rows, dv: Floats, iterate: Iterate) -> tuple[float, float]:
    """Turn the residuals into Δs and Δz; return how far each may go."""
    p, lean, _, start = rows
    s, z, off, rest = iterate
    primal, dual = 1e300, 1e300
    for i in range(len(dv)):
        for m in range(start[i], start[i + 1]):
            q = p[m, 0] * dv[i, 0] + p[m, 1] * dv[i, 1] + p[m, 2] * dv[i, 2]
            e = lean[m] * dv[i, 0]
            for side in range(2):
                si, zi = s[m, side], z[m, side]
                d = -off[m, side] - q - e
                f = (-rest[m, side] - zi * d) / si
                if d < 0.0 and -si > primal * d:
                    primal = -si / d
                if f < 0.0 and -zi > dual * f:
                    dual = -zi / f
                off[m, side], rest[m, side] = d, f
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
    index: Ints,
    start: Ints,
    x_k: Floats,
    top: Floats,
    weight: Floats,
    fixed: Ints,
    level: float,
    iterations: int,
    tolerance: float,
    y: Floats,
    multipliers: Floats,
) -> tuple[bool, float, float]:
    """Improve the coefficients y (n,) in their place; those marked 1 in `fixed` (n,) stay.

    a0, a1 (N, R): A₀ and A₁; c (N, R), or (1, R) where `varies` is 0; jerks (N, K, 3): J₀, J₁, J₂; index, start: the
    rows that can bind; x_k, top, weight (N,). level: where slacks and multipliers start; multipliers (N, R + K + 1, 2):
    those of a solve before, where they are above it; those of this one replace them. Returns whether the method
    converged, the duality gap over the objective, and the largest residual of a row.
    """
    count, n = len(first), len(y)
    v, dv, band = np.empty((count, 3)), np.empty((count, 3)), np.empty((n, 4))
    right, down, step = np.empty(n), np.empty(n), np.empty(n)
    rows = gathered(a0, a1, c, varies, jerks, x_k, top, index, start)
    spline_values(basis, first, y, v)
    iterate = _start(rows, v, level, index, multipliers)
    s, z, off, rest = iterate
    gap, residual, converged = np.inf, np.inf, False
    for _ in range(iterations):
        total, objective, residual = _assemble(basis, first, rows, weight, x_k, v, iterate, band, right, down)
        gap = total / objective
        converged = bool(gap < tolerance and residual < LARGEST_RESIDUAL)
        if converged or not np.isfinite(gap):
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
        for m in range(len(s)):
            for side in range(2):
                s[m, side] += primal * off[m, side]
                z[m, side] += dual * rest[m, side]
        y += primal * step
        spline_values(basis, first, y, v)
    for i in range(count):
        for m in range(start[i], start[i + 1]):
            multipliers[i, index[m], 0], multipliers[i, index[m], 1] = z[m, 0], z[m, 1]
    return converged, gap, residual
