"""LegsOnLine: what every robot has in common whose legs all end on the platform line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, read_only
from pentapod.kinematics.batches import as_poses, common_batch


class LegsOnLine:
    """A robot without arms: nothing but its legs holds the platform, which is free to turn about its line."""

    n_legs: int

    @property
    def arms(self) -> Floats:
        """There are none: zeros (n_legs,)."""
        return np.zeros(self.n_legs)

    def passive_wrenches(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return an array (..., 0, 6): there are no passive joints that hold anything."""
        return np.zeros((*common_batch(*as_poses(position, direction), ("position", "direction")), 0, 6))

    def hinges(self, position: ArrayLike, direction: ArrayLike) -> Mapping[int, Floats]:
        """Return nothing: no leg hangs in a revolute joint."""
        return {}

    def enclose_joints(self, poses: tuple[Floats, Floats], legs: Floats) -> Floats:
        """Return bounds (N, n_legs) of how far the platform joints get: they are points of the line."""
        robot = cast("Any", self)
        return robot.enclose(poses, legs, robot.offsets)[0]

    def leg_derivatives(self, tips: Sequence[tuple[Floats, Floats]], tool_length: float) -> list[Floats]:
        """Return readings (n, n_legs) and their derivatives along a curve, of as many orders as are given.

        tips: at [k] the derivatives of order k ≤ 3 of the tip and of the tool axis (tip → spindle), (n, 3) each.
        """
        from pentapod.kinematics.five_legs_kernels import readings_along  # noqa: PLC0415 - loads numba

        robot, curve = cast("Any", self), np.array(tips)
        legs = np.empty((len(tips), curve.shape[2], self.n_legs))
        levers = tool_length - robot.offsets
        along = read_only(curve[:, 0]), read_only(curve[:, 1])
        fixed = read_only(robot.base_joints), read_only(levers), read_only(robot.radii), read_only(robot.zeros)
        readings_along(*along, *fixed, legs)
        return list(legs)
