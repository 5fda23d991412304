"""Contacts: signed distances of moving bodies from meshes, and the point pairs that give their derivatives.

Gaps are exact distances. A contact is a point on a body's line (a leg, the tool axis), the radius of the body there,
and the nearest mesh point with its normal. The distance of that ball from the plane through the mesh point is a formula
of the pose; at the pose of the contact its value and first derivatives are those of the true gap. The solvers use this
formula, and every step is judged by the true gaps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints, row_maxima
from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.solids import Solid
from pentapod.machine.clearance.collision_world import (
    CollisionWorld,
    MovingBodies,
    Obstacle,
    spindle_ends,
)
from pentapod.machine.machine import Machine
from pentapod.planning.limits.limit import Comforts, Scene

NUMBERS = 8
"""Numbers of a contact: place on the body's line, normal (3), mesh point (3), radius of the ball."""


@dataclass(frozen=True)
class ContactOptions:
    """cap: larger margins are not computed. flat: sine of the angle to the axis below which a face counts as flat."""

    cap: float = 1.2
    flat: float = 1e-3


OPTIONS = ContactOptions()


@dataclass(frozen=True, eq=False)
class Contacts:
    """Margins (N, C) of poses, and the numbers (N, C · NUMBERS) of their contacts; C: all bodies by obstacle.

    Where only margins were asked for, the numbers of the tool body are those of no contact.
    """

    margins: Floats
    numbers: Floats


def body_comforts(scene: Scene) -> tuple[float, ...]:
    """Return the gaps (K,) in metres that count as margin 1, in the order of `CollisionWorld.names`."""
    comforts = scene.comforts
    tool = (world_tool_comfort(scene.collision_world, comforts),) if scene.collision_world.tool else ()
    return (*[comforts.leg_obstacle] * len(scene.machine.bars.names), comforts.spindle_obstacle, *tool)


def world_tool_comfort(collision_world: CollisionWorld, comforts: Comforts) -> float:
    """Return `tool_comfort` of the shank and holder of a collision world."""
    allowance = max((obstacle.allowance for obstacle in collision_world.obstacles), default=0.0)
    return tool_comfort(collision_world.tool, allowance, comforts)


def tool_comfort(solids: Sequence[Solid], allowance: float, comforts: Comforts) -> float:
    """Return the gap in metres from an obstacle that counts as margin 1 for shank and holder.

    allowance: depth, metres, that they may be in the part.
    """
    allowed = comforts.tool_allowances * allowance if allowance > 0.0 else np.inf
    thinnest = min(solid.largest_radius for solid in solids)
    return min(comforts.tool_obstacle, comforts.tool_share * thinnest, allowed)


def contacts(
    scene: Scene,
    tips: Floats,
    axes: Floats,
    placement: RigidTransform,
    *,
    numbers: bool = True,
    gaps: Floats | None = None,
    enough: float = OPTIONS.cap,
) -> Contacts:
    """Return the contacts of tool poses (N, 3), machine frame, with the workpiece placed.

    numbers: False for the margins alone, which takes less time. gaps (N, obstacles): of the tool body, as `tool_gap`,
    where they are known; used for margins alone. NaN for obstacles of the machine. enough: larger margins are given as
    this one, which takes less time.
    """
    cap = min(enough, OPTIONS.cap)
    machine, tool, obstacles = scene.machine, scene.collision_world.tool, scene.collision_world.obstacles
    position, direction = tips + machine.tool_length * axes, -axes
    comforts = body_comforts(scene)
    comfortable, moving = np.tile(comforts, len(obstacles)), len(comforts)
    both = np.zeros((len(tips), len(comfortable), 1 + NUMBERS))
    both[..., 0], both[..., -1] = cap * comfortable, -cap * comfortable
    for k, obstacle in enumerate(obstacles):
        frame = placement if obstacle.clamped else None
        rows = _near(scene, obstacle, tips, axes, frame, cap)
        if not len(rows):
            continue
        bodies = MovingBodies.at(machine, position[rows], direction[rows], frame)
        columns = _lines(machine, obstacle, bodies, comforts, cap)
        if tool:
            reach, known = cap * comforts[-1], None
            if gaps is not None and not numbers and obstacle.clamped:
                known = _with_gaps(gaps[rows, k], reach)
            columns.append(_tool(obstacle, tool, bodies, reach, numbers=numbers) if known is None else known)
        both[rows, k * moving : (k + 1) * moving] = np.stack(columns, axis=1)
    return Contacts(both[..., 0] / comfortable, both[..., 1:].reshape(len(tips), NUMBERS * len(comfortable)))


def _lines(
    machine: Machine, obstacle: Obstacle, bodies: MovingBodies, comforts: Sequence[float], cap: float
) -> list[Floats]:
    """Return for legs and spindle the gaps, up to margins `cap`, and the numbers of their contacts, (N, 1 + NUMBERS).

    Places: from 0 to 1 along a leg, from 1 to 2 along its arm; along the spindle, heights over the tip.
    """
    top, nose = (machine.tool_length - offset for offset in spindle_ends(machine))
    columns, bars = list[Floats](), len(machine.bars.names)
    for body in range(bars + 1):
        radius, reach = float(bodies.radii[body]), cap * comforts[body]
        places = (0.0, 1.0) if body < bars else (top, nose)
        column = _column(obstacle, bodies.starts[:, body], bodies.ends[:, body], radius, reach, places)
        if bodies.arms[body]:
            arm = _column(obstacle, bodies.ends[:, body], bodies.feet[:, body], radius, reach, (1.0, 2.0))
            column = np.where((arm[:, 0] < column[:, 0])[:, None], arm, column)
        columns.append(column)
    return columns


def _column(
    obstacle: Obstacle, starts: Floats, ends: Floats, radius: float, cap: float, places: tuple[float, float]
) -> Floats:
    """Return the gaps of one line (N, 3) and the numbers of its contacts (N, 1 + NUMBERS); places: of its ends."""
    column = np.zeros((len(starts), 1 + NUMBERS))
    column[:, 0], column[:, -1] = cap, -cap
    rows = np.flatnonzero(_box_gap(obstacle, starts, ends) < cap + radius)
    if not len(rows):
        return column
    starts, ends, (first, last) = starts[rows], ends[rows], places
    found = obstacle.surface.segments(starts, ends, cap + radius)
    near = found.distance < cap + radius
    at = starts + found.place[:, None] * (ends - starts)
    place = found.place if places == (0.0, 1.0) else first + found.place * (last - first)
    # Without a normal the gap is taken as constant.
    known, gap = found.normal.any(axis=1), found.distance - radius
    numbers = (gap, place, *found.normal.T, *(at - found.distance[:, None] * found.normal).T)
    exact = np.column_stack([*numbers, np.where(known, radius, -gap)])
    column[rows[near]] = exact[near]
    return column


def _near(
    scene: Scene, obstacle: Obstacle, tips: Floats, axes: Floats, frame: RigidTransform | None, cap: float
) -> Ints:
    """Return the indices of those poses (N, 3) in which a body's box may be nearer than `cap` to the obstacle's."""
    machine, tool, comforts = scene.machine, scene.collision_world.tool, scene.comforts
    bars, bodies = machine.bars, machine.bodies
    position, arms = tips + machine.tool_length * axes, np.flatnonzero(bars.beside).tolist()
    base, joints = bars.ends(position, -axes)
    feet = {k: position - bars.offsets[k] * axes for k in arms}
    if frame is not None:
        back = frame.inverse()
        tips, axes, base, joints = back.apply(tips), back.rotate(axes), back.apply(base), back.apply(joints)
        feet = {k: back.apply(foot) for k, foot in feet.items()}
    top, nose = (machine.tool_length - offset for offset in spindle_ends(machine))
    lines = [(base[:, k], joints[:, k]) for k in range(joints.shape[1])]
    lines += [(joints[:, k], foot) for k, foot in feet.items()]
    reaches = [cap * comforts.leg_obstacle + float(bars.radii.max())] * len(lines)
    lines.append((tips + nose * axes, tips + top * axes))
    reaches.append(cap * comforts.spindle_obstacle + bodies.shaft_radius)
    if tool:
        least, most = min(s.low - s.rounding for s in tool), max(s.top for s in tool)
        lines.append((tips + least * axes, tips + most * axes))
        wide = max(max(s.low_radius, s.high_radius) + s.rounding for s in tool)
        reaches.append(cap * comforts.tool_obstacle + wide)
    near = np.zeros(len(tips), dtype=np.bool_)
    for (a, b), reach in zip(lines, reaches, strict=True):
        near |= _box_gap(obstacle, a, b) < reach
    return np.flatnonzero(near)


def _box_gap(obstacle: Obstacle, starts: Floats, ends: Floats) -> Floats:
    """Return the gaps (M,), largest coordinate, between the boxes of segments (M, 3) and the obstacle's box."""
    low, high = obstacle.surface.bounds
    return row_maxima(np.maximum(np.minimum(starts, ends) - high, low - np.maximum(starts, ends)))


def tool_gap(obstacle: Obstacle, solids: tuple[Solid, ...], tips: Floats, axes: Floats, cap: float) -> Floats:
    """Return the gaps (N,), at most `cap`, of tool bodies from an obstacle; tips, axes (N, 3): in its frame."""
    return np.minimum(obstacle.surface.bodies(solids, tips, axes, cap)[0] + obstacle.allowance, cap)


def _with_gaps(gaps: Floats, cap: float) -> Floats:
    """Return gaps (N,) with the numbers of no contact, (N, 1 + NUMBERS)."""
    column = np.zeros((len(gaps), 1 + NUMBERS))
    column[:, 0], column[:, -1] = gaps, -cap
    return column


def _tool(obstacle: Obstacle, solids: tuple[Solid, ...], bodies: MovingBodies, cap: float, *, numbers: bool) -> Floats:
    """Return for the tool body the gaps, at most `cap`, and the numbers of its contacts (N, 1 + NUMBERS)."""
    from pentapod.mesh.query.kernels.body_kernels import normals_of_all  # noqa: PLC0415  loads numba

    gaps, points = obstacle.surface.bodies(solids, bodies.tips, bodies.axes, cap)
    gaps = np.minimum(gaps + obstacle.allowance, cap)
    column = _with_gaps(gaps, cap)
    if not numbers:
        return column
    rows = np.flatnonzero(np.isfinite(points[:, 0]) & (gaps < cap))
    tips, axes, points = bodies.tips[rows], bodies.axes[rows], points[rows]
    outward = np.zeros_like(points)  # from the body to the mesh point
    normals_of_all(np.array([solid.numbers for solid in solids]), tips, axes, points, outward)
    height, along = np.einsum("ij,ij->i", points - tips, axes), np.einsum("ij,ij->i", outward, axes)
    across = points - tips - height[:, None] * axes
    aside = np.linalg.norm(across, axis=1)
    # The line along it meets the axis in the centre of the ball.
    sine = np.einsum("ij,ij->i", outward, across) / np.where(aside > 0.0, aside, 1.0)
    place = height - aside / np.maximum(sine, OPTIONS.flat) * along
    reach = np.einsum("ij,ij->i", outward, points - tips - place[:, None] * axes)
    column[rows, 1:] = np.column_stack([place, -outward, points, reach - gaps[rows]])
    return column
