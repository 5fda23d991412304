"""Claims about the joints' angles."""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Floats
from pentapod.verify.claim import Claim, Finding
from pentapod.verify.replay import Replay, excursion

_METHOD = (
    "joint of leg {leg}; at the rows and halfway between, plus a margin for the rest of the time "
    "(a quarter of the second difference): sampled, not proven"
)


def base_cones(replay: Replay) -> Finding:
    """Judge the angle between each leg and the axis of its base joint's cone."""
    legs = replay.machine.pentapod.leg_vectors(*replay.pose)
    return _finding(replay, _angles(legs, replay.machine.joints.base_axes), replay.machine.joints.base_cone, sign=1)


def platform_least(replay: Replay) -> Finding:
    """Judge that no leg folds too close to the tool axis."""
    return _finding(replay, _platform_angles(replay), replay.machine.joints.platform_range[:, 0], sign=-1)


def platform_most(replay: Replay) -> Finding:
    """Judge that no leg opens too far from the tool axis."""
    return _finding(replay, _platform_angles(replay), replay.machine.joints.platform_range[:, 1], sign=1)


def _platform_angles(replay: Replay) -> Floats:
    """Return the angles (M, 5) between leg, platform → base joint, and tool axis, tip → spindle: radians."""
    # Both vectors are the negatives of those that kinematics uses: the angle is the same.
    position, direction = replay.pose
    return _angles(replay.machine.pentapod.leg_vectors(position, direction), direction[:, None, :])


def _finding(replay: Replay, angles: Floats, limit: Floats, *, sign: int) -> Finding:
    """Judge angles (M, 5) against limits (5,), the largest (sign 1) or the least ones (sign −1)."""
    high = sign * angles
    between = np.maximum(np.maximum(high[:-1:2], high[1::2]), high[2::2]) + excursion(angles)
    interval, leg = np.unravel_index(int(np.argmax(between - sign * limit)), between.shape)
    value, bound = sign * float(between[interval, leg]), float(limit[leg])
    sample = 2 * int(interval) + int(np.argmax(high[2 * interval : 2 * interval + 3, leg]))
    method = _METHOD.format(leg=int(leg) + 1)
    passed = sign * value <= sign * bound
    return Finding(passed, np.degrees(value), np.degrees(bound), "deg", replay.place(sample), method)


def _angles(vectors: Floats, units: Floats) -> Floats:
    """Return the angles (...) in radians between vectors and unit vectors (..., 3)."""
    along = np.einsum("...i,...i->...", vectors, units)
    across = np.sqrt(np.maximum(np.einsum("...i,...i->...", vectors, vectors) - along * along, 0.0))
    return np.arctan2(across, along)


CLAIMS = (
    Claim("base joint cones", base_cones),
    Claim("platform joints not too closed", platform_least),
    Claim("platform joints not too open", platform_most),
)
