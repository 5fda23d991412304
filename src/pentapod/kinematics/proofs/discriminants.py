"""w² and S² of the quadratic family as polynomials in time, for legs that are polynomials in time.

Kinematics notes, section 7. Everything is kept in scaled Bernstein form (see `geometry.bernstein`), where products are
convolutions; what comes out is in plain Bernstein form.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.forward.quadratic import LinearPart
from pentapod.numerics.bernstein import binomials, convolve, scaled, unscaled
from pentapod.numerics.kernels import kernels_pay

_SAVED_BY_KERNELS = 400e-9  # seconds an interval


@dataclass(frozen=True, eq=False)
class Discriminants:
    """Of N intervals with legs of degree k. Computed values: `certificate` bounds their rounding errors.

    w_squared (N, 4k + 1) and s_squared (N, 8k + 1), metres²: Bernstein coefficients of w² = 1 − u² − v² and
    S² = R²|n|² − c². largest (5, N): the largest |coefficient| of each leg, metres. tops (6, N): that of py, u, v,
    R², |n|², c; only where asked for.
    """

    linear: LinearPart
    delta: float
    degree: int
    w_squared: Floats
    s_squared: Floats
    largest: Floats
    tops: Floats

    @classmethod
    def of(cls, pentapod: LinearPentapod, legs: Floats, *, tops: bool) -> Discriminants:
        """Return them for Bernstein coefficients of the legs (N, 5, k + 1), metres."""
        linear, delta, k = pentapod.linear_part, pentapod.delta, legs.shape[-1] - 1
        if kernels_pay(_SAVED_BY_KERNELS * len(legs)):
            from pentapod.kinematics.proofs.discriminants_kernels import discriminants  # noqa: PLC0415

            count = len(legs)
            d1, d, largest, maxima = (np.empty((n, count)) for n in (4 * k + 1, 8 * k + 1, 5, 6))
            units = (binomials(k), binomials(2 * k), binomials(4 * k), binomials(8 * k))
            discriminants(legs, linear.linear_map, linear.constant, delta, units, tops, d1, d, largest, maxima)
            return cls(linear, delta, k, d1.T, d.T, largest, maxima)
        w_squared, s_squared, forms = _discriminants(linear, delta, legs)
        maxima = np.stack([np.abs(unscaled(f)).max(axis=-1) for f in forms]) if tops else np.empty((6, 0))
        largest = np.abs(legs).max(axis=-1).T
        return cls(linear, delta, k, unscaled(w_squared), unscaled(s_squared), largest, maxima)


def _discriminants(linear: LinearPart, delta: float, legs: Floats) -> tuple[Floats, Floats, tuple[Floats, ...]]:
    """Return w² and S² and py, u, v, R², |n|², c, all (N, n + 1) in scaled form."""
    coefficients = scaled(np.swapaxes(legs, 0, 1))
    squared = np.moveaxis(convolve(coefficients, coefficients), -1, 1)  # (5, 2k + 1, N)
    k = legs.shape[-1] - 1
    one, unit = binomials(4 * k), binomials(2 * k)
    q, py, u, v = (form.T for form in linear(squared, unit[:, None]))
    l3 = squared[2].T

    d1 = one - convolve(u, u)
    v_squared = convolve(v, v)
    d1 -= v_squared
    r_squared = convolve(l3, unit) - convolve(py, py)
    n_squared = convolve(unit - (2.0 * delta) * u, unit)
    n_squared += (delta * delta) * (one - v_squared)
    c = convolve(q, unit) + delta * convolve(v, py)
    d = convolve(r_squared, n_squared) - convolve(c, c)
    return d1, d, (py, u, v, r_squared, n_squared, c)
