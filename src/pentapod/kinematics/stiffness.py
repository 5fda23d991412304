"""How stiff the tip is, given how stiff the legs are along their axes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch, as_floats
from pentapod.base.errors import ArrayError
from pentapod.kinematics.forces import leg_load_map
from pentapod.kinematics.jacobian import tip_jacobian
from pentapod.kinematics.robot import Robot


def tip_stiffness(
    robot: Robot, position: ArrayLike, direction: ArrayLike, leg_stiffness: ArrayLike, tool_length: float
) -> Floats:
    """Return the stiffness (..., 6, 6) at the tip: [force; moment] = K [shift; rotation], machine frame.

    leg_stiffness (5,) or (..., 5) in N/m, along each leg; joints and platform are rigid. Shift of the tip
    p + tool_length · i in metres, small rotation vector in radians: blocks in N/m, N/rad, N and N·m/rad. K is
    symmetric, of rank 5: the spin about the line meets no resistance. The pose is unloaded: forces that already act in
    the legs would add a geometric stiffness, which is not in K. NaN for a pose that is NaN; on a singularity the rank
    is below 5.
    """
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
