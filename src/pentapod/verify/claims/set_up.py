"""Claims on the set-up: that the job allows its placement, and that all set-ups together do the whole job."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay
from pentapod.verify.verdict.verdict import Place

POSITION, ANGLE = 1e-6, 1e-6
"""Tolerances of a placement, metres and radians: job files round both."""


def placement(replay: Replay) -> Finding | Idle:
    """Judge that the header's placement is allowed."""
    constraints, placed = replay.specification.constraints, replay.program.placement
    if constraints is None:
        return Idle("the allowed placements are not given", unknown=True)
    if constraints.poses:
        offs = [
            (float(np.linalg.norm(placed.translation - pose.translation)), _angle(placed.rotation, pose.rotation))
            for pose in constraints.poses
        ]
        shift, turn = min(offs, key=_excess)
        what = f"the nearest of {len(offs)} allowed placements"
    else:
        beyond = placed.translation - np.clip(placed.translation, constraints.low, constraints.high)
        shift, turn = float(np.linalg.norm(beyond)), _turned(placed.rotation, constraints)
        what = "the placements that the box, the table and the largest rotation allow"
    passed = shift <= POSITION and turn <= ANGLE
    method = (
        f"placement in the header compared with {what}: the origin is off by {MM * shift:.6g} mm, {MM * POSITION:g} mm "
        f"allowed; the rotation by {np.degrees(turn):.6g} deg, {np.degrees(ANGLE):.2g} deg allowed"
    )
    if turn / ANGLE > shift / POSITION:
        return Finding(passed, np.degrees(turn), np.degrees(ANGLE), "deg", Place(), method)
    return Finding(passed, MM * shift, MM * POSITION, "mm", Place(), method)


def _excess(off: tuple[float, float]) -> float:
    return max(off[0] / POSITION, off[1] / ANGLE)


def _angle(a: Floats, b: Floats) -> float:
    """Return the angle between rotations (3, 3), radians; exact for small ones as for half turns."""
    difference = a.T @ b
    skew = difference - difference.T
    sine = 0.5 * float(np.linalg.norm([skew[2, 1], skew[0, 2], skew[1, 0]]))
    return float(np.arctan2(sine, 0.5 * (np.trace(difference) - 1.0)))


def _turned(rotation: Floats, constraints: PlacementConstraints) -> float:
    """Return by how much a rotation (3, 3) exceeds what the table and the largest rotation allow, radians."""
    beyond = 0.0
    if constraints.turn_is_bounded:
        beyond = max(_angle(rotation, constraints.reference) - constraints.largest_turn, 0.0)
    if constraints.upright.any():
        up = rotation @ constraints.upright
        sine = float(np.linalg.norm(np.cross(up, constraints.normal)))
        beyond = max(beyond, float(np.arctan2(sine, up @ constraints.normal)))
    return beyond


def whole(replay: Replay) -> Finding | Idle:
    """Judge that the job allows several set-ups where this is one, and that each cut is made in exactly one of them."""
    specification, piece = replay.specification, replay.program.provenance.piece
    if piece is None:
        return Idle("the program is the whole job")
    if specification.setups < 2:
        return Finding.without_value(False, f"header: one set-up of several ({piece}); the job allows only one set-up")
    if specification.missed is None:
        why = f"this is one set-up of several ({piece}); only the verdict on the folder of all set-ups knows the others"
        return Idle(why, unknown=True)
    method = "number of intervals between waypoints that are cut in no set-up, or in more than one"
    return Finding(specification.missed == 0, specification.missed, 0.0, "", Place(), method)


WHOLE = "every cut is made in one set-up"
CLAIMS = (
    Claim("placement as the job asks", placement, needs_pose=False),
    Claim(WHOLE, whole, needs_pose=False),
)
