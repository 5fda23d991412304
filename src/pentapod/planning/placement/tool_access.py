"""Tool access: the room that shank and holder have over the part, whatever the placement of the part.

Part and fixture move with the workpiece. So the gap between them and the tool depends on the waypoint and the lean of
the tool alone, and is computed once for all placements.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.directions import tangent_frame
from pentapod.machine.clearance.collision_world import CollisionWorld
from pentapod.planning.limits.contacts import OPTIONS, world_tool_comfort
from pentapod.planning.limits.limit import Comforts
from pentapod.planning.placement.sampling import tilts
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import lean


def tool_access(samples: ToolpathSamples, collision_world: CollisionWorld) -> Floats:
    """Return the largest margin (N,) of shank and holder from part and fixture at each waypoint, over the tilt cone.

    At most `ContactOptions.cap`. A placement of the path has no larger margins; so the smallest of these bounds what
    any search can find.
    """
    solids, centres = collision_world.tool, samples.tilt_centres
    clamped = [obstacle for obstacle in collision_world.obstacles if obstacle.clamped]
    best = np.full(len(centres), OPTIONS.cap)
    if not solids or not clamped:
        return best
    comfort = world_tool_comfort(collision_world, Comforts())
    open_ = np.arange(len(centres))
    best[:] = -np.inf
    for tilt in tilts(samples.tilt):
        if not len(open_):
            break
        nominal = samples.nominal[open_]
        first, second = tangent_frame(nominal)
        axes = lean(nominal, samples.room(open_)[:, None] * (tilt[0] * first + tilt[1] * second))
        tips, room = centres[open_] - samples.tilt_centre * axes, np.full(len(open_), OPTIONS.cap)
        for obstacle in clamped:
            gaps, _ = obstacle.surface.bodies(solids, tips, axes, OPTIONS.cap * comfort)
            room = np.minimum(room, (gaps + obstacle.allowance) / comfort)
        best[open_] = np.maximum(best[open_], room)
        open_ = open_[best[open_] < OPTIONS.cap]
    return best
