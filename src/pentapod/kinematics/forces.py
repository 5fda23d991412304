"""Statics: leg forces that hold a load at the tip, and the tip's stiffness and compliance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch, as_floats
from pentapod.base.errors import ArrayError
from pentapod.kinematics.batches import joined_poses
from pentapod.kinematics.jacobian import invert, line_tangents, tip_jacobian
from pentapod.kinematics.robot import Robot
from pentapod.numerics.blocks import in_blocks

FREEDOMS = 6
"""Of a rigid body; legs and passive joints that hold fewer leave the platform free to turn about its line."""


def leg_force_map(robot: Robot, position: ArrayLike, direction: ArrayLike, tool_length: float) -> Floats:
    """Return the map (..., n_legs, 3) from a force on the tip to the axial leg forces that hold it (N/N).

    The force acts on the tip p + tool_length · i (metres), machine frame, without a moment; a positive leg
    force pushes its platform joint away from the base. Static, weightless, frictionless. Infinite on a
    singularity, NaN for a pose that is NaN. position and direction (..., 3).
    """
    return leg_load_map(robot, position, direction, tool_length)[..., :3]


def leg_moment_map(robot: Robot, position: ArrayLike, direction: ArrayLike, tool_length: float) -> Floats:
    """Return the map (..., n_legs, 3) from a moment on the tool, without a force, to the leg forces (N per N·m).

    As `leg_force_map`. A couple loads the legs alike wherever it acts; the tool length does not matter. The part of the
    moment about the line itself is not held by the legs (the tool spins): it calls up no leg force here.
    """
    return leg_load_map(robot, position, direction, tool_length)[..., 3:]


def leg_load_map(robot: Robot, position: ArrayLike, direction: ArrayLike, tool_length: float) -> Floats:
    """Return both maps side by side (..., n_legs, 6): the leg forces that hold a force and a moment at the tip."""
    i = as_batch(direction, "direction", (3,))
    if robot.n_legs + robot.passive_wrenches(position, i).shape[-2] == FREEDOMS:
        return _of_held_platform(robot, *joined_poses(position, i), tool_length)
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


def _of_held_platform(robot: Robot, position: Floats, direction: Floats, tool_length: float) -> Floats:
    """Return `leg_load_map` of a platform that legs and passive joints hold in all six freedoms."""
    wrenches = held_wrenches(robot, position, direction)
    wrenches[..., 3:] -= np.cross(tool_length * direction[..., None, :], wrenches[..., :3])
    inverse = invert(np.where(np.isfinite(wrenches), wrenches, 0.0), np.inf)
    loads = -np.swapaxes(inverse, -1, -2)[..., : robot.n_legs, :]
    missing = np.isnan(wrenches).any(axis=(-1, -2), keepdims=True)
    return np.where(missing, np.nan, np.where(np.isfinite(loads).all(axis=(-1, -2), keepdims=True), loads, np.inf))


def held_wrenches(robot: Robot, position: Floats, direction: Floats) -> Floats:
    """Return what a unit of each leg's and each passive joint's force does to a platform that they hold, (..., 6, 6).

    Rows: force, and moment about p (N·m/N), machine frame; poses (..., 3). Legs first.
    """
    vectors = robot.leg_vectors(position, direction)
    unit = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    levers = robot.platform_joints(position, direction) - position[..., None, :]
    legs = np.concatenate([unit, np.cross(levers, unit)], axis=-1)
    return np.asarray(np.concatenate([legs, robot.passive_wrenches(position, direction)], axis=-2), dtype=np.float64)


def tip_force_amplification(robot: Robot, position: ArrayLike, direction: ArrayLike, tool_length: float) -> Floats:
    """Return the largest norm (...) of the leg forces that a tip force of 1 N in any direction calls up.

    It is the spectral norm of `leg_force_map`; see there. Infinite on a singularity.
    """
    poses = joined_poses(position, direction)
    return in_blocks(lambda p, i: _largest(leg_force_map(robot, p, i, tool_length)), *poses)


def tip_moment_amplification(robot: Robot, position: ArrayLike, direction: ArrayLike, tool_length: float) -> Floats:
    """Return the largest norm (..., newtons) of the leg forces that a moment of 1 N·m calls up.

    It is the spectral norm of `leg_moment_map`; see there. Infinite on a singularity.
    """
    poses = joined_poses(position, direction)
    return in_blocks(lambda p, i: _largest(leg_moment_map(robot, p, i, tool_length)), *poses)


def _largest(forces: Floats) -> Floats:
    """Return the spectral norms (...) of maps (..., n_legs, 3); infinite or NaN where they are."""
    finite = np.all(np.isfinite(forces), axis=(-1, -2))
    safe = np.where(finite[..., None, None], forces, 0.0)
    largest = np.sqrt(np.linalg.eigvalsh(np.swapaxes(safe, -1, -2) @ safe)[..., -1])
    return np.where(finite, largest, np.where(np.any(np.isnan(forces), axis=(-1, -2)), np.nan, np.inf))


def tip_stiffness(
    robot: Robot, position: ArrayLike, direction: ArrayLike, leg_stiffness: ArrayLike, tool_length: float
) -> Floats:
    """Return the stiffness (..., 6, 6) at the tip: [force; moment] = K [shift; rotation], machine frame.

    leg_stiffness (n_legs,) or (..., n_legs) in N/m, along each leg; joints and platform are rigid. Shift of the tip
    p + tool_length · i in metres, small rotation vector in radians: blocks in N/m, N/rad, N and N·m/rad. K is
    symmetric, of rank 5 where all legs end on the line: the spin about it meets no resistance. The pose is
    unloaded: forces that already act in the legs would add a geometric stiffness, which is not in K. NaN for a pose
    that is NaN; on a singularity the rank is below 5. Passive joints that hold the platform count as rigid, so they
    have no place in K: raises ArrayError.
    """
    held = robot.n_legs + (passive := robot.passive_wrenches(position, direction).shape[-2]) == FREEDOMS
    if passive:
        raise ArrayError("passive joints are rigid here", key="robot", remedy="ask for the compliance instead")
    if held:
        wrenches = held_wrenches(robot, *joined_poses(position, direction))
        i = as_batch(direction, "direction", (3,))
        wrenches[..., 3:] -= np.cross(tool_length * i[..., None, :], wrenches[..., :3])
        held_by = np.swapaxes(wrenches, -1, -2) @ (_stiffness(robot, leg_stiffness)[..., None] * wrenches)
        return np.asarray(held_by, dtype=np.float64)
    by_pose = tip_jacobian(robot, position, direction, tool_length)
    unit, i = by_pose[..., :3], as_batch(direction, "direction", (3,))[..., None, :]
    moments = np.asarray(np.cross(i, by_pose[..., 3:]), dtype=np.float64)
    wrenches = np.concatenate([unit, moments], axis=-1)
    return np.swapaxes(wrenches, -1, -2) @ (_stiffness(robot, leg_stiffness)[..., None] * wrenches)


def tip_compliance(
    robot: Robot, position: ArrayLike, direction: ArrayLike, leg_stiffness: ArrayLike, tool_length: float
) -> Floats:
    """Return how the tip yields to loads: (..., 6, 6), [shift; rotation] = C [force; moment], machine frame.

    The upper left (3, 3) block, m/N, is what a process force does to the tip; its largest eigenvalue is the worst
    direction. C and `tip_stiffness` are inverse but for rotations about the line, which are free, and moments about it,
    which are not held. Infinite on a singularity, NaN for a pose that is NaN.
    """
    loads = leg_load_map(robot, position, direction, tool_length)
    finite = np.all(np.isfinite(loads), axis=(-1, -2), keepdims=True)
    safe = np.where(finite, loads, 0.0)
    yielding = np.swapaxes(safe, -1, -2) @ (safe / _stiffness(robot, leg_stiffness)[..., None])
    missing = np.any(np.isnan(loads), axis=(-1, -2), keepdims=True)
    return np.where(finite, yielding, np.where(missing, np.nan, np.inf))


def _stiffness(robot: Robot, value: ArrayLike) -> Floats:
    stiffness = as_floats(value, "leg_stiffness", (robot.n_legs,))
    if not (stiffness > 0.0).all():
        raise ArrayError("leg_stiffness must be positive", value=float(stiffness.min()), expected="N/m")
    return stiffness
