"""Tolerances of the leg path near obstacles: a motion beside the path keeps shank and holder clear of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.directions import normalised
from pentapod.machine.clearance.collision_world import CollisionWorld, Obstacle
from pentapod.planning.placement.placed_path import PlacedPath


@dataclass(frozen=True)
class BesideOptions:
    """How much of the room between tool body and obstacle the motion may use.

    path, axis: shares of it for the way of the tilt centre and for the turn of the axis. least: share of either
    tolerance that is left everywhere. between: places between two waypoints at which the room is looked at.
    """

    path: float = 0.4
    axis: float = 0.4
    least: float = 0.05
    between: int = 1


def tolerances_beside(
    placed: PlacedPath,
    collision_world: CollisionWorld,
    path_tolerance: float,
    axis_tolerance: float,
    options: BesideOptions = BesideOptions(),
) -> tuple[Floats, Floats]:
    """Return the tolerances of path and axis at each waypoint (N,), metres and radians, for `leg_path`.

    They are those given, but where shank or holder have less room than such a motion might use. A turn of the axis
    moves what of the tool is beside an obstacle by as much as that rises above the tilt centre.
    """
    paths, axes = np.full(len(placed.tips), path_tolerance), np.full(len(placed.tips), axis_tolerance)
    if not collision_world.tool:
        return paths, axes
    top = max(solid.top for solid in collision_world.tool) - placed.toolpath.tilt_centre
    for obstacle in collision_world.obstacles:
        frame = placed.placement.transform.inverse() if obstacle.clamped else None
        centres = placed.tilt_centres if frame is None else frame.apply(placed.tilt_centres)
        directions = placed.axes if frame is None else frame.rotate(placed.axes)
        lever = np.clip(_rise(obstacle, centres, directions), 0.0, top)
        most = path_tolerance / options.path + axis_tolerance * lever / options.axis
        room = _room(obstacle, collision_world, placed.toolpath.tilt_centre, (centres, directions), most, options)
        paths = np.minimum(paths, options.path * room)
        axes = np.minimum(axes, options.axis * room / np.maximum(lever, 1e-12))
    return np.maximum(paths, options.least * path_tolerance), np.maximum(axes, options.least * axis_tolerance)


def _rise(obstacle: Obstacle, centres: Floats, directions: Floats) -> Floats:
    """Return how far (N,) an obstacle's box rises above tilt centres along unit axes (N, 3), all in its frame."""
    low, high = obstacle.surface.bounds
    return (np.where(directions > 0.0, high, low) * directions).sum(axis=1) - (centres * directions).sum(axis=1)


def _room(
    obstacle: Obstacle,
    collision_world: CollisionWorld,
    tilt_centre: float,
    poses: tuple[Floats, Floats],
    most: Floats,
    options: BesideOptions,
) -> Floats:
    """Return the least room (N,) of the tool body at each waypoint and on the way to its neighbours, at most `most`."""
    share = np.linspace(0.0, 1.0, options.between + 2)[:-1]
    at, axes = (
        np.concatenate([(each[:-1, None] + share[:, None] * np.diff(each, axis=0)[:, None]).reshape(-1, 3), each[-1:]])
        for each in poses
    )
    axes = normalised(axes)
    gaps = obstacle.surface.bodies(collision_world.tool, at - tilt_centre * axes, axes, float(most.max()))[0]
    room = np.maximum(gaps + obstacle.allowance, 0.0)
    own, ways = room[:: len(share)], room[:-1].reshape(-1, len(share))[:, 1:].min(axis=1, initial=np.inf)
    return np.minimum.reduce([own, np.append(ways, np.inf), np.insert(ways, 0, np.inf), most])
