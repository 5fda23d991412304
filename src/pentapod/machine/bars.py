"""Bars: the legs, and the passive limb where there is one, as bodies from the base to the platform."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.robot import Robot
from pentapod.machine.passive_limb import PassiveLimb


@dataclass(frozen=True, eq=False)
class Bars:
    """The bars of a robot: legs first, in their order, then the passive limb.

    leg_radius: metres. offsets (B,): of the ends along the platform line, of bars beside it those of their arms' feet,
    metres. beside (B,): which end beside the line. radii (B,): metres.
    """

    robot: Robot
    limb: PassiveLimb | None
    leg_radius: float

    @property
    def names(self) -> tuple[str, ...]:
        """Their names: "leg 1" ..., "passive limb"."""
        legs = tuple(f"leg {k + 1}" for k in range(self.robot.n_legs))
        return legs if self.limb is None else (*legs, self.limb.name)

    @property
    def offsets(self) -> Floats:
        """Where they, or their arms, meet the platform line (B,), metres."""
        return self.robot.offsets if self.limb is None else np.append(self.robot.offsets, self.limb.joint)

    @property
    def beside(self) -> Bools:
        """Which of them end beside the platform line (B,)."""
        legs = self.robot.arms > 0.0
        return legs if self.limb is None else np.append(legs, False)

    @property
    def radii(self) -> Floats:
        """Their radii (B,), metres."""
        legs = np.full(self.robot.n_legs, self.leg_radius)
        return legs if self.limb is None else np.append(legs, self.limb.radius)

    def ends(self, position: Floats, direction: Floats) -> tuple[Floats, Floats]:
        """Return where they begin at the base and end at the platform, (..., B, 3), in poses (..., 3)."""
        robot = self.robot
        joints = robot.platform_joints(position, direction)
        base = np.broadcast_to(robot.base_joints, joints.shape)
        if self.limb is None:
            return base, joints
        foot, end = self.limb.ends(position, direction)
        return np.concatenate([base, foot[..., None, :]], axis=-2), np.concatenate([joints, end[..., None, :]], axis=-2)
