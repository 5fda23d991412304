"""Limit: the protocol of one inequality constraint on the tool pose, with a dimensionless margin."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np

from pentapod.kinematics.robot import Branch
from pentapod.machine.clearance.collision_world import NOTHING, CollisionWorld
from pentapod.machine.machine import Machine
from pentapod.planning.limits.tool_pose import ToolPose

Group = Literal["strokes", "singularities", "joints", "bodies", "stiffness"]
"""The kinds of limits; each has a weight of its own (`Weights`)."""


class Limit(Protocol):
    """One limit. Its margin is positive inside, 0 at the limit, and 1 where there is comfortable room."""

    @property
    def name(self) -> str:
        """The limit in words: "leg 3 too long"."""
        ...

    @property
    def unit(self) -> str:
        """The unit of the shortfall: mm, deg, N."""
        ...

    @property
    def group(self) -> Group:
        """The group whose weight counts for it."""
        ...

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of a pose, by the arithmetic of `pose.xp`: NumPy arrays or casadi expressions."""
        ...

    def shortfall(self, margin: float) -> float:
        """Return how far beyond the limit a pose with a negative margin is, in `unit`."""
        ...


@dataclass(frozen=True)
class Comforts:
    """The distances from limits that count as margin 1; strokes and joints take half their range.

    axis_angle: of the tool axis from the base plane, radians. surface_share: distance to the other singular surfaces,
    as a share of the mean leg length. legs: gap between two legs, metres. tool: gap between a leg and the spindle,
    shank or holder on its own platform line, metres. leg_obstacle, spindle_obstacle, tool_obstacle: gaps of legs,
    spindle, and shank and holder to the part and other obstacles, metres; spindle and tool work near the part.
    tool_share, tool_allowances: the gap of shank and holder need not be more than this share of the thinner one's
    radius, and than so many times the allowed depth, as a stem works right beside the surface.
    """

    axis_angle: float = float(np.radians(60.0))
    surface_share: float = 0.25
    legs: float = 0.05
    tool: float = 0.02
    leg_obstacle: float = 0.05
    spindle_obstacle: float = 0.01
    tool_obstacle: float = 0.005
    tool_share: float = 0.5
    tool_allowances: float = 20.0


@dataclass(frozen=True, eq=False)
class Scene:
    """A machine, its branch and its collision world: what limits are made for."""

    machine: Machine
    branch: Branch
    collision_world: CollisionWorld = NOTHING
    comforts: Comforts = Comforts()


@dataclass(frozen=True)
class LimitKind:
    """One kind of limit. of: returns its limits in a scene, one for each margin."""

    of: Callable[[Scene], Iterable[Limit]]


@dataclass(frozen=True, kw_only=True)
class LengthLimit:
    """Base of limits in metres. comfort: metres that count as margin 1."""

    name: str
    comfort: float
    group: Group = "bodies"
    unit: str = "mm"

    def shortfall(self, margin: float) -> float:
        """Return millimetres beyond the limit."""
        return -margin * self.comfort * 1e3


@dataclass(frozen=True, kw_only=True)
class CosineLimit:
    """Base of limits on an angle, stated by its cosine. comfort: difference of cosines that counts as margin 1.

    edge: the cosine at the limit; widest: whether the angle must not be larger, else not smaller. An edge beyond ±1 is
    never reached.
    """

    name: str
    edge: float
    comfort: float
    widest: bool = True
    group: Group = "joints"
    unit: str = "deg"

    def room(self, cosine: Any) -> Any:
        """Return the margin at a cosine of the angle."""
        return (cosine - self.edge if self.widest else self.edge - cosine) / self.comfort

    def shortfall(self, margin: float) -> float:
        """Return degrees beyond the limit."""
        there = self.edge + (margin if self.widest else -margin) * self.comfort
        angles = np.arccos(np.clip([there, self.edge], -1.0, 1.0))
        return float(abs(np.degrees(angles[0] - angles[1])))
