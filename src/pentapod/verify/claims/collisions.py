"""Claims that legs, spindle and tool body do not collide with part, fixture and table, nor legs with the tool."""

from __future__ import annotations

from functools import partial

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.solids import Solid
from pentapod.kinematics.robot import Poses
from pentapod.machine.clearance.collision_world import (
    TOOL_BODY,
    CollisionWorld,
    MovingBodies,
    Obstacle,
    spindle_ends,
)
from pentapod.machine.clearance.tool_clearance import leg_tool_gaps
from pentapod.machine.machine import Machine
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.clearance_bounds import Displacement, clearance_bound
from pentapod.verify.replay.replay import Replay

FAR_M, TOOL_FAR_M = 0.1, 0.01
"""Gaps are not computed beyond these, metres."""

_PROVEN = (
    "less the largest displacement of the platform until the next moment computed (fixed-point bound on the leg "
    "equations): proven for all times, if the component is kept"
)


def claims(collision_world: CollisionWorld | None, bars: int) -> tuple[Claim, ...]:
    """Return the claims for these surroundings of a machine with so many bars, in the order of the verdict."""
    if collision_world is None:
        return ()
    made: list[Claim] = []
    if collision_world.tool:
        made.append(Claim(f"legs clear of the {TOOL_BODY}", partial(_legs_and_tool, tool=collision_world.tool)))
    for obstacle in collision_world.obstacles:
        for title, columns in _groups(collision_world, bars):
            judge = partial(_clear, obstacle=obstacle, collision_world=collision_world, columns=columns)
            made.append(Claim(f"{title} clear of the {obstacle.name}", judge))
    return tuple(made)


def surroundings_given(replay: Replay) -> Idle:
    """Say that the surroundings are not given; where they are, each obstacle has claims of its own."""
    if replay.specification.collision_world is not None:
        return Idle("each obstacle has claims of its own")
    return Idle("the surroundings (part, fixture, table) are not given", unknown=True)


def _groups(collision_world: CollisionWorld, bars: int) -> tuple[tuple[str, list[int]], ...]:
    tool = ((TOOL_BODY, [bars + 1]),) if collision_world.tool else ()
    return (("legs", list(range(bars))), ("spindle", [bars]), *tool)


def _clear(replay: Replay, *, obstacle: Obstacle, collision_world: CollisionWorld, columns: list[int]) -> Finding:
    """Judge that some of the moving bodies do not touch one obstacle."""
    machine, bars = replay.machine, len(replay.machine.bars.names)
    frame = replay.program.placement if obstacle.clamped else None
    tool = collision_world.tool if bars + 1 in columns else ()
    bound = -obstacle.allowance if tool else 0.0

    def gaps(poses: Poses, far: float) -> Floats:
        bodies = MovingBodies.at(machine, *poses, frame)
        if tool:
            return obstacle.surface.bodies(tool, bodies.tips, bodies.axes, min(far, TOOL_FAR_M))[0][:, None]
        return bodies.only(columns).segments(obstacle.surface, min(far, FAR_M)).distance.reshape(-1, len(columns))

    offsets = line_offsets(machine, collision_world.tool)

    def approaches(displacement: Displacement) -> Floats:
        return body_displacements(displacement, collision_world.tool, bars)[:, columns]

    found = clearance_bound(replay, gaps, approaches, offsets, bound=bound)
    name, far = collision_world.names(machine)[columns[found.column]], TOOL_FAR_M if tool else FAR_M
    if found.gap > bound and _enclosed(replay, obstacle, frame, columns):
        inside = f"{name} is inside the {obstacle.name}"
        return Finding(False, None, MM * bound, "mm", replay.place(0), inside, at_least=True)
    method = f"{name} comes closest; exact distance of its body from the mesh, {_PROVEN}"
    if not found.proven:
        method = f"{name}: not proven; {method}"
    elif found.gap <= bound:
        method = f"{name} is in the {obstacle.name}; exact at this moment, it may be deeper elsewhere"
    elif found.gap >= 0.5 * far:
        method = f"nothing comes close; distances were computed up to {MM * far:g} mm; {_PROVEN}"
    where = replay.place(found.sample)
    return Finding(found.gap > bound, MM * found.gap, MM * bound, "mm", where, method, at_least=True)


def _legs_and_tool(replay: Replay, *, tool: tuple[Solid, ...]) -> Finding:
    """Judge that no leg touches shank or holder."""
    machine, bars = replay.machine, replay.machine.bars.names

    def gaps(poses: Poses, _far: float) -> Floats:
        return leg_tool_gaps(machine, tool, *poses)

    def approaches(displacement: Displacement) -> Floats:
        both = body_displacements(displacement, tool, len(bars))
        return both[:, : len(bars)] + both[:, len(bars) + 1 :]

    found = clearance_bound(replay, gaps, approaches, line_offsets(machine, tool))
    method = (
        f"{bars[found.column]} comes closest; distance of its body from shank and holder in the plane of leg and "
        f"tool axis, {_PROVEN}"
    )
    return Finding(found.gap > 0.0, MM * found.gap, 0.0, "mm", replay.place(found.sample), method, at_least=True)


def line_offsets(machine: Machine, tool: tuple[Solid, ...]) -> Floats:
    """Return the offsets along the platform line of joints, ends of the spindle, ends of the tool body, metres."""
    ends = [machine.tool_length - height for solid in tool for height in (solid.low, solid.high)]
    return np.array([*machine.bars.offsets, *spindle_ends(machine), *([min(ends), max(ends)] if ends else [])])


def body_displacements(displacement: Displacement, tool: tuple[Solid, ...], bars: int) -> Floats:
    """Return bounds (n, K) on the displacement of the bodies; points of a bar move no more than its platform joint.

    Of a leg with an arm: no more than its platform joint and the arm's foot. The passive limb's foot on its rail moves
    less than its platform joint.
    """
    line, joints = displacement.points, displacement.points[:, :bars].copy()
    if displacement.joints is not None:
        legs = displacement.joints.shape[1]
        joints[:, :legs] = np.maximum(joints[:, :legs], displacement.joints)
    moved = [joints, line[:, bars : bars + 2].max(axis=1, keepdims=True)]
    if tool:
        wide = max(solid.largest_radius for solid in tool)
        moved.append((line[:, bars + 2 :].max(axis=1) + wide * displacement.turn)[:, None])
    return np.concatenate(moved, axis=1)


def _enclosed(replay: Replay, obstacle: Obstacle, frame: RigidTransform | None, columns: list[int]) -> bool:
    """Return whether a body is inside at the start: one that never touches the surface stays on its side of it."""
    position, direction = (x[:1] for x in replay.pose)
    bodies = MovingBodies.at(replay.machine, position, direction, frame)
    points = np.concatenate([bodies.starts[0], bodies.tips])[columns]
    return bool(obstacle.surface.contains(points).any())


CLAIMS = (Claim("legs, spindle and tool clear of the surroundings", surroundings_given, needs_pose=False),)
"""Not judged where the surroundings are not given; `claims` makes the others."""
