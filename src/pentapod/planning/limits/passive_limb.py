"""Passive limb: its carriage on the rail, its strut neither too short nor too long, its universal joint not too far."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.machine.bars import PassiveLimb
from pentapod.planning.limits.limit import CosineLimit, LengthLimit, Limit, Scene
from pentapod.planning.limits.tool_pose import ToolPose


@dataclass(frozen=True, kw_only=True)
class LimbTravel(LengthLimit):
    """One end of the limb's rail, or of its strut's stroke. end: metres there; half of the way counts as margin 1."""

    limb: PassiveLimb
    end: float
    sign: float
    strut: bool

    def margin(self, pose: ToolPose) -> Any:
        """Return the share of half the way that is left."""
        at = pose.lengths[-1] if self.strut else self.limb.place_of(self.limb.end_of(pose.position, pose.direction))
        return self.sign * (at - self.end) / self.comfort


@dataclass(frozen=True, kw_only=True)
class StrutAngle(CosineLimit):
    """One end of the range of the angle between strut and tool axis; half the range of cosines counts as margin 1."""

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of the angle."""
        return self.room(pose.cosines[-1])


def limb_limits(scene: Scene) -> list[Limit]:
    """Return the limits of the passive limb; none where the machine has none."""
    limb = scene.machine.limb
    return [] if limb is None else [*_travels(limb), *_angles(limb)]


def _travels(limb: PassiveLimb) -> list[Limit]:
    found: list[Limit] = []
    for strut, ends, words in (
        (False, limb.carriage, ("carriage off the rail's lower end", "carriage off the rail's upper end")),
        (True, limb.strut, ("strut too short", "strut too long")),
    ):
        half = 0.5 * float(ends[1] - ends[0])
        for name, end, sign in zip(words, ends.tolist(), (1.0, -1.0), strict=True):
            found.append(
                LimbTravel(limb=limb, name=name, comfort=half, group="strokes", end=end, sign=sign, strut=strut)
            )
    return found


def _angles(limb: PassiveLimb) -> list[Limit]:
    least, most = limb.joint_range.tolist()
    low, high = float(np.cos(most)), float(np.cos(least))
    half = 0.5 * (high - low)
    widest = StrutAngle(name="strut's joint beyond its largest angle", edge=low, comfort=half)
    narrowest = StrutAngle(name="strut's joint below its least angle", edge=high, comfort=half, widest=False)
    # No angle is below 0 or above π.
    return [limit for limit, there in ((widest, most < np.pi), (narrowest, least > 0.0)) if there]
