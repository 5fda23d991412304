"""passing_gap: how far two legs are from each other, signed by the side on which they pass."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def passing_gap(
    offset: Sequence[Any],
    d1: Sequence[Any],
    d2: Sequence[Any],
    side: float,
    sqrt: Any,
    least: Any,
    most: Any,
    where: Any,
) -> Any:
    """Return the distance of segments α d1 and offset + β d2, α, β in [0, 1]; offset in the base plane.

    It is negative where one has passed through the other: where the nearest points lie inside both and
    the second runs on the other side of the first than `side`, the sign of offset · (d1 × d2), says.
    The quadratic in (α, β) is minimised on the unit square by clamping α, then β, then α again.
    """
    ox, oy = offset
    a = d1[0] * d1[0] + d1[1] * d1[1] + d1[2] * d1[2]
    e = d2[0] * d2[0] + d2[1] * d2[1] + d2[2] * d2[2]
    b = d1[0] * d2[0] + d1[1] * d2[1] + d1[2] * d2[2]
    c, f = -(d1[0] * ox + d1[1] * oy), -(d2[0] * ox + d2[1] * oy)
    area = a * e - b * b + 1e-12 * a * e  # parallel legs: any α will do, the later clamps repair it

    def clamp(x: Any) -> Any:
        return least(most(x, 0.0), 1.0)

    alpha = clamp((b * f - c * e) / area)
    beta = clamp((b * alpha + f) / e)
    alpha = clamp((b * beta - c) / a)
    gx = alpha * d1[0] - beta * d2[0] - ox
    gy = alpha * d1[1] - beta * d2[1] - oy
    gz = alpha * d1[2] - beta * d2[2]
    gap = sqrt(gx * gx + gy * gy + gz * gz + 1e-18)  # the last term keeps the derivative finite at contact
    triple = ox * (d1[1] * d2[2] - d1[2] * d2[1]) + oy * (d1[2] * d2[0] - d1[0] * d2[2])
    inside = alpha * (1.0 - alpha) * beta * (1.0 - beta)
    return where(side * triple * inside < 0.0, -gap, gap)
