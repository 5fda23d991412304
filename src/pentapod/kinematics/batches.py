"""Broadcasting of batched arguments, and the errors where their shapes do not fit."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch
from pentapod.base.errors import ArrayError


def as_poses(position: ArrayLike, direction: ArrayLike) -> tuple[Floats, Floats]:
    """Return positions and directions (..., 3), each as it came. Raises ArrayError for shapes that do not fit."""
    p, i = as_batch(position, "position", (3,)), as_batch(direction, "direction", (3,))
    common_batch(p, i, ("position", "direction"))
    return p, i


def joined_poses(position: ArrayLike, direction: ArrayLike) -> tuple[Floats, Floats]:
    """Return positions and directions (..., 3) of one batch. Raises ArrayError."""
    return broadcast(*as_poses(position, direction), ("position", "direction"))


def as_motion(leg_coefficients: Floats, least: int = 0) -> Floats:
    """Return Bernstein coefficients (N, 5, k + 1), k ≥ least, of five legs on N intervals. Raises ArrayError."""
    shape = leg_coefficients.shape
    if len(shape) != 3 or shape[1] != 5 or shape[2] < least + 1:
        raise ArrayError(f"leg_coefficients has shape {shape}", expected=f"shape (N, 5, k + 1), k ≥ {least}")
    return leg_coefficients


def broadcast(a: Floats, b: Floats, names: tuple[str, str]) -> tuple[Floats, Floats]:
    """Return both with the same leading axes; their last axes may differ. Raises ArrayError that names both shapes."""
    batch = common_batch(a, b, names)
    return np.broadcast_to(a, batch + a.shape[-1:]), np.broadcast_to(b, batch + b.shape[-1:])


def common_batch(a: Floats, b: Floats, names: tuple[str, str], tail: int = 1) -> tuple[int, ...]:
    """Return the shape of all but the last axis of a, and the last `tail` of b. Raises ArrayError."""
    try:
        return np.broadcast_shapes(a.shape[:-1], b.shape[: b.ndim - tail])
    except ValueError as error:
        raise ArrayError(
            f"{names[0]} has shape {a.shape}, {names[1]} {b.shape}",
            expected="leading axes that broadcast: one for each, or the same for all",
        ) from error
