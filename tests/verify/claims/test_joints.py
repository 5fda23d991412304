"""Claims about joints on angles that are given: which leg is closest to its own limit, and on which side."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.verify.claims.joints import CLAIMS, base_cones, platform_least, platform_most
from pentapod.verify.replay.interval_bounds import RunningMaximum

ANGLES = np.radians([10.0, 20.0, 30.0, 40.0, 50.0])


def extreme(values):
    """Values of the legs, found at the samples 2, 4, … 10."""
    found = RunningMaximum()
    for k in range(5):
        found.update(np.where(np.arange(5) == k, values, -np.inf)[None], 2 * k + 2)
    return found


def replay(limits, closed=False, over=None):
    """Largest and smallest angles (5,) of the legs, and limits (5,) in degrees on one side; over: cosines instead."""
    limits = np.radians(limits)
    widest, narrowest = (-np.cos(ANGLES), np.cos(ANGLES)) if over is None else (over, over)
    sides = [limits, limits + np.radians(9.0)] if closed else [0.0 * limits, limits]
    joints = replace(cases.STAND.joints, base_cone=limits, platform_range=np.stack(sides, axis=1))
    bounds = {"base_widest": extreme(widest), "platform_open": extreme(widest), "platform_closed": extreme(narrowest)}
    machine = replace(cases.STAND, joints=joints)
    return cases.measured(
        cases.toolpath_of(cases.strokes()[:1]), cases.along_x(np.zeros(13)), bounds=bounds, machine=machine
    )


@pytest.mark.parametrize("leg", range(5))
@pytest.mark.parametrize("room", [3.0, -3.0])
@pytest.mark.parametrize(
    ("judge", "sign"), [(base_cones, 1), (platform_most, 1), (platform_least, -1)], ids=["base", "open", "closed"]
)
def test_each_joint_has_a_limit_of_its_own(judge, sign, room, leg):
    limits = np.degrees(ANGLES) + sign * 9.0
    limits[leg] = np.degrees(ANGLES[leg]) + sign * room
    found = judge(replay(limits, closed=sign < 0))
    assert (found.passed, found.unit, found.where.row) == (room > 0.0, "deg", leg + 1)
    assert (found.value, found.bound) == (pytest.approx(10.0 * (leg + 1)), pytest.approx(limits[leg]))
    assert found.method.startswith(f"joint of leg {leg + 1} is closest")


def test_a_bound_beyond_a_cosine_is_the_straight_angle():
    """What is proven of a cosine may be beyond ±1 by a little."""
    cosines = np.full(5, -1.0)
    cosines[2] = 1.0 + 1e-9
    over = replay(np.full(5, 90.0), over=cosines)
    assert base_cones(over).value == pytest.approx(180.0)
    assert platform_least(over).value == 0.0


def test_angles_of_the_legs_are_proven_for_all_times():
    assert [claim.needs_proof for claim in CLAIMS[:3]] == [True, True, True]
