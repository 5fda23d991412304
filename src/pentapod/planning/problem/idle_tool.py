"""Idle tool bodies: shank and holder that stay far from everything, however the tool leans, are no limits of a problem.

Over most convex parts the stem of a cutter is idle. Its margins would then be constant, and only cost time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.geometry.solids import Solid
from pentapod.kinematics.arithmetic import NUMPY
from pentapod.machine.clearance.collision_world import CollisionWorld
from pentapod.machine.clearance.tool_clearance import leg_tool_gap
from pentapod.machine.machine import Machine
from pentapod.mesh.query.swept_depth import TouchingBody, is_clear
from pentapod.planning.limits.contacts import OPTIONS, world_tool_comfort
from pentapod.planning.limits.limit import Comforts
from pentapod.planning.problem.samples import ToolpathSamples


@dataclass(frozen=True)
class IdleToolOptions:
    """angles: of a leg at its platform joint that are tried."""

    angles: int = 2001


def without_idle_tool(
    collision_world: CollisionWorld,
    machine: Machine,
    samples: ToolpathSamples,
    options: IdleToolOptions = IdleToolOptions(),
) -> CollisionWorld:
    """Return a collision world without the tool's shank and holder, where no pose can bring them near a limit.

    They must keep their comfortable distances on the whole path with the tool leaning anywhere within its cone: from
    all obstacles, none of which may stand in the machine's frame. The margins of the platform joints must be smaller
    than those of legs from the tool.
    """
    solids, obstacles, comforts = collision_world.tool, collision_world.obstacles, Comforts()
    if not solids or not all(obstacle.clamped for obstacle in obstacles):
        return collision_world
    if any(solid.low - solid.rounding < samples.tilt_centre for solid in solids):
        return collision_world
    if not joints_are_nearer(machine, solids, options):
        return collision_world
    body = TouchingBody(tuple(leaning(solid, samples) for solid in solids), samples.tilt_centre)
    gap = OPTIONS.cap * world_tool_comfort(collision_world, comforts)
    tips = samples.tilt_centres - samples.tilt_centre * samples.nominal
    clear = all(is_clear(o.surface.tree, body, tips, samples.nominal, threshold=o.allowance - gap) for o in obstacles)
    return replace(collision_world, tool=()) if clear else collision_world


def leaning(solid: Solid, samples: ToolpathSamples) -> Solid:
    """Return a solid of revolution about the nominal axis that holds a solid wherever the tool leans."""
    centre, tilt, radius = samples.tilt_centre, samples.tilt, solid.largest_radius
    low, high = solid.low - solid.rounding - centre, solid.top - centre
    bottom, top = low * np.cos(tilt) - radius * np.sin(tilt), float(np.hypot(high, radius))
    at_bottom = radius * np.cos(tilt) + low * np.sin(tilt)
    at_top = at_bottom + (top - bottom) * np.tan(tilt)
    return Solid(solid.kind, centre + float(bottom), centre + top, float(at_bottom), float(at_top))


def joints_are_nearer(
    machine: Machine, solids: tuple[Solid, ...], options: IdleToolOptions = IdleToolOptions()
) -> bool:
    """Return whether a leg's margin from solids of the tool is never below that of its platform joint, or 1."""
    comfort = Comforts().tool
    if machine.robot.arms.any():  # the angle at the joint of a leg beside the line tells nothing of its gap
        return False
    for leg, (low, high) in enumerate(machine.joints.platform_range):
        angles, length = np.linspace(low, high, options.angles), float(machine.legs.max_length[leg])
        cosines = np.cos(angles)
        # The longest leg is nearest. Between two angles none of its points moves further than half a step.
        gaps = leg_tool_gap(machine, solids, leg, cosines, np.full(len(angles), length), NUMPY)
        gaps = gaps - 0.5 * length * float(angles[1] - angles[0])
        room = np.minimum(cosines - cosines[-1], cosines[0] - cosines) / (0.5 * (cosines[0] - cosines[-1]))
        if (gaps / comfort < np.minimum(room, 1.0)).any():
            return False
    return True
