"""Signed distance of two segments, by one formula for numbers and symbols alike."""

from __future__ import annotations

from typing import Any

from pentapod.kinematics.arithmetic import Arithmetic, Vector, dot


def signed_leg_clearance(offset: Vector, d1: Vector, d2: Vector, side: float, xp: Arithmetic) -> Any:
    """Return the distance of segments α d1 and offset + β d2, α, β in [0, 1].

    offset: of three components, or two where it lies in the base plane. side: the sign of offset · (d1 × d2) where the
    segments have not passed through each other. The distance is negative where they have: where the nearest points lie
    inside both and that sign is the other one. The quadratic in (α, β) is minimised on the unit square by clamping α,
    then β, then α again.
    """
    a = d1[0] * d1[0] + d1[1] * d1[1] + d1[2] * d1[2]
    e = d2[0] * d2[0] + d2[1] * d2[1] + d2[2] * d2[2]
    b = d1[0] * d2[0] + d1[1] * d2[1] + d1[2] * d2[2]
    c, f = -_along(offset, d1), -_along(offset, d2)
    area = a * e - b * b + 1e-12 * a * e  # parallel legs: any α will do, the later clamps repair it

    def clamp(x: Any) -> Any:
        return xp.least(xp.most(x, 0.0), 1.0)

    alpha = clamp((b * f - c * e) / area)
    beta = clamp((b * alpha + f) / e)
    alpha = clamp((b * beta - c) / a)
    g = [alpha * d1[k] - beta * d2[k] for k in range(3)]
    for k, o in enumerate(offset):
        g[k] = g[k] - o
    gap = xp.sqrt(dot(g, g) + 1e-18)  # the last term keeps the derivative finite at contact
    triple = _along(offset, [d1[k - 2] * d2[k - 1] - d1[k - 1] * d2[k - 2] for k in range(len(offset))])
    inside = alpha * (1.0 - alpha) * beta * (1.0 - beta)
    return xp.where(side * triple * inside < 0.0, -gap, gap)


def _along(offset: Vector, d: Vector) -> Any:
    """Return the scalar product of an offset of two or three components with a vector."""
    planar = offset[0] * d[0] + offset[1] * d[1]
    return planar if len(offset) == 2 else planar + offset[2] * d[2]
