"""One Newton step on the leg lengths themselves: takes the error of a closed form down to that of the lengths."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.jacobian import line_tangents

_ROUNDING = 4.0 * float(np.finfo(np.float64).eps)  # of the largest squared length


def polish(pentapod: FiveLegs, position: Floats, direction: Floats, legs: Floats) -> tuple[Floats, Floats]:
    """Return poses (N, 3) that have the lengths legs (N, 5) better than those given; NaN where those are.

    A step is kept only where it does not make the largest error of the squared lengths worse, rounding forgiven, and
    leaves the sign of the Jacobian's determinant as it was: it never changes the assembly mode.
    """
    vectors, tangents = pentapod.leg_vectors(position, direction), line_tangents(direction)
    error, matrix = _errors(vectors, legs), _matrix(pentapod, vectors, tangents)
    with np.errstate(over="ignore", invalid="ignore"):
        determinant = np.linalg.det(matrix)
        regular = np.isfinite(determinant) & (np.abs(determinant) > 0.0)
    safe = np.where(regular[:, None, None], matrix, np.eye(5))
    step = np.linalg.solve(safe, -0.5 * error[..., None])[..., 0]
    p = position + step[:, :3]
    i = direction + (tangents @ step[:, 3:, None])[..., 0]
    with np.errstate(over="ignore", invalid="ignore"):
        i = i / np.linalg.norm(i, axis=-1, keepdims=True)
        vectors = pentapod.leg_vectors(p, i)
        rounding = _ROUNDING * np.square(legs).max(axis=-1)
        better = np.abs(_errors(vectors, legs)).max(axis=-1) <= np.maximum(np.abs(error).max(axis=-1), rounding)
        same_mode = np.linalg.det(_matrix(pentapod, vectors, line_tangents(i))) * determinant > 0.0
    keep = (regular & better & same_mode)[:, None]
    return np.where(keep, p, position), np.where(keep, i, direction)


def _errors(vectors: Floats, legs: Floats) -> Floats:
    """Return |b_i − a_i|² − l_i² (N, 5)."""
    return np.square(vectors).sum(axis=-1) - np.square(legs)


def _matrix(pentapod: FiveLegs, vectors: Floats, tangents: Floats) -> Floats:
    """Return half the derivative (N, 5, 5) of the squared lengths along (p, tangents)."""
    return np.concatenate([vectors, pentapod.offsets[:, None] * (vectors @ tangents)], axis=-1)
