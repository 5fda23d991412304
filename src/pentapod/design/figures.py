"""Figures of a design in given poses: lengths, angles, clearances, forces."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.design.geometry import Geometry
from pentapod.geometry.directions import tangent_frame
from pentapod.machine.clearance.leg_clearance import segment_distance


def in_poses(design: Geometry, axes: Floats, tips: Floats, directions: Floats) -> dict[str, Floats]:
    """Return the figures of a design that depend on the pose, by name, the worst over legs in each pose (N,); SI.

    axes (n, 3): of the base joints' cones. tips, directions (N, 3): platform directions, from the spindle to the tip.
    """
    feet, levers, bodies = design.feet, design.levers, design.bodies
    joints = tips[:, None] + levers[:, None] * directions[:, None]
    legs = joints - feet
    length = np.sqrt(np.einsum("nki,nki->nk", legs, legs))
    unit = legs / length[..., None]
    cosine = np.einsum("nki,ni->nk", unit, directions)
    platform = np.arccos(np.clip(cosine, -1.0, 1.0))
    a, b = np.array(list(combinations(range(len(levers)), 2))).T
    apart = segment_distance(feet[a], joints[:, a], feet[b], joints[:, b]) - 2.0 * bodies.leg_radius
    shaft = shaft_distance(design, cosine) - bodies.leg_radius - bodies.shaft_radius
    force = leg_forces(unit, levers, directions)
    gram = np.einsum("nki,nkj->nij", force, force)
    values = {
        "shortest_leg": length.min(axis=1),
        "longest_leg": length.max(axis=1),
        "base_cone": np.arccos(np.clip(np.einsum("nki,ki->nk", unit, axes), -1.0, 1.0)).max(axis=1),
        "platform_least": platform.min(axis=1),
        "platform_most": platform.max(axis=1),
        "leg_clearance": apart.min(axis=1),
        "shaft_clearance": shaft.min(axis=1),
        "top": tips[:, 2] + levers.min() * directions[:, 2],
        "amplification": np.sqrt(np.maximum(np.linalg.eigvalsh(gram)[:, -1], 0.0)),
        "sensitivity": np.sqrt(np.einsum("nki,nki->nk", force, force).max(axis=1)),
    }
    if design.delta is not None:
        values["singular_distance"] = singular_distance(design.delta, legs[:, 2], directions)
    return values


def singular_distance(delta: float, leg: Floats, direction: Floats) -> Floats:
    """Return how far (N,) a pose of the quadratic family can shift before S = 0; leg (N, 3): the vector of leg 3."""
    u, w = direction[:, 0], direction[:, 2]
    across, along = delta * w, 1.0 - delta * u
    return np.asarray((across * leg[:, 0] + along * leg[:, 2]) / np.hypot(across, along), dtype=np.float64)


def shaft_distance(design: Geometry, cosine: Floats) -> Floats:
    """Return the distance (..., n) of legs from the shaft's axis, from the cosine of leg and platform direction.

    In the plane of leg and line. A leg counts up to `joint_radius` from its platform joint; the distance falls with the
    size of the cosine.
    """
    near, offsets = design.bodies.joint_radius, design.offsets
    up, down = offsets - offsets.min(), design.tool_length - design.bodies.shaft_end - offsets
    along = near * cosine
    beyond = np.maximum(0.0, np.maximum(along - up, -along - down))
    return np.sqrt(np.maximum(near * near - along * along, 0.0) + beyond * beyond)


def wrenches(unit: Floats, levers: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """Return the matrices (N, n, n) from leg forces to force and moment at the tip, and two tangents (N, 2, 3).

    Rows: the force, and the moment about the tip along the tangents. unit (N, n, 3): of the legs.
    """
    tangents = np.stack(tangent_frame(direction), axis=-2)
    across = np.cross(tangents, direction[:, None, :])
    moments = levers * np.einsum("nai,nki->nak", across, unit)
    return np.concatenate([np.swapaxes(unit, 1, 2), moments], axis=1), tangents


def leg_forces(unit: Floats, levers: Floats, direction: Floats) -> Floats:
    """Return the map (N, n, 3) from a force on the tip, without a moment, to the leg forces; very large if singular."""
    matrices, _ = wrenches(unit, levers, direction)
    matrices = matrices + 1e-12 * np.eye(len(levers))  # a singular one has no solution
    found = np.linalg.solve(matrices, np.eye(len(levers))[:, :3])
    return np.asarray(np.clip(found, -1e9, 1e9), dtype=np.float64)
