"""Tool access: the room that shank and holder have over the part, whatever the placement of the part.

Part and fixture move with the workpiece. So the gap between them and the tool depends on the waypoint and on the lean
of the tool alone, and is computed once for all placements.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.directions import tangent_frame
from pentapod.machine.clearance.collision_world import CollisionWorld
from pentapod.planning.limits.contacts import OPTIONS, tool_gap, world_tool_comfort
from pentapod.planning.limits.limit import Comforts, Scene
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import lean, tilts


def tool_gaps(samples: ToolpathSamples, scene: Scene) -> Floats | None:
    """Return the gaps (K, N, obstacles) of shank and holder at the tilts (K) of a grid over the cone, metres.

    NaN for obstacles that do not move with the workpiece; None where nothing is known without a placement.
    """
    world = scene.collision_world
    if not world.tool or not any(obstacle.clamped for obstacle in world.obstacles):
        return None
    cap = OPTIONS.cap * world_tool_comfort(world, scene.comforts)
    grid, count = tilts(samples.tilt), len(samples.tilt_centres)
    gaps = np.full((len(grid), count, len(world.obstacles)), np.nan)
    for k, tilt in enumerate(grid):
        axes = _axes(samples, tilt)
        tips = samples.tilt_centres - samples.tilt_centre * axes
        for column, obstacle in enumerate(world.obstacles):
            if obstacle.clamped:
                gaps[k, :, column] = tool_gap(obstacle, world.tool, tips, axes, cap)
    return gaps


def tool_access(samples: ToolpathSamples, world: CollisionWorld) -> Floats:
    """Return the largest margin (N,) of shank and holder from part and fixture at each waypoint, over the tilt cone.

    At most `ContactOptions.cap`. A placement of the path has no larger margins; so the smallest of these bounds what
    any search can find.
    """
    clamped = [obstacle for obstacle in world.obstacles if obstacle.clamped]
    if not world.tool or not clamped:
        return np.full(len(samples.tilt_centres), OPTIONS.cap)
    comfort = world_tool_comfort(world, Comforts())
    best, rows = np.full(len(samples.tilt_centres), -np.inf), np.arange(len(samples.tilt_centres))
    for tilt in tilts(samples.tilt):
        few = samples.at(rows)
        axes = _axes(few, tilt)
        tips = few.tilt_centres - few.tilt_centre * axes
        gaps = [tool_gap(obstacle, world.tool, tips, axes, OPTIONS.cap * comfort) for obstacle in clamped]
        best[rows] = np.maximum(best[rows], np.min(gaps, axis=0) / comfort)
        rows = rows[best[rows] < OPTIONS.cap]
        if not len(rows):
            break
    return best


def _axes(samples: ToolpathSamples, tilt: Floats) -> Floats:
    """Return the axes (N, 3) with the same tilt (2,), in units of the cone, everywhere."""
    first, second = tangent_frame(samples.nominal)
    return lean(samples.nominal, samples.room(slice(None))[:, None] * (tilt[0] * first + tilt[1] * second))
