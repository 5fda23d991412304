"""The determinant of the wrenches that hold a platform, zero on its singularities, by one formula (`Arithmetic`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Any

from pentapod.kinematics.arithmetic import Arithmetic, Vector, dot

GRADIENT_STEP = 1e-4
"""Metres, of the differences that stand for the determinant's gradient."""

Wrench = tuple[Vector | None, Vector]
"""Force and moment; None for a force that is zero."""


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def leg_wrenches(p: Vector, vectors: Sequence[Vector], base: Sequence[Vector], do: Arithmetic) -> list[Wrench]:
    """Return the wrenches of unit forces in legs along vectors from their base joints, moments about p."""
    found: list[Wrench] = []
    for d, joint in zip(vectors, base, strict=True):
        size = do.sqrt(dot(d, d))
        unit = [d[k] / size for k in range(3)]
        found.append((unit, cross([joint[k] - p[k] for k in range(3)], unit)))
    return found


def wrench_determinant(wrenches: Sequence[Wrench]) -> Any:
    """Return the determinant of six wrenches, by Laplace's expansion along the forces."""
    total: Any = 0.0
    for chosen in combinations(range(6), 3):
        rest = [k for k in range(6) if k not in chosen]
        a, b, c = (wrenches[k][0] for k in chosen)
        if a is None or b is None or c is None:
            continue
        x, y, z = (wrenches[k][1] for k in rest)
        sign = -1.0 if sum(chosen) % 2 == 0 else 1.0
        total = total + sign * dot(a, cross(b, c)) * dot(x, cross(y, z))
    return total


def zero_distance(determinant: Callable[[Vector], Any], p: Vector, do: Arithmetic) -> Any:
    """Return a function of the position by the length of its gradient: to first order the signed way to its zero, m."""
    value, slopes = determinant(p), list[Any]()
    for k in range(3):
        moved = [p[j] + (GRADIENT_STEP if j == k else 0.0) for j in range(3)]
        slopes.append((determinant(moved) - value) / GRADIENT_STEP)
    return value / do.sqrt(dot(slopes, slopes) + 1e-30)
