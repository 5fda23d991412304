"""Margins: all limits of a machine in one branch as dimensionless numbers, positive inside and 0 at the limit.

The margins are scaled so that 1 is comfortable; the planner maximises the smallest of them. Each limit is a formula for
NumPy arrays and casadi expressions alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ArrayError
from pentapod.base.registry import Registry
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.arithmetic import NUMPY, Arithmetic, Joints
from pentapod.kinematics.robot import Branch, own_branch
from pentapod.machine.clearance.collision_world import NOTHING, CollisionWorld
from pentapod.machine.machine import Machine
from pentapod.numerics.blocks import blocks
from pentapod.planning.limits.base_joints import BaseJointCone
from pentapod.planning.limits.contacts import NUMBERS, OPTIONS, contacts
from pentapod.planning.limits.leg_pairs import LegPairClearance
from pentapod.planning.limits.leg_spindle import LegSpindleClearance
from pentapod.planning.limits.leg_tool import LegToolClearance
from pentapod.planning.limits.limit import Limit, LimitKind, Scene
from pentapod.planning.limits.obstacles import ObstacleClearance
from pentapod.planning.limits.passive_limb import limb_limits
from pentapod.planning.limits.platform_joints import PlatformJointAngle
from pentapod.planning.limits.singular_surfaces import SurfaceDistance
from pentapod.planning.limits.strokes import LegStroke
from pentapod.planning.limits.tool_pose import ToolPose, WorkpieceContacts

BLOCK = 16_384
"""Poses whose margins are computed at a time."""

LIMITS = Registry("limit", "pentapod.limits", LimitKind)
"""The kinds of limits by name, in the order of the margins; those to obstacles come after them.

Those of other packages hold where a job names them (`[limits] use`), or `plan(limits=...)` does.
"""

LIMITS.register("strokes", LimitKind(LegStroke.of))
LIMITS.register("singular surfaces", LimitKind(SurfaceDistance.of))
LIMITS.register("base joints", LimitKind(BaseJointCone.of))
LIMITS.register("platform joints", LimitKind(PlatformJointAngle.of))
LIMITS.register("passive limb", LimitKind(limb_limits))
LIMITS.register("leg pairs", LimitKind(LegPairClearance.of))
LIMITS.register("leg and spindle", LimitKind(LegSpindleClearance.of))
LIMITS.register("leg and tool", LimitKind(LegToolClearance.of))


@dataclass(frozen=True, eq=False)
class Margins:
    """The margins of one machine in one branch.

    Called with tips and tool axes (..., 3) in the machine frame it returns (..., M), M = len(limits): those of the
    machine itself (`own_limits`), and then those to obstacles, which depend on the workpiece's placement.
    """

    scene: Scene
    kinds: tuple[LimitKind, ...]
    own_limits: tuple[Limit, ...]
    limits: tuple[Limit, ...]

    @classmethod
    def of(
        cls,
        machine: Machine,
        branch: Branch,
        collision_world: CollisionWorld = NOTHING,
        limits: Sequence[LimitKind] = (),
    ) -> Margins:
        """Return the margins of `machine` in a branch, two signs. limits: kinds of limits besides pentapod's own."""
        kinds = tuple(dict.fromkeys((*LIMITS.own.values(), *limits)))
        scene = Scene(machine, own_branch(machine.robot, branch), collision_world)
        own = tuple(limit for kind in kinds for limit in kind.of(scene))
        return cls(scene, kinds, own, (*own, *ObstacleClearance.of(scene)))

    def on(self, machine: Machine) -> Margins:
        """Return the same margins of another machine."""
        return Margins.of(machine, self.scene.branch, self.scene.collision_world, self.kinds)

    def in_world(self, collision_world: CollisionWorld) -> Margins:
        """Return the same margins in another collision world."""
        return Margins.of(self.scene.machine, self.scene.branch, collision_world, self.kinds)

    def __call__(
        self,
        tips: Floats,
        axes: Floats,
        placement: RigidTransform | None = None,
        gaps: Floats | None = None,
        block: int = BLOCK,
        enough: float = OPTIONS.cap,
    ) -> Floats:
        """Return margins (..., M) of tool tips and axes (tip → spindle), both (..., 3), machine frame.

        placement: of the workpiece; needed where there are obstacles. gaps (..., obstacles): as for `contacts`. block:
        poses at a time, to bound the memory. enough: larger margins to obstacles may be given as this one.
        """
        if tips.ndim == 2 and len(tips) > block:
            return np.concatenate(
                [
                    self(tips[part], axes[part], placement, None if gaps is None else gaps[part], enough=enough)
                    for part in blocks(len(tips), block)
                ]
            )
        own = self.own(tips, axes)
        if not self.scene.collision_world.obstacles:
            return own
        if placement is None:
            raise ArrayError("gaps to the part depend on the placement", key="placement", expected="a RigidTransform")
        known = None if gaps is None else gaps.reshape(-1, gaps.shape[-1])
        poses = tips.reshape(-1, 3), axes.reshape(-1, 3)
        outer = contacts(self.scene, *poses, placement, numbers=False, gaps=known, enough=enough).margins
        return np.concatenate([own, outer.reshape(*own.shape[:-1], outer.shape[-1])], axis=-1)

    def own(self, tips: Floats, axes: Floats, block: int = BLOCK) -> Floats:
        """Return the margins (..., M) of the machine alone. block: poses at a time, to bound the memory.

        Those of one limit lie together in memory, so that the smallest of each pose is found several times as fast.
        """
        if tips.ndim == 2 and len(tips) > block:
            return np.concatenate([self.own(tips[part], axes[part]) for part in blocks(len(tips), block)])
        pose = self._pose(tips, axes)
        values = np.broadcast_arrays(*(limit.margin(pose) for limit in self.own_limits))
        return np.moveaxis(np.stack(values), 0, -1)

    def least_own(self, tips: Floats, axes: Floats, *, pairs: bool = True) -> Floats:
        """Return the smallest margin (...) of the machine alone, in a third of the time of all of them.

        pairs: whether legs may touch each other; without these limits it is an upper bound, in a tenth of the time.
        """
        pose, least = self._pose(tips, axes), np.full(tips.shape[:-1], np.inf)
        for limit in self.own_limits:
            if pairs or not isinstance(limit, LegPairClearance):
                np.minimum(least, limit.margin(pose), out=least)
        return least

    def _pose(self, tips: Floats, axes: Floats) -> ToolPose:
        tip, axis = (list(np.ascontiguousarray(np.moveaxis(each, -1, 0))) for each in (tips, axes))
        return ToolPose(self.scene.machine, self.scene.branch, tip, axis, NUMPY)

    def contacts(self, tips: Floats, axes: Floats, placement: RigidTransform) -> Floats:
        """Return the contacts (n, contact_numbers) that `symbolic` needs, of poses (n, 3); none without obstacles."""
        if not self.scene.collision_world.obstacles:
            return np.zeros((len(tips), 0))
        return contacts(self.scene, tips, axes, placement).numbers

    @property
    def contact_numbers(self) -> int:
        """The length of the contacts of one pose."""
        return NUMBERS * (len(self.limits) - len(self.own_limits))

    def symbolic(
        self,
        tip: Any,
        axis: Any,
        turn: Any = None,
        shift: Any = None,
        numbers: Any = None,
        joints: Joints | None = None,
    ) -> Any:
        """Return the same margins as a column of expressions, for casadi SX vectors tip and axis (3).

        turn, shift: the workpiece's rotation (3×3) and translation; numbers: its contacts, see `contacts`. All three
        are needed where there are obstacles. joints: positions of base joints on guides and of their platform joints,
        as expressions. The singular surfaces do not depend on them. The gaps between a leg and the bodies on its
        platform line hardly do, and are computed with the joints of the machine.
        """
        import casadi as ca  # noqa: PLC0415  heavy: only when planning

        touching = None
        if self.scene.collision_world.obstacles:
            touching = WorkpieceContacts(turn, ca.vertsplit(shift), ca.vertsplit(numbers))
        tip, axis = ca.vertsplit(tip), ca.vertsplit(axis)
        pose = ToolPose(self.scene.machine, self.scene.branch, tip, axis, Arithmetic.casadi(), joints, touching)
        return ca.vertcat(*(limit.margin(pose) for limit in self.limits))
