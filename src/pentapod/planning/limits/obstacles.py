"""Obstacles: gaps between the moving bodies and the part, its fixture and the machine's table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pentapod.kinematics.legs_on_line import LegsOnLine
from pentapod.planning.limits.contacts import NUMBERS, body_comforts
from pentapod.planning.limits.limit import LengthLimit, Scene
from pentapod.planning.limits.tool_pose import ToolPose, WorkpieceContacts


@dataclass(frozen=True, kw_only=True)
class ObstacleClearance(LengthLimit):
    """The gap between one body and one obstacle. column: of all such gaps; clamped: see `Obstacle`.

    body: index of a leg, or beyond the legs: a body on the tool axis.
    """

    body: int
    column: int
    clamped: bool

    @classmethod
    def of(cls, scene: Scene) -> list[ObstacleClearance]:
        """Return the gaps of all bodies to the first obstacle, then to the next."""
        collision_world = scene.collision_world
        bodies = list(zip(collision_world.names(scene.machine), body_comforts(scene), strict=True))
        return [
            cls(
                name=f"{name} touches the {obstacle.name}", comfort=comfort,
                body=k, column=k + row * len(bodies), clamped=obstacle.clamped,
            )
            for row, obstacle in enumerate(collision_world.obstacles)
            for k, (name, comfort) in enumerate(bodies)
        ]  # fmt: skip

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin by the pose's contacts: exact where they were taken, and to first order around."""
        return self._gap(pose, pose.contacts) / self.comfort if pose.contacts is not None else float("nan")

    def _gap(self, pose: ToolPose, contacts: WorkpieceContacts) -> Any:
        s, *rest = contacts.numbers[NUMBERS * self.column : NUMBERS * (self.column + 1)]
        normal, point, radius = rest[:3], rest[3:6], rest[6]
        tip, axis = pose.tip, pose.axis
        if self.body < len(pose.heights) and not isinstance(pose.machine.robot, LegsOnLine):
            on_leg, on_arm = pose.xp.least(s, 1.0), pose.xp.most(s - 1.0, 0.0)
            start, leg, arm = pose.base(self.body), pose.vectors[self.body], pose.arm(self.body)
            x = [start[k] + on_leg * leg[k] + on_arm * arm[k] for k in range(3)]
        elif self.body < len(pose.heights):
            start = pose.base(self.body)
            joints = pose.bases, [pose.machine.tool_length - z for z in pose.heights]  # heights from the tip
            leg = pose.machine.robot.vectors_of(tip, axis, pose.xp, joints)[self.body]
            x = [start[k] + s * leg[k] for k in range(3)]
        else:
            x = [tip[k] + s * axis[k] for k in range(3)]
        if self.clamped:
            off = [x[k] - contacts.translation[k] for k in range(3)]
            x = [sum(contacts.rotation[k, j] * off[k] for k in range(3)) for j in range(3)]
        return sum(normal[k] * (x[k] - point[k]) for k in range(3)) - radius
