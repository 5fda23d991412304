"""Poses along a tool curve and their derivatives, compiled.

Polynomials are in powers of the distance from the left knot of their interval, the highest power first.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel


@kernel
def _interval(knots: Floats, at: float, near: int) -> int:
    """Return the interval between knots in which a number lies, at a knot the one after it; near: where to begin."""
    last = len(knots) - 2
    if knots[near] <= at and (at < knots[near + 1] or near == last):
        return near
    if near < last and knots[near + 1] <= at and (at < knots[near + 2] or near + 1 == last):
        return near + 1
    return min(max(int(np.searchsorted(knots, at, "right")) - 1, 0), last)


@kernel
def _dot(a: Floats, i: int, b: Floats, j: int) -> float:
    """Return the scalar product of row i of a and row j of b."""
    return a[i, 0] * b[j, 0] + a[i, 1] * b[j, 1] + a[i, 2] * b[j, 2]


@kernel
def _tool(curve: Floats, part: int, h: float, tilt_centre: float, order: int, tip: Floats, axis: Floats) -> None:
    """Fill tip and unit axis (4, 3), and derivatives up to `order` ≤ 3, by the curve's own parameter.

    curve (k, 5, 6): coefficients of the tilt centre and of a vector r along the axis; h: from the start of the part.
    From axis · n = r and n² = r · r, differentiated as often as needed.
    """
    for c in range(3):
        for rows, column in ((tip, c), (axis, 3 + c)):
            v0, v1, v2, v3 = curve[part, 0, column], 0.0, 0.0, 0.0
            for m in range(1, curve.shape[1]):
                if order >= 2:
                    v3 = v3 * h + v2
                    v2 = v2 * h + v1
                v1 = v1 * h + v0
                v0 = v0 * h + curve[part, m, column]
            rows[0, c], rows[1, c], rows[2, c], rows[3, c] = v0, v1, 2.0 * v2, 6.0 * v3
    n = np.sqrt(_dot(axis, 0, axis, 0))
    inverse, n1, n2, n3 = 1.0 / n, 0.0, 0.0, 0.0
    if order >= 1:
        n1 = _dot(axis, 0, axis, 1) * inverse
    if order >= 2:
        n2 = (_dot(axis, 1, axis, 1) + _dot(axis, 0, axis, 2) - n1 * n1) * inverse
    if order >= 3:
        n3 = (3.0 * _dot(axis, 1, axis, 2) + _dot(axis, 0, axis, 3) - 3.0 * n1 * n2) * inverse
    for c in range(3):
        a0 = axis[0, c] * inverse
        a1 = (axis[1, c] - n1 * a0) * inverse
        a2 = (axis[2, c] - 2.0 * n1 * a1 - n2 * a0) * inverse
        a3 = (axis[3, c] - 3.0 * n1 * a2 - 3.0 * n2 * a1 - n3 * a0) * inverse
        axis[0, c], axis[1, c], axis[2, c], axis[3, c] = a0, a1, a2, a3
        tip[0, c] -= tilt_centre * a0
        tip[1, c] -= tilt_centre * a1
        tip[2, c] -= tilt_centre * a2
        tip[3, c] -= tilt_centre * a3


@kernel
def poses_along(
    stations: Floats,
    ends: Floats,
    parameter: Floats,
    knots: Floats,
    curve: Floats,
    tilt_centre: float,
    tips: Floats,
    axes: Floats,
) -> None:
    """Fill tips and axes (K, n, 3) with derivatives of the orders below K ≤ 4 by the station s, at stations (n,).

    parameter (m, 8): of the curve, over s between `ends` (m + 1,); curve (k, 5, 6): between knots (k + 1,).
    """
    order, near, part = len(tips) - 1, 0, 0
    tip, axis = np.zeros((4, 3)), np.zeros((4, 3))
    for i in range(len(stations)):
        s = min(max(stations[i], 0.0), ends[-1])
        near = _interval(ends, s, near)
        h, u0, u1, u2, u3 = s - ends[near], parameter[near, 0], 0.0, 0.0, 0.0
        for m in range(1, 8):
            if order >= 2:
                u3 = u3 * h + u2
                u2 = u2 * h + u1
            u1 = u1 * h + u0
            u0 = u0 * h + parameter[near, m]
        u2, u3 = 2.0 * u2, 6.0 * u3
        at = min(max(u0, knots[0]), knots[-1])
        part = _interval(knots, at, part)
        _tool(curve, part, at - knots[part], tilt_centre, order, tip, axis)
        for pose, derivatives in ((tips, tip), (axes, axis)):
            for c in range(3):
                pose[0, i, c] = derivatives[0, c]
                if order >= 1:
                    pose[1, i, c] = derivatives[1, c] * u1
                if order >= 2:
                    pose[2, i, c] = derivatives[2, c] * u1 * u1 + derivatives[1, c] * u2
                if order >= 3:
                    third = derivatives[3, c] * (u1 * u1 * u1) + 3.0 * derivatives[2, c] * u1 * u2
                    pose[3, i, c] = third + derivatives[1, c] * u3


@kernel
def speeds_along(at: Floats, knots: Floats, curve: Floats, tilt_centre: float, lever: float, speeds: Floats) -> None:
    """Fill speeds (K, n) with ds/du and its derivatives of the orders below K ≤ 3, at the curve's parameters (n,).

    ds² = |d tip|² + lever² |d axis|².
    """
    order, part = len(speeds) - 1, 0
    tip, axis, square = np.zeros((4, 3)), np.zeros((4, 3)), lever * lever
    for i in range(len(at)):
        u = min(max(at[i], knots[0]), knots[-1])
        part = _interval(knots, u, part)
        _tool(curve, part, u - knots[part], tilt_centre, order + 1, tip, axis)
        v = np.sqrt(_dot(tip, 1, tip, 1) + square * _dot(axis, 1, axis, 1))
        speeds[0, i] = v
        if order >= 1:
            speeds[1, i] = (_dot(tip, 1, tip, 2) + square * _dot(axis, 1, axis, 2)) / v
        if order >= 2:
            bend = _dot(tip, 2, tip, 2) + square * _dot(axis, 2, axis, 2)
            bend += _dot(tip, 1, tip, 3) + square * _dot(axis, 1, axis, 3)
            speeds[2, i] = (bend - speeds[1, i] ** 2) / v
