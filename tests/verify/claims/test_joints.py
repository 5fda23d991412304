"""Claims about joints on angles that are given: which leg is closest to its own limit, and on which side."""

from types import SimpleNamespace

import numpy as np
import pytest

from pentapod.verify.claims.joints import CLAIMS, base_cones, platform_least, platform_most
from pentapod.verify.verdict.verdict import Place

ANGLES = np.radians([10.0, 20.0, 30.0, 40.0, 50.0])


def replay(limits, closed=False):
    """RunningMaximum angles (5,) of the legs, seen at the samples 2, 4, … 10, and limits (5,) in degrees on one
    side."""
    limits, at = np.radians(limits), 2 * np.arange(1, 6)
    widest = SimpleNamespace(values=-np.cos(ANGLES), at=at)
    return SimpleNamespace(
        interval_bounds=SimpleNamespace(
            base_widest=widest, platform_open=widest, platform_closed=SimpleNamespace(values=np.cos(ANGLES), at=at)
        ),
        machine=SimpleNamespace(
            joints=SimpleNamespace(
                base_cone=limits, platform_range=np.stack([limits - 9.0 * (not closed), limits + 9.0 * closed], axis=1)
            )
        ),
        place=lambda sample: Place(None, sample // 2, None),
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
    over = replay(np.full(5, 90.0))
    over.interval_bounds.base_widest.values[2] = 1.0 + 1e-9
    assert base_cones(over).value == pytest.approx(180.0)
    over.interval_bounds.platform_closed.values[3] = 1.0 + 1e-9
    assert platform_least(over).value == 0.0


def test_all_of_them_are_proven_for_all_times():
    assert [claim.needs_proof for claim in CLAIMS] == [True, True, True]
