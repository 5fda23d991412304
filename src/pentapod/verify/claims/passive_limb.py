"""Claim on the passive limb: carriage, strut and universal joint stay within their ranges, at all times."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.clearance_bounds import Displacement, clearance_bound
from pentapod.verify.replay.replay import Replay

_ENDS = ("carriage at the rail's lower end", "carriage at the rail's upper end", "strut's shortest", "strut's longest",
         "strut's joint at its least angle", "strut's joint at its largest angle")  # fmt: skip


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

    def gaps(samples: Ints) -> Floats:
        room = limb.room(*(x[samples] for x in replay.pose))
        return np.column_stack([room[:, :4], shortest * room[:, 4:]])[:, columns]

    def approaches(displacement: Displacement) -> Floats:
        moved, turned = displacement.points[:, 0], displacement.turn
        arc = 0.5 * np.pi * (moved + shortest * turned)
        return np.column_stack([np.broadcast_to(moved[:, None], (len(moved), 4)), arc, arc])[:, columns]

    found = clearance_bound(replay, gaps, approaches, np.array([limb.joint]))
    method = f"{_ENDS[columns[found.column]]} comes closest, angles as arcs of the shortest strut; proven for all times"
    if not found.proven:
        method = f"not proven; {method}"
    return Finding(found.gap >= 0.0 and found.proven, MM * found.gap, 0.0, "mm", replay.place(found.sample), method)


CLAIMS = (Claim("passive limb within its ranges", within_ranges),)
