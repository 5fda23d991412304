"""The closed form near the singularities, where it loses digits: the same formulas with twice as many.

At w = 0 and at S = 0 the pose depends on the legs like a square root at zero. In ordinary doubles the radicands
w² and S² carry rounding errors which the legs themselves do not warrant; at the surface they come out negative as
often as not. Here they are exact for the legs as given, and a radicand that is negative, but would not be if
each leg were longer or shorter by `LEG_ULPS` units in its last place, counts as touching the surface. Such a pose is
put on its own side of it, by no more than rounding, so that the named component never flips.
"""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Floats
from pentapod.geometry.double_double import DoubleDouble
from pentapod.kinematics.quadratic import LinearPart, Reduced

LEG_ULPS = 4.0
"""How far leg lengths may be from those of a pose, in units of 2⁻⁵³ of each, to count as its own: what computing
and rounding them costs."""

_SLACK = LEG_ULPS * 2.0**-53
_LEAST_W = 2.0**-52


def solve_near(legs: Floats, linear: LinearPart, delta: float, sign_w: Floats, sign_s: Floats, reach: float) -> Reduced:
    """Return `quadratic.solve` of legs (5, N) and signs (N,), to within the accuracy that the legs allow.

    reach: |x_3| + |z_3| in metres, the size of the shift from the reduced frame, whose rounding must not
    change the sign of S. NaN where no pose has these lengths. The caller silences NumPy.
    """
    squared = DoubleDouble(legs, np.zeros_like(legs)) * legs
    q, py, u, v = linear.twofold(squared)
    l3_squared = DoubleDouble(squared.high[2], squared.low[2])
    weights = 2.0 * np.square(legs)  # d(l²) = 2 l² · (relative change of l)

    d1 = 1.0 - u * u - v * v
    gradient = np.einsum("fl,fn->ln", linear.linear_map[2:], 2.0 * np.stack([u.high, v.high]))
    d1, w = _touching(d1, _SLACK * (weights * np.abs(gradient)).sum(axis=0))
    w = np.maximum(w, _LEAST_W)

    n1 = 1.0 - u * delta
    n_squared = n1 * n1 + d1 * delta * delta
    c = q + v * py * delta
    r_squared = l3_squared - py * py
    d = r_squared * n_squared - c * c
    partial = np.stack(
        [
            -2.0 * c.high,
            -2.0 * (py.high * n_squared.high + c.high * delta * v.high),
            -2.0 * delta * r_squared.high,
            -2.0 * delta * (delta * v.high * r_squared.high + c.high * py.high),
        ]
    )
    gradient = np.einsum("fl,fn->ln", linear.linear_map, partial)
    gradient[2] += n_squared.high
    _, root = _touching(d, _SLACK * (weights * np.abs(gradient)).sum(axis=0))
    root = np.maximum(root, 2.0**-49 * (1.0 + abs(delta)) * (legs[2] + reach))

    w, root = sign_w * w, sign_s * root
    n2, along = -delta * w, DoubleDouble(root, np.zeros_like(root))
    px, pz = (c * n1 - along * n2).high / n_squared.high, (c * n2 + along * n1).high / n_squared.high
    nothing = np.where(legs.min(axis=0) >= 0.0, 0.0 * (w + root), np.nan)  # NaN where one of these is, too
    return Reduced(px, py.high + nothing, pz, u.high + nothing, v.high + nothing, w + nothing)


def _touching(radicand: DoubleDouble, slack: Floats) -> tuple[DoubleDouble, Floats]:
    """Return the radicand and its root (N,): 0 where it is negative by at most `slack`, NaN where by more."""
    value = np.where((radicand.high < 0.0) & (radicand.high >= -slack), 0.0, radicand.high)
    return DoubleDouble(value, np.where(value == radicand.high, radicand.low, 0.0)), np.sqrt(value)
