"""Forces in the legs."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.arrays import Floats, as_batch
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.jacobian import invert, line_tangents


def leg_force_map(pentapod: FiveLegs, position: ArrayLike, direction: ArrayLike, tool_length: float) -> Floats:
    """Return the map (..., 5, 3) from a force on the tip to the five axial leg forces that hold it (N/N).

    The force acts on the tip p + tool_length · i (metres), machine frame, without a moment; a positive leg
    force pushes its platform joint away from the base. Static, weightless, frictionless. Infinite on a
    singularity, NaN for a pose that is NaN. position and direction (..., 3).
    """
    i = as_batch(direction, "direction", (3,))
    vectors = pentapod.leg_vectors(position, i)
    unit = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    # Moments about the tip: there the lever of leg i along the line is z_i − h, and the load has none.
    # The line's own axis carries no moment, so two tangents suffice. Virtual work: Jᵀ f = −load.
    levers = pentapod.offsets[:, None] - tool_length
    inverse = invert(np.concatenate([unit, levers * (unit @ line_tangents(i))], axis=-1), np.inf)
    forces = -np.swapaxes(inverse[..., :3, :], -1, -2)
    return np.where(np.any(np.isnan(vectors), axis=(-1, -2), keepdims=True), np.nan, forces)


def tip_force_amplification(
    pentapod: FiveLegs, position: ArrayLike, direction: ArrayLike, tool_length: float
) -> Floats:
    """Return the largest norm (...) of the five leg forces that a tip force of 1 N in any direction calls up.

    It is the spectral norm of `leg_force_map`; see there. Infinite on a singularity.
    """
    forces = leg_force_map(pentapod, position, direction, tool_length)
    finite = np.all(np.isfinite(forces), axis=(-1, -2))
    safe = np.where(finite[..., None, None], forces, 0.0)
    largest = np.sqrt(np.linalg.eigvalsh(np.swapaxes(safe, -1, -2) @ safe)[..., -1])
    return np.where(finite, largest, np.where(np.any(np.isnan(forces), axis=(-1, -2)), np.nan, np.inf))
