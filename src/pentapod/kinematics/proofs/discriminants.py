"""w² and S² of the quadratic family as polynomials in time, for legs that are polynomials in time.

Kinematics notes, section 7. The kernel works in scaled Bernstein form (see `numerics.bernstein`), where products are
convolutions; what comes out is in plain Bernstein form.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.forward.quadratic import LinearPart
from pentapod.kinematics.tubes.leg_equations import QuadraticLegs
from pentapod.numerics.bernstein import binomials


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
    def of(cls, pentapod: QuadraticLegs, legs: Floats, *, tops: bool) -> Discriminants:
        """Return them for Bernstein coefficients of the legs (N, 5, k + 1), metres."""
        from pentapod.kinematics.proofs.discriminants_kernels import discriminants  # noqa: PLC0415

        linear, delta, k, count = pentapod.linear_part, pentapod.delta, legs.shape[-1] - 1, len(legs)
        d1, d, largest, maxima = (np.empty((n, count)) for n in (4 * k + 1, 8 * k + 1, 5, 6))
        units = (binomials(k), binomials(2 * k), binomials(4 * k), binomials(8 * k))
        discriminants(legs, linear.linear_map, linear.constant, delta, units, tops, d1, d, largest, maxima)
        return cls(linear, delta, k, d1.T, d.T, largest, maxima)
