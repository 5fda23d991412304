"""Leg pairs: signed clearance of two legs, negative where they have passed through each other."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from pentapod.kinematics.arithmetic import Arithmetic, Vector, dot
from pentapod.planning.limits.limit import LengthLimit, Scene
from pentapod.planning.limits.tool_pose import ToolPose


@dataclass(frozen=True, kw_only=True)
class LegPairClearance(LengthLimit):
    """The gap between two legs. thickness: of a leg, metres; side: see `signed_leg_clearance`."""

    first: int
    second: int
    side: float
    thickness: float

    @classmethod
    def of(cls, scene: Scene) -> list[LegPairClearance]:
        """Return all pairs; each must pass on the side on which it does in the middle of the work volume."""
        machine = scene.machine
        direction = np.array([0.0, 0.0, float(scene.branch.w)])
        position = machine.work.centre - machine.tool_length * direction
        legs, base = machine.robot.leg_vectors(position, direction), machine.robot.base_joints
        found: list[LegPairClearance] = []
        for j, k in combinations(range(len(legs)), 2):
            side = float(np.sign(np.dot(base[k] - base[j], np.cross(legs[j], legs[k]))))
            found.append(
                cls(
                    name=f"legs {j + 1} and {k + 1} touch", comfort=scene.comforts.legs,
                    first=j, second=k, side=side, thickness=2.0 * machine.bodies.leg_radius,
                )
            )  # fmt: skip
        return found

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of the gap."""
        j, k = self.first, self.second
        offset = [b - a for a, b in zip(pose.bases[j], pose.bases[k], strict=True)]
        gap = signed_leg_clearance(offset, pose.vectors[j], pose.vectors[k], self.side, pose.xp)
        return (gap - self.thickness) / self.comfort


def signed_leg_clearance(offset: Vector, d1: Vector, d2: Vector, side: float, xp: Arithmetic) -> Any:
    """Return the distance of segments α d1 and offset + β d2, α, β in [0, 1].

    offset: of three components, or two where it lies in the base plane. side: the sign of offset · (d1 × d2) where the
    segments have not passed through each other. The distance is negative where they have: where the nearest points lie
    inside both and that sign is the other one. The quadratic in (α, β) is minimised on the unit square by clamping α,
    then β, then α again.
    """
    a = d1[0] * d1[0] + d1[1] * d1[1] + d1[2] * d1[2]
    e = d2[0] * d2[0] + d2[1] * d2[1] + d2[2] * d2[2]
    b = d1[0] * d2[0] + d1[1] * d2[1] + d1[2] * d2[2]
    c, f = -_along(offset, d1), -_along(offset, d2)
    area = a * e - b * b + 1e-12 * a * e  # parallel legs: any α will do, the later clamps repair it

    def clamp(x: Any) -> Any:
        return xp.least(xp.most(x, 0.0), 1.0)

    alpha = clamp((b * f - c * e) / area)
    beta = clamp((b * alpha + f) / e)
    alpha = clamp((b * beta - c) / a)
    g = [alpha * d1[k] - beta * d2[k] for k in range(3)]
    for k, o in enumerate(offset):
        g[k] = g[k] - o
    gap = xp.sqrt(dot(g, g) + 1e-18)  # the last term keeps the derivative finite at contact
    triple = _along(offset, [d1[k - 2] * d2[k - 1] - d1[k - 1] * d2[k - 2] for k in range(len(offset))])
    inside = alpha * (1.0 - alpha) * beta * (1.0 - beta)
    return xp.where(side * triple * inside < 0.0, -gap, gap)


def _along(offset: Vector, d: Vector) -> Any:
    """Return the scalar product of an offset of two or three components with a vector."""
    planar = offset[0] * d[0] + offset[1] * d[1]
    return planar if len(offset) == 2 else planar + offset[2] * d[2]
