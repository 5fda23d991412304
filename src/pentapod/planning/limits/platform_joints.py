"""Platform joints: the angle between each leg and the tool axis within its range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.planning.limits.limit import CosineLimit, Scene
from pentapod.planning.limits.tool_pose import ToolPose


@dataclass(frozen=True, kw_only=True)
class PlatformJointAngle(CosineLimit):
    """One end of the range of one platform joint; half the range of cosines counts as margin 1."""

    leg: int

    @classmethod
    def of(cls, scene: Scene) -> list[PlatformJointAngle]:
        """Return for each leg the largest and the least angle.

        An angle cannot be below 0° nor above 180°: such an end is no limit, and its margin is 1 at least.
        """
        found: list[PlatformJointAngle] = []
        for k, (least, most) in enumerate(scene.machine.joints.platform_range.tolist()):
            low, high = float(np.cos(most)), float(np.cos(least))
            half, name = 0.5 * (high - low), f"platform joint {k + 1}"
            widest, narrowest = low if most < np.pi else low - half, high if least > 0.0 else high + half
            found.append(cls(name=f"{name} beyond its largest angle", leg=k, edge=widest, comfort=half))
            found.append(cls(name=f"{name} below its least angle", leg=k, edge=narrowest, comfort=half, widest=False))
        return found

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of the angle."""
        return self.room(pose.cosines[self.leg])
