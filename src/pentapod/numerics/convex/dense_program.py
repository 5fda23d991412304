"""A small convex program: smallest xᵀHx/2 + gᵀx with A x ≤ b, by a primal-dual interior-point method.

Mehrotra's predictor and corrector (SIAM J. Optim. 2, 1992), dense: made for some fifty unknowns and thousands of
inequalities, of which most do not bind.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from pentapod.base.arrays import Floats

_ITERATIONS = 60
_GOOD = 1e-9
"""Mean product of slack and multiplier, and residuals, at which the answer is good: numbers are of the size of 1."""
_TO_BOUNDARY, _SHORTEST = 0.995, 1e-9


def dense_program(hessian: Floats, gradient: Floats, matrix: Floats, upper: Floats) -> tuple[Floats, Floats] | None:
    """Return x (n,) and the multipliers (m,) of hessian (n, n), gradient (n,), matrix (m, n) and upper (m,).

    None where the method does not end: for want of an interior, say.
    """
    from pentapod.numerics.convex.interior_kernels import longest_step  # noqa: PLC0415  kernels are loaded where used

    x, z = np.zeros(len(gradient)), np.full(len(upper), 1e-2)
    s = np.maximum(upper, 1e-2)
    for _ in range(_ITERATIONS):
        dual, off, gap = hessian @ x + gradient + matrix.T @ z, matrix @ x + s - upper, s * z
        if max(1e3 * gap.mean(), np.abs(dual).max(), np.abs(off).max()) < 1e3 * _GOOD:
            return x, z
        try:
            factor = cho_factor(hessian + (matrix.T * (z / s)) @ matrix, check_finite=False)
        except LinAlgError:
            return None
        _, ds, dz = _newton(factor, matrix, s, z, dual, off, -gap)
        ahead = float((s + longest_step(s, ds) * ds) @ (z + longest_step(z, dz) * dz))
        centring = (ahead / gap.sum()) ** 3 * gap.mean()
        dx, ds, dz = _newton(factor, matrix, s, z, dual, off, centring - gap - ds * dz)
        length = min(1.0, _TO_BOUNDARY * min(longest_step(s, ds), longest_step(z, dz)))
        if length < _SHORTEST:
            return None
        x, s, z = x + length * dx, s + length * ds, z + length * dz
    return None


def _newton(
    factor: Any, matrix: Floats, s: Floats, z: Floats, dual: Floats, off: Floats, change: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the step of x, slacks s and multipliers z that changes their products by `change`."""
    right = -dual - matrix.T @ ((change + z * off) / s)
    dx = np.asarray(cho_solve(factor, right, check_finite=False), dtype=np.float64)
    ds = -off - matrix @ dx
    return dx, ds, (change - z * ds) / s
