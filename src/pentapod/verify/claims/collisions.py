"""Claims that legs, spindle and tool body keep clear of the part, its fixture and the table, and legs of the tool."""

from __future__ import annotations

from functools import partial

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.solids import Solid
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
from pentapod.verify.replay.clearance_bounds import Stray, approach
from pentapod.verify.replay.replay import Replay

_FAR_M, _TOOL_FAR_M = 0.1, 0.01
"""Gaps are not looked at beyond these: farther is as good."""

_PROVEN = (
    "less what the platform can move until the next moment looked at, by the leg equations (Banach): for all times, as "
    "long as the component is kept"
)


def claims(collision_world: CollisionWorld | None, legs: int) -> tuple[Claim, ...]:
    """Return the claims about these surroundings of a machine with so many legs, in the order of a verdict; or none."""
    if collision_world is None:
        return ()
    made: list[Claim] = []
    if collision_world.tool:
        made.append(Claim(f"legs clear of the {TOOL_BODY}", partial(_legs_and_tool, tool=collision_world.tool)))
    for obstacle in collision_world.obstacles:
        for title, columns in _groups(collision_world, legs):
            judge = partial(_clear, obstacle=obstacle, collision_world=collision_world, columns=columns)
            made.append(Claim(f"{title} clear of the {obstacle.name}", judge))
    return tuple(made)


def told(replay: Replay) -> Idle:
    """Judge nothing but whether the surroundings are known: each of them has claims of its own."""
    known = replay.specification.collision_world is not None
    return Idle("there is nothing more") if known else Idle("nobody told what is there", unknown=True)


def _groups(collision_world: CollisionWorld, legs: int) -> tuple[tuple[str, list[int]], ...]:
    tool = ((TOOL_BODY, [legs + 1]),) if collision_world.tool else ()
    return (("legs", list(range(legs))), ("spindle", [legs]), *tool)


def _clear(replay: Replay, *, obstacle: Obstacle, collision_world: CollisionWorld, columns: list[int]) -> Finding:
    """Judge that some of what moves keeps clear of one obstacle."""
    machine, legs = replay.machine, replay.machine.robot.n_legs
    frame = replay.program.placement if obstacle.clamped else None
    tool = collision_world.tool if legs + 1 in columns else ()
    bound = -obstacle.allowance if tool else 0.0

    def gaps(samples: Ints) -> Floats:
        position, direction = (x[samples] for x in replay.pose)
        bodies = MovingBodies.at(machine, position, direction, frame)
        if tool:
            return obstacle.surface.bodies(tool, bodies.tips, bodies.axes, _TOOL_FAR_M)[0][:, None]
        chosen = MovingBodies(
            bodies.starts[:, columns], bodies.ends[:, columns], bodies.tips, bodies.axes, bodies.radii[columns]
        )
        return chosen.segments(obstacle.surface, _FAR_M).distance.reshape(-1, len(columns))

    offsets = line_offsets(machine, collision_world.tool)
    found = approach(
        replay, gaps, lambda stray: body_moves(stray, collision_world.tool, legs)[:, columns], offsets, bound=bound
    )
    name, most = collision_world.names(legs)[columns[found.column]], _TOOL_FAR_M if tool else _FAR_M
    if found.least > bound and _enclosed(replay, obstacle, frame, columns):
        return Finding(False, None, MM * bound, "mm", replay.place(0), f"{name} is inside the {obstacle.name}")
    method = f"{name} comes closest; exact distance of its body from the mesh's facets, {_PROVEN}"
    if not found.proven:
        method = f"{name}: not proven; {method}"
    elif found.least <= bound:
        method = f"{name} is in the {obstacle.name}; exact at this moment, others may be worse"
    elif found.least >= 0.5 * most:
        method = f"nothing comes near; distances were looked at up to {MM * most:g} mm; {_PROVEN}"
    value = MM * found.least
    return Finding(found.least > bound, value, MM * bound, "mm", replay.place(found.sample), method)


def _legs_and_tool(replay: Replay, *, tool: tuple[Solid, ...]) -> Finding:
    """Judge that no leg touches shank or holder."""
    machine, legs = replay.machine, replay.machine.robot.n_legs

    def gaps(samples: Ints) -> Floats:
        position, direction = (x[samples] for x in replay.pose)
        return leg_tool_gaps(machine, tool, position, direction)

    def moves(stray: Stray) -> Floats:
        both = body_moves(stray, tool, legs)
        return both[:, :legs] + both[:, legs + 1 :]

    found = approach(replay, gaps, moves, line_offsets(machine, tool))
    method = (
        f"leg {found.column + 1} comes closest; distance of its body from shank and holder in the plane of leg and "
        f"tool axis, {_PROVEN}"
    )
    return Finding(found.least > 0.0, MM * found.least, 0.0, "mm", replay.place(found.sample), method)


def line_offsets(machine: Machine, tool: tuple[Solid, ...]) -> Floats:
    """Return the offsets along the platform line that bodies move by: joints, spindle's ends, tool body's ends."""
    ends = [machine.tool_length - height for solid in tool for height in (solid.low, solid.high)]
    return np.array([*machine.robot.offsets, *spindle_ends(machine), *([min(ends), max(ends)] if ends else [])])


def body_moves(stray: Stray, tool: tuple[Solid, ...], legs: int) -> Floats:
    """Return by how much (n, K) the bodies move at most: a point of a leg never more than its platform joint."""
    line = stray.line
    moved = [line[:, :legs], line[:, legs : legs + 2].max(axis=1, keepdims=True)]
    if tool:
        wide = max(max(s.low_radius, s.high_radius) + s.rounding for s in tool)
        moved.append((line[:, legs + 2 :].max(axis=1) + wide * stray.turn)[:, None])
    return np.concatenate(moved, axis=1)


def _enclosed(replay: Replay, obstacle: Obstacle, frame: RigidTransform | None, columns: list[int]) -> bool:
    """Return whether a body is wholly inside, at the start: one that never touches the surface stays on its side."""
    position, direction = (x[:1] for x in replay.pose)
    bodies = MovingBodies.at(replay.machine, position, direction, frame)
    points = np.concatenate([bodies.starts[0], bodies.tips])[columns]
    return bool(obstacle.surface.contains(points).any())


CLAIMS = (Claim("legs, spindle and tool clear of the surroundings", told, needs_pose=False),)
"""One that stands for all where nobody told the surroundings; `claims` makes the others."""
