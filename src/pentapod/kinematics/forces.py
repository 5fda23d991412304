"""Forces in the legs, per newton and per newton-metre at the tip."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch
from pentapod.kinematics.batches import joined_poses
from pentapod.kinematics.jacobian import invert, line_tangents, tip_jacobian
from pentapod.kinematics.robot import Robot
from pentapod.numerics.blocks import in_blocks


def leg_force_map(robot: Robot, position: ArrayLike, direction: ArrayLike, tool_length: float) -> Floats:
    """Return the map (..., 5, 3) from a force on the tip to the five axial leg forces that hold it (N/N).

    The force acts on the tip p + tool_length · i (metres), machine frame, without a moment; a positive leg
    force pushes its platform joint away from the base. Static, weightless, frictionless. Infinite on a
    singularity, NaN for a pose that is NaN. position and direction (..., 3).
    """
    return leg_load_map(robot, position, direction, tool_length)[..., :3]


def leg_moment_map(robot: Robot, position: ArrayLike, direction: ArrayLike, tool_length: float) -> Floats:
    """Return the map (..., 5, 3) from a moment on the tool, without a force, to the leg forces (N per N·m).

    As `leg_force_map`. A couple loads the legs alike wherever it acts; the tool length does not matter. The part of the
    moment about the line itself is not held by the legs (the tool spins): it calls up no leg force here.
    """
    return leg_load_map(robot, position, direction, tool_length)[..., 3:]


def leg_load_map(robot: Robot, position: ArrayLike, direction: ArrayLike, tool_length: float) -> Floats:
    """Return both maps side by side (..., 5, 6): the leg forces that hold a force and a moment at the tip."""
    i = as_batch(direction, "direction", (3,))
    by_pose = tip_jacobian(robot, position, i, tool_length)
    unit = by_pose[..., :3]
    # Moments about the tip: there a force has none.
    # The line's own axis carries no moment, so two tangents suffice. Virtual work: Jᵀ f = −load.
    tangents = line_tangents(i)
    inverse = invert(np.concatenate([unit, by_pose[..., 3:] @ tangents], axis=-1), np.inf)
    forces = -np.swapaxes(inverse, -1, -2)
    # Turning by dα along t1 is the rotation dα · i × t1 = dα · t2, and along t2 it is −dβ · t1.
    t1, t2 = tangents[..., None, :, 0], tangents[..., None, :, 1]
    finite = np.all(np.isfinite(forces), axis=(-1, -2), keepdims=True)
    safe = np.where(finite, forces, 0.0)
    loads = np.concatenate([safe[..., :3], safe[..., 3:4] * t2 - safe[..., 4:5] * t1], axis=-1)
    missing = np.any(np.isnan(unit), axis=(-1, -2), keepdims=True)
    return np.where(missing, np.nan, np.where(finite, loads, np.inf))


def tip_force_amplification(robot: Robot, position: ArrayLike, direction: ArrayLike, tool_length: float) -> Floats:
    """Return the largest norm (...) of the five leg forces that a tip force of 1 N in any direction calls up.

    It is the spectral norm of `leg_force_map`; see there. Infinite on a singularity.
    """
    poses = joined_poses(position, direction)
    return in_blocks(lambda p, i: _largest(leg_force_map(robot, p, i, tool_length)), *poses)


def tip_moment_amplification(robot: Robot, position: ArrayLike, direction: ArrayLike, tool_length: float) -> Floats:
    """Return the largest norm (..., newtons) of the five leg forces that a moment of 1 N·m calls up.

    It is the spectral norm of `leg_moment_map`; see there. Infinite on a singularity.
    """
    poses = joined_poses(position, direction)
    return in_blocks(lambda p, i: _largest(leg_moment_map(robot, p, i, tool_length)), *poses)


def _largest(forces: Floats) -> Floats:
    """Return the spectral norms (...) of maps (..., 5, 3); infinite or NaN where they are."""
    finite = np.all(np.isfinite(forces), axis=(-1, -2))
    safe = np.where(finite[..., None, None], forces, 0.0)
    largest = np.sqrt(np.linalg.eigvalsh(np.swapaxes(safe, -1, -2) @ safe)[..., -1])
    return np.where(finite, largest, np.where(np.any(np.isnan(forces), axis=(-1, -2)), np.nan, np.inf))
