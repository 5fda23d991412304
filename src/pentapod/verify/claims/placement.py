"""Claim that the part stands where the job allows, by the placement of the program's header."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.rigid import RigidTransform
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay
from pentapod.verify.verdict.verdict import Place

POSITION, ANGLE = 1e-6, 1e-6
"""How far, metres and radians, a placement may be off one that is allowed: job files round both."""


def placement(replay: Replay) -> Finding | Idle:
    """Judge that the header's placement is one that the job allows."""
    constraints, placed = replay.specification.constraints, replay.program.placement
    if constraints is None:
        return Idle("nobody told where the part may stand", unknown=True)
    if constraints.poses:
        offs = [(_distance(placed, pose), _angle(placed.rotation, pose.rotation)) for pose in constraints.poses]
        away, turned = min(offs, key=_excess)
        what = f"of {len(offs)} allowed placements the nearest"
    else:
        beyond = placed.translation - np.clip(placed.translation, constraints.low, constraints.high)
        away, turned = float(np.linalg.norm(beyond)), _turned(placed.rotation, constraints)
        what = "the placements that the box, the table and the largest turn allow"
    passed = away <= POSITION and turned <= ANGLE
    method = (
        f"header's placement against {what}: the origin is off by {MM * away:.6g} mm, {MM * POSITION:g} mm allowed; "
        f"the rotation by {np.degrees(turned):.6g} deg, {np.degrees(ANGLE):.2g} deg allowed"
    )
    if turned / ANGLE > away / POSITION:
        return Finding(passed, np.degrees(turned), np.degrees(ANGLE), "deg", Place(), method)
    return Finding(passed, MM * away, MM * POSITION, "mm", Place(), method)


def _excess(off: tuple[float, float]) -> float:
    return max(off[0] / POSITION, off[1] / ANGLE)


def _distance(a: RigidTransform, b: RigidTransform) -> float:
    return float(np.linalg.norm(a.translation - b.translation))


def _angle(a: Floats, b: Floats) -> float:
    """Return the angle between rotations (3, 3), radians; exact for small ones as for half turns."""
    difference = a.T @ b
    skew = difference - difference.T
    sine = 0.5 * float(np.linalg.norm([skew[2, 1], skew[0, 2], skew[1, 0]]))
    return float(np.arctan2(sine, 0.5 * (np.trace(difference) - 1.0)))


def _turned(rotation: Floats, constraints: PlacementConstraints) -> float:
    """Return by how much a rotation (3, 3) is beyond what a table or a largest turn allows, radians."""
    beyond = 0.0
    if constraints.turn_is_bounded:
        beyond = max(_angle(rotation, constraints.reference) - constraints.largest_turn, 0.0)
    if constraints.upright.any():
        up = rotation @ constraints.upright
        sine = float(np.linalg.norm(np.cross(up, constraints.normal)))
        beyond = max(beyond, float(np.arctan2(sine, up @ constraints.normal)))
    return beyond


CLAIMS = (Claim("placement as the job asks", placement, needs_pose=False),)
