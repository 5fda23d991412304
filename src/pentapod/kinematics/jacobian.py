"""How leg lengths change with the pose, and the pose with the leg lengths."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch, as_floats
from pentapod.geometry.directions import tangent_frame
from pentapod.kinematics.robot import Robot


def square_jacobian(robot: Robot, position: ArrayLike, direction: ArrayLike) -> Floats:
    """Return ∂legs/∂(p, α, β) (..., 5, 5): di = α t1 + β t2, with (t1, t2) = `tangent_frame(direction)`.

    Columns 1-3 m/m, columns 4-5 m/rad. Singular exactly on the singularities.
    """
    by_pose = robot.jacobian(position, direction)
    tangents = line_tangents(as_batch(direction, "direction", (3,)))
    return np.concatenate([by_pose[..., :3], by_pose[..., 3:] @ tangents], axis=-1)


def tip_jacobian(robot: Robot, position: ArrayLike, direction: ArrayLike, tool_length: ArrayLike) -> Floats:
    """Return ∂legs/∂(tip, i) (..., n_legs, 6) at poses (..., 3), the tip at p + tool_length · i. Raises ArrayError."""
    by_pose, length = robot.jacobian(position, direction), as_floats(tool_length, "tool_length")
    return np.concatenate([by_pose[..., :3], by_pose[..., 3:] - length * by_pose[..., :3]], axis=-1)


def pose_jacobian(robot: Robot, position: ArrayLike, direction: ArrayLike) -> Floats:
    """Return ∂(p, i)/∂legs (..., 6, 5) at poses (..., 3): rows m/m, then 1/m. NaN on a singularity."""
    i = as_batch(direction, "direction", (3,))
    inverse = invert(square_jacobian(robot, position, i), np.nan)
    tangents = line_tangents(i)
    return np.concatenate([inverse[..., :3, :], tangents @ inverse[..., 3:, :]], axis=-2)


def line_tangents(direction: Floats) -> Floats:
    """Return (..., 3, 2), columns the `tangent_frame` of the directions (..., 3); NaN where they are."""
    known = np.all(np.isfinite(direction), axis=-1, keepdims=True)
    tangents = np.stack(tangent_frame(np.where(known, direction, (0.0, 0.0, 1.0))), axis=-1)
    return np.where(known[..., None], tangents, np.nan)


def invert(matrices: Floats, singular: float) -> Floats:
    """Return the inverses of matrices (..., n, n), filled with the value `singular` where there is none."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        regular = np.abs(np.linalg.det(matrices)) > 0.0  # False for NaN too; numpy.linalg.inv raises for 0
    safe = np.where(regular[..., None, None], matrices, np.eye(matrices.shape[-1]))
    return np.where(regular[..., None, None], np.linalg.inv(safe), singular)
