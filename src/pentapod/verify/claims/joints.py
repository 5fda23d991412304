"""Claims on the joint angles, proven for all times."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.verify.replay.claim import Claim, Finding
from pentapod.verify.replay.interval_bounds import RunningMaximum
from pentapod.verify.replay.replay import Replay

_METHOD = (
    "joint of leg {leg} is closest to its limit; proven bound for all times: the cosine as a quotient of polynomials, "
    "with the deviation of the motion from the chord between two samples (Krawczyk operator)"
)


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


def _finding(replay: Replay, extreme: RunningMaximum, angles: Floats, limit: Floats, *, sign: int) -> Finding:
    """Judge the extreme angles (n_legs,) against upper limits (sign 1) or lower ones (sign −1)."""
    leg = int(np.argmax(sign * (angles - limit)))
    value, bound = float(angles[leg]), float(limit[leg])
    passed = sign * value <= sign * bound
    method = _METHOD.format(leg=leg + 1)
    return Finding(passed, np.degrees(value), np.degrees(bound), "deg", replay.place(int(extreme.at[leg])), method)


def _angles(cosines: Floats) -> Floats:
    """Return the angles (n_legs,) in radians with these cosines; proven bounds of them may be beyond ±1."""
    return np.arccos(np.clip(cosines, -1.0, 1.0))


CLAIMS = (
    Claim("base joint cones", base_cones, needs_proof=True),
    Claim("platform joints not too closed", platform_least, needs_proof=True),
    Claim("platform joints not too open", platform_most, needs_proof=True),
)
