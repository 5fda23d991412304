"""Singular surfaces: distances of the pose to the surfaces that bound its component."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.planning.limits.limit import Group, LengthLimit, Scene
from pentapod.planning.limits.tool_pose import ToolPose


@dataclass(frozen=True, kw_only=True)
class AxisInBasePlane:
    """The surface w = 0: the tool axis parallel to the base plane. comfort: |w| that counts as margin 1."""

    sign: int
    comfort: float
    name: str = "singular surface w = 0"
    group: Group = "singularities"
    unit: str = "deg"

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of w."""
        return self.sign * pose.direction[2] / self.comfort

    def shortfall(self, margin: float) -> float:
        """Return degrees of the axis beyond the base plane."""
        return float(np.degrees(np.arcsin(np.clip(-margin * self.comfort, -1.0, 1.0))))


@dataclass(frozen=True, kw_only=True)
class SurfaceDistance(LengthLimit):
    """The surface S = 0, by its distance in position (kinematics notes, section 4)."""

    sign: int

    @classmethod
    def of(cls, scene: Scene) -> list[AxisInBasePlane | SurfaceDistance]:
        """Return both surfaces."""
        legs, comforts = scene.machine.legs, scene.comforts
        mean = float(np.mean(0.5 * (legs.min_length + legs.max_length)))
        return [
            AxisInBasePlane(sign=scene.component.w, comfort=float(np.sin(comforts.axis_angle))),
            cls(
                name="singular surface S = 0", group="singularities",
                comfort=comforts.surface_share * mean, sign=scene.component.s,
            ),
        ]  # fmt: skip

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of the distance, from p and i in the reduced frame of leg 3."""
        robot, p, (u, _, w) = pose.machine.robot, pose.position, pose.direction
        delta, (x3, _), z3 = robot.delta, robot.base[2].tolist(), float(robot.offsets[2])
        px, pz = p[0] + z3 * u - x3, p[2] + z3 * w
        s = delta * w * px - (delta * u - 1.0) * pz
        distance = s / pose.xp.sqrt((delta * w) * (delta * w) + (1.0 - delta * u) * (1.0 - delta * u))
        return self.sign * distance / self.comfort
