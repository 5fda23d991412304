"""Base joints: the angle of each leg within the cone of its universal joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.kinematics.arithmetic import dot
from pentapod.planning.limits.limit import CosineLimit, Scene
from pentapod.planning.limits.tool_pose import ToolPose


@dataclass(frozen=True, kw_only=True)
class BaseJointCone(CosineLimit):
    """The cone of one base joint. axis (3,): the cone's, machine frame; a leg along it has margin 1."""

    leg: int
    axis: tuple[float, ...]

    @classmethod
    def of(cls, scene: Scene) -> list[BaseJointCone]:
        """Return the cones of all legs."""
        joints = scene.machine.joints
        found: list[BaseJointCone] = []
        for k, (axis, cone) in enumerate(zip(joints.base_axes.tolist(), joints.base_cone.tolist(), strict=True)):
            edge, name = float(np.cos(cone)), f"base joint {k + 1} beyond its cone"
            found.append(cls(name=name, leg=k, axis=tuple(axis), edge=edge, comfort=1.0 - edge))
        return found

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of the angle between leg and cone axis."""
        return self.room(dot(pose.vectors[self.leg], self.axis) / pose.lengths[self.leg])
