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
    angles = _angles(legs, replay.machine.joints.base_axes)
    return _most(replay, angles, replay.machine.joints.base_cone)


def platform_least(replay: Replay) -> Finding:
    """Judge that no leg folds too close to the tool axis."""
    found = _most(replay, -_platform_angles(replay), -replay.machine.joints.platform_range[:, 0])
    value, bound = found.value, found.bound
    assert value is not None
    assert bound is not None
    return Finding(found.passed, -value, -bound, found.unit, found.where, found.method)


def platform_most(replay: Replay) -> Finding:
    """Judge that no leg opens too far from the tool axis."""
    return _most(replay, _platform_angles(replay), replay.machine.joints.platform_range[:, 1])


def _platform_angles(replay: Replay) -> Floats:
    """Return the angles (M, 5) between leg, platform → base joint, and tool axis, tip → spindle: radians."""
    # Both vectors are the negatives of those that kinematics uses: the angle is the same.
    position, direction = replay.pose
    return _angles(replay.machine.pentapod.leg_vectors(position, direction), direction[:, None, :])


def _most(replay: Replay, angles: Floats, limit: Floats) -> Finding:
    """Judge angles (M, 5) against largest ones (5,), with what may happen between the samples added."""
    between = np.maximum(np.maximum(angles[:-1:2], angles[1::2]), angles[2::2]) + excursion(angles)
    interval, leg = np.unravel_index(int(np.argmax(between - limit)), between.shape)
    value, bound = float(between[interval, leg]), float(limit[leg])
    sample = 2 * int(interval) + int(np.argmax(angles[2 * interval : 2 * interval + 3, leg]))
    method = _METHOD.format(leg=int(leg) + 1)
    return Finding(value <= bound, np.degrees(value), np.degrees(bound), "deg", replay.place(sample), method)


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
