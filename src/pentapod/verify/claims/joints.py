"""Claims on the joint angles, and on the ranges of a passive limb, proven for all times."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.robot import Poses
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.clearance_bounds import Displacement, clearance_bound
from pentapod.verify.replay.interval_bounds import RunningMaximum
from pentapod.verify.replay.replay import Replay

_METHOD = (
    "joint of leg {leg} is closest to its limit; proven bound for all times: the cosine as a quotient of polynomials, "
    "with the deviation of the motion from the chord between two samples (Krawczyk operator)"
)

_ENDS = ("carriage at the rail's lower end", "carriage at the rail's upper end", "strut's shortest", "strut's longest",
         "strut's joint at its least angle", "strut's joint at its largest angle")  # fmt: skip


def base_cones(replay: Replay) -> Finding:
    """Judge the angle between each leg and the axis of its base joint's cone."""
    widest = replay.interval_bounds.base_widest
    return _finding(replay, widest, _angles(-widest.values), replay.machine.joints.base_cone, sign=1)


def platform_least(replay: Replay) -> Finding:
    """Judge that the angle between each leg and the tool axis is not too small."""
    closed = replay.interval_bounds.platform_closed
    return _finding(replay, closed, _angles(closed.values), replay.machine.joints.platform_range[:, 0], sign=-1)


def platform_most(replay: Replay) -> Finding:
    """Judge that the angle between each leg and the tool axis is not too large."""
    opened = replay.interval_bounds.platform_open
    return _finding(replay, opened, _angles(-opened.values), replay.machine.joints.platform_range[:, 1], sign=1)


def within_ranges(replay: Replay) -> Finding | Idle:
    """Judge what is left of the way of carriage and strut, and of the joint's range as an arc of the shortest strut.

    The carriage and the strut's length move by no more than the universal joint does. The strut's direction turns by
    no more than π/2 times that, as a share of the strut; the tool axis by π/2 times the way of its end.
    """
    machine = replay.machine
    limb = machine.limb
    if limb is None:
        return Idle("the robot has no passive limb")
    shortest = float(limb.strut[0])
    least, most = limb.joint_range
    columns = np.flatnonzero([True, True, True, True, least > 0.0, most < np.pi])  # no angle is below 0 or above π

    def gaps(poses: Poses, _far: float) -> Floats:
        room = limb.room(*poses)
        return np.column_stack([room[:, :4], shortest * room[:, 4:]])[:, columns]

    def approaches(displacement: Displacement) -> Floats:
        moved, turned = displacement.points[:, 0], displacement.turn
        arc = 0.5 * np.pi * (moved + shortest * turned)
        return np.column_stack([np.broadcast_to(moved[:, None], (len(moved), 4)), arc, arc])[:, columns]

    found = clearance_bound(replay, gaps, approaches, np.array([limb.joint]))
    method = f"{_ENDS[columns[found.column]]} comes closest, angles as arcs of the shortest strut; proven for all times"
    if not found.proven:
        method = f"not proven; {method}"
    return Finding(
        found.gap >= 0.0 and found.proven, MM * found.gap, 0.0, "mm", replay.place(found.sample), method, at_least=True
    )


def _finding(replay: Replay, extreme: RunningMaximum, angles: Floats, limit: Floats, *, sign: int) -> Finding:
    """Judge the extreme angles (n_legs,) against upper limits (sign 1) or lower ones (sign −1)."""
    leg = int(np.argmax(sign * (angles - limit)))
    value, bound = float(angles[leg]), float(limit[leg])
    passed = sign * value <= sign * bound
    method = _METHOD.format(leg=leg + 1)
    where = replay.place(int(extreme.at[leg]))
    return Finding(passed, np.degrees(value), np.degrees(bound), "deg", where, method, at_least=sign < 0)


def _angles(cosines: Floats) -> Floats:
    """Return the angles (n_legs,) in radians with these cosines; proven bounds of them may be beyond ±1."""
    return np.arccos(np.clip(cosines, -1.0, 1.0))


CLAIMS = (
    Claim("base joint cones", base_cones, needs_proof=True),
    Claim("platform joints not too closed", platform_least, needs_proof=True),
    Claim("platform joints not too open", platform_most, needs_proof=True),
    Claim("passive limb within its ranges", within_ranges),
)
