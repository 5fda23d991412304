"""CollisionWorld: the obstacles of legs, spindle and tool: the part, its fixture, the machine's table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.cutters.tool import Tool
from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.solids import Solid
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import Gap, MeshDistance

TOOL_BODY = "tool body"
"""Name of shank and holder in claims and margins."""


PART = "part"
"""Name of the obstacle that is the workpiece."""


@dataclass(frozen=True, eq=False)
class Obstacle(Value):
    """An obstacle. name: "part", "fixture", "table". surface: its mesh.

    clamped: whether it moves with the workpiece and its mesh is in the workpiece frame; else in the machine frame.
    allowance: metres by which the tool body may be inside it and still count as clear.
    """

    name: str
    surface: MeshDistance
    clamped: bool
    allowance: float = 0.0


@dataclass(frozen=True, eq=False)
class CollisionWorld(Value):
    """Obstacles, and the tool's solids above its cutting part: shank and holder; none where it has neither.

    >>> world = CollisionWorld.of(machine, tool, part)
    >>> world.names(machine)[-2:]
    ('leg 5', 'spindle')
    """

    obstacles: tuple[Obstacle, ...] = ()
    tool: tuple[Solid, ...] = ()

    @classmethod
    def of(
        cls,
        machine: Machine,
        tool: Tool,
        part: Mesh,
        *,
        fixture: Mesh | None = None,
        table: Mesh | None = None,
        allowance: float = 50e-6,
    ) -> CollisionWorld:
        """Return the collision world of a part on a machine.

        part, fixture: workpiece frame; table: machine frame. allowance: metres by which the tool's shank and holder may
        be in the part and still count as clear. Raises MachineError where the tool is too long for the machine.
        """
        body = mounted(tool.solids, machine)
        room = machine.tool_length - float(machine.bars.offsets.max())
        if body and max(solid.high for solid in body) > room:
            raise MachineError(
                "the tool stands above the lowest platform joint",
                key="tool",
                expected=f"at most {1e3 * room:.4g} mm from the tip to the holder's end",
                remedy="a longer tool length, or a shorter holder",
            )
        found = [Obstacle(PART, MeshDistance.of(part), clamped=True, allowance=allowance)]
        for name, mesh in (("fixture", fixture), ("table", table)):
            if mesh is not None:
                found.append(Obstacle(name, MeshDistance.of(mesh), clamped=name == "fixture"))
        return cls(tuple(found), body)

    def names(self, machine: Machine) -> tuple[str, ...]:
        """Return the names (K,) of the moving bodies: the bars, the spindle, and the tool body where there is one."""
        return (*machine.bars.names, "spindle", *((TOOL_BODY,) if self.tool else ()))


NOTHING = CollisionWorld()
"""No obstacles, and a tool without shank and holder."""


@dataclass(frozen=True, eq=False)
class MovingBodies:
    """Positions of the moving bodies in N poses, in an obstacle's frame, metres.

    starts, ends (N, B + 1, 3): axes of the bars (`Machine.bars`), base to platform, and of the spindle. tips, axes
    (N, 3): of the tool, the axis unit, tip → spindle. radii (B + 1,): of bars and spindle. feet (N, B + 1,
    3): of the legs' arms, on the platform line; arms (B + 1,): which bodies have one. An arm counts as part of its
    leg: a capsule of its radius from platform joint to foot.
    """

    starts: Floats
    ends: Floats
    tips: Floats
    axes: Floats
    radii: Floats
    feet: Floats
    arms: Bools

    @classmethod
    def at(
        cls, machine: Machine, position: Floats, direction: Floats, frame: RigidTransform | None = None
    ) -> MovingBodies:
        """Return the bodies at poses (N, 3) of the machine; frame: that of the obstacle → machine, if another."""
        bars, top, nose = machine.bars, *spindle_ends(machine)
        bases, joints = bars.ends(position, direction)
        starts = np.concatenate([bases, (position + top * direction)[:, None]], axis=1)
        ends = np.concatenate([joints, (position + nose * direction)[:, None]], axis=1)
        tips, axes = position + machine.tool_length * direction, -direction
        heights = np.append(bars.offsets, nose)
        arms = np.append(bars.beside, False)
        feet = position[:, None] + heights[:, None] * direction[:, None] if arms.any() else ends
        if frame is not None:
            back = frame.inverse()
            starts, ends, tips, axes = back.apply(starts), back.apply(ends), back.apply(tips), back.rotate(axes)
            feet = back.apply(feet) if arms.any() else ends
        radii = np.append(bars.radii, machine.bodies.shaft_radius)
        return cls(starts, ends, tips, axes, radii, feet, arms)

    def only(self, columns: Sequence[int]) -> MovingBodies:
        """Return some of the bars and the spindle."""
        of = list(columns)
        return MovingBodies(
            self.starts[:, of], self.ends[:, of], self.tips, self.axes, self.radii[of], self.feet[:, of], self.arms[of]
        )

    def segments(self, surface: MeshDistance, within: float) -> Gap:
        """Return the gaps of bars and spindle, (N · (B + 1),), surface to surface, none above `within`."""
        far = within + float(self.radii.max())
        axes = surface.segments(self.starts.reshape(-1, 3), self.ends.reshape(-1, 3), far)
        if self.arms.any():
            axes = self._with_arms(axes, surface, far)
        distance = axes.distance - np.tile(self.radii, len(self.tips))
        return Gap(np.minimum(distance, within), axes.place, axes.normal)

    def _with_arms(self, axes: Gap, surface: MeshDistance, far: float) -> Gap:
        """Return the gaps with those of arms where they are nearer: there the place counts from 1 to 2."""
        chosen = np.flatnonzero(np.tile(self.arms, len(self.tips)))
        ends, feet = self.ends.reshape(-1, 3)[chosen], self.feet.reshape(-1, 3)[chosen]
        arms = surface.segments(ends, feet, far)
        nearer = arms.distance < axes.distance[chosen]
        distance, place, normal = axes.distance.copy(), axes.place.copy(), axes.normal.copy()
        rows = chosen[nearer]
        distance[rows], place[rows], normal[rows] = arms.distance[nearer], 1.0 + arms.place[nearer], arms.normal[nearer]
        return Gap(distance, place, normal)

    def gaps(self, obstacle: Obstacle, tool: Sequence[Solid], within: float) -> Floats:
        """Return the gaps (N, K) of all moving bodies, in the order of `CollisionWorld.names`; none above `within`.

        The depth of a body in an open sheet is at most its own thickness. The tool's allowance is added.
        """
        found = self.segments(obstacle.surface, within).distance.reshape(-1, len(self.radii))
        if not tool:
            return found
        body, _ = obstacle.surface.bodies(tool, self.tips, self.axes, within)
        return np.column_stack([found, np.minimum(body + obstacle.allowance, within)])


def spindle_ends(machine: Machine) -> tuple[float, float]:
    """Return the offsets along the platform line of the spindle's top and of its nose, metres."""
    return machine.line_top, machine.tool_length - machine.bodies.shaft_end


def mounted(solids: Sequence[Solid], machine: Machine) -> tuple[Solid, ...]:
    """Return the shank and holder of a tool's solids, without their parts inside the spindle."""
    end, radius = machine.bodies.shaft_end, machine.bodies.shaft_radius
    kept: list[Solid] = []
    for solid in solids:
        inside = max(solid.low_radius, solid.high_radius) + solid.rounding <= radius
        if solid.kind == "cutter" or (inside and solid.low >= end):
            continue
        high = min(solid.high, end) if inside else solid.high
        share = (high - solid.low) / (solid.high - solid.low) if solid.high > solid.low else 1.0
        top = solid.low_radius + share * (solid.high_radius - solid.low_radius)
        kept.append(Solid(solid.kind, solid.low, high, solid.low_radius, top, solid.rounding))
    return tuple(kept)
