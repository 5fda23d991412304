"""Constant surface speed: where the feed is held and where not, with place, amount and the leg that limits."""

import numpy as np
import pytest
from timing_paths import Path, machine, straight

from pentapod.timing import Trajectory, explain, retime, unheld
from pentapod.toolpath.toolpath import SegmentKind


def timed(sections, m, direction):
    path = Path((straight(direction, sections[-1][0], sections=sections),))
    result = retime(path, m, limit_jerk=False)  # ramps of plain arithmetic
    assert isinstance(result, Trajectory), str(result)
    return result


PERIOD = 1e-3
CUT, LINK, RAPID = SegmentKind.CUT, SegmentKind.LINK, SegmentKind.RAPID


def test_a_cut_between_links_is_held():
    """Links at the same feed before and after take the ramps: the cut runs at its feed throughout."""
    sections = [(0.02, 0.1, LINK, 0), (0.12, 0.1, CUT, 1), (0.14, 0.1, LINK, 2)]
    assert unheld(timed(sections, machine(), [0.2, 0.1, 0.5, 0, 0]), PERIOD) == ()


def test_a_cut_that_starts_at_rest_says_so():
    m = machine(a=1.0)
    (first, second) = sorted(
        unheld(timed([(0.1, 0.1, CUT, 7)], m, [0, 0, 0.5, 0, 0]), PERIOD), key=lambda u: u.stations
    )
    assert first.segment == second.segment == 7
    assert first.constraint == "leg 3 acceleration"
    assert first.share == 0.0
    # 0.1 m/s at 1/0.5 m/s² along the path: 50 ms, 2.5 mm.
    assert first.seconds == pytest.approx(0.05, abs=0.003)
    assert first.stations[0] == 0.0
    assert first.stations[1] == pytest.approx(0.0025, abs=1.5e-4)
    assert "segment 7" in str(first)


def test_a_leg_too_slow_for_the_feed_is_named():
    """Leg 2 allows 0.1 m/s along the path where 0.2 is asked for; the rapid before does not count."""
    m = machine(v=0.05)
    sections = [(0.1, np.inf, RAPID, 0), (0.3, 0.2, CUT, 1)]
    trajectory = timed(sections, m, [0, 0.5, 0, 0, 0])
    places = unheld(trajectory, PERIOD)
    assert [place.segment for place in places] == [1]
    assert places[0].constraint.startswith("leg 2")
    assert places[0].seconds == pytest.approx(2.0, rel=0.1)
    middle = [place for place in unheld(trajectory, PERIOD, held=0.4) if place.share > 0.0]
    assert middle == []
    assert "cutting below the feed for" in str(explain(trajectory, m, (), places))


def test_the_spot_on_the_surface_is_what_counts():
    """A beam whose spot moves 1.5 times as far as the tip is never too slow, at 0.6 times it always is."""
    sections = [(0.02, 0.1, LINK, 0), (0.12, 0.1, CUT, 1), (0.14, 0.1, LINK, 2)]
    trajectory = timed(sections, machine(), [0.2, 0.1, 0.5, 0, 0])
    assert unheld(trajectory, PERIOD, lambda s: np.full(len(s), 1.5)) == ()
    (slow,) = unheld(trajectory, PERIOD, lambda s: np.full(len(s), 0.6))
    assert slow.share == pytest.approx(0.6, rel=0.01)
    assert slow.seconds == pytest.approx(1.0, rel=0.15)
