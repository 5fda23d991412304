"""Singular surfaces: distances of the pose from the surfaces that bound its branch, as the robot defines them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.planning.limits.limit import LengthLimit, Scene
from pentapod.planning.limits.tool_pose import ToolPose


@dataclass(frozen=True, kw_only=True)
class SurfaceDistance(LengthLimit):
    """One surface. surface: its index in `Robot.singularities`. comfort: metres, or the sine of an angle."""

    surface: int

    @classmethod
    def of(cls, scene: Scene) -> list[SurfaceDistance]:
        """Return all surfaces of the robot."""
        legs, comforts = scene.machine.legs, scene.comforts
        mean = float(np.mean(0.5 * (legs.min_length + legs.max_length)))
        comfort = {"mm": comforts.surface_share * mean, "deg": float(np.sin(comforts.axis_angle))}
        return [
            cls(name=surface.name, unit=surface.unit, comfort=comfort[surface.unit], group="singularities", surface=k)
            for k, surface in enumerate(scene.machine.robot.singularities)
        ]

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of the distance or angle."""
        return pose.singularity_margins[self.surface] / self.comfort

    def shortfall(self, margin: float) -> float:
        """Return millimetres or degrees beyond the surface."""
        if self.unit == "mm":
            return super().shortfall(margin)
        return float(np.degrees(np.arcsin(np.clip(-margin * self.comfort, -1.0, 1.0))))
