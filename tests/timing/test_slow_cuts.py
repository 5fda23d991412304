"""Constant surface speed: where the feed is held and where not, with place, amount and the leg that limits."""

import numpy as np
import pytest
from timing_paths import Path, machine, straight

from pentapod.timing import Trajectory, certify, explain, retime, slow_cuts
from pentapod.toolpath.toolpath import SegmentKind


def timed(sections, m, direction):
    path = Path((straight(direction, sections[-1][0], sections=sections),))
    result = retime(path, m, limit_jerk=False)  # ramps of plain arithmetic
    assert isinstance(result, Trajectory), str(result)
    return result


PERIOD = 1e-3
CUT, LINK, RAPID = SegmentKind.CUT, SegmentKind.LINK, SegmentKind.RAPID


def test_slow_cuts_of_a_cut_between_links_are_none():
    """Links at the same feed before and after take the ramps: the cut runs at its feed throughout."""
    sections = [(0.02, 0.1, LINK, 0), (0.12, 0.1, CUT, 1), (0.14, 0.1, LINK, 2)]
    assert slow_cuts(timed(sections, machine(), [0.2, 0.1, 0.5, 0, 0]), PERIOD) == ()


def test_slow_cuts_at_a_start_from_rest():
    m = machine(a=1.0)
    (first, second) = sorted(
        slow_cuts(timed([(0.1, 0.1, CUT, 7)], m, [0, 0, 0.5, 0, 0]), PERIOD), key=lambda u: u.stations
    )
    assert first.segment == second.segment == 7
    assert first.constraint == "leg 3 acceleration"
    assert first.share == 0.0
    # 0.1 m/s at 1/0.5 m/s² along the path: 50 ms, 2.5 mm.
    assert first.seconds == pytest.approx(0.05, abs=0.003)
    assert first.stations[0] == 0.0
    assert first.stations[1] == pytest.approx(0.0025, abs=1.5e-4)
    assert "segment 7" in str(first)


def test_slow_cut_names_the_leg_that_limits():
    """Leg 2 allows 0.1 m/s along the path where 0.2 is asked for; the rapid before does not count."""
    m = machine(v=0.05)
    sections = [(0.1, np.inf, RAPID, 0), (0.3, 0.2, CUT, 1)]
    trajectory = timed(sections, m, [0, 0.5, 0, 0, 0])
    places = slow_cuts(trajectory, PERIOD)
    assert [place.segment for place in places] == [1]
    assert places[0].constraint.startswith("leg 2")
    assert places[0].seconds == pytest.approx(2.0, rel=0.1)
    middle = [place for place in slow_cuts(trajectory, PERIOD, held=0.4) if place.share > 0.0]
    assert middle == []
    assert "cutting below the feed for" in str(explain(trajectory, m, (), places))


def test_slow_cuts_are_judged_by_the_spot_on_the_surface():
    """A beam whose spot moves 1.5 times as far as the tip is never too slow, at 0.6 times it always is."""
    sections = [(0.02, 0.1, LINK, 0), (0.12, 0.1, CUT, 1), (0.14, 0.1, LINK, 2)]
    trajectory = timed(sections, machine(), [0.2, 0.1, 0.5, 0, 0])
    assert slow_cuts(trajectory, PERIOD, lambda s: np.full(len(s), 1.5)) == ()
    (slow,) = slow_cuts(trajectory, PERIOD, lambda s: np.full(len(s), 0.6))
    assert slow.share == pytest.approx(0.6, rel=0.01)
    assert slow.seconds == pytest.approx(1.0, rel=0.15)


def wavy(s):
    """How far the spot moves for each metre of s: 0.7 to 1.3."""
    return 1.0 + 0.3 * np.sin(np.asarray(s) / 0.004)


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
@pytest.mark.parametrize("limit_jerk", [False, True])
def test_the_feed_is_the_speed_of_the_spot(interpolation, limit_jerk):
    """Never above, and held where no leg is in the way, though the tip is slower here and faster there."""
    m = machine(interpolation=interpolation)
    piece = straight([0.2, 0.1, 0.3, 0, 0], 0.12, 0.05, rate=wavy)
    trajectory = retime(Path((piece,)), m, limit_jerk=limit_jerk)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    t = np.linspace(0.0, trajectory.duration, 40_001)
    s, tip = trajectory.station(t), trajectory.station(t, 1)
    spot = tip * wavy(s)
    assert spot.max() <= 0.05 * (1.0 + 1e-3)
    middle = (s > 0.01) & (s < 0.11)
    assert spot[middle].min() > 0.97 * 0.05
    assert spot[middle].mean() > 0.98 * 0.05
    assert tip.max() > 1.35 * 0.05
    # The mean over any period, too: how far the spot itself has come.
    way = s - 0.3 * 0.004 * (np.cos(s / 0.004) - 1.0)
    rows = np.interp(np.arange(0.0, trajectory.duration, PERIOD), t, way)
    assert np.diff(rows).max() / PERIOD <= 0.05 * (1.0 + 1e-3)
    assert all(place.constraint != "feed" for place in slow_cuts(trajectory, PERIOD, wavy, held=0.97))
    uses = {use.quantity: use.share for use in certify(trajectory, m)}
    assert 0.98 < uses["feed"] < 1.01
    story = explain(trajectory, m)
    assert story.lower_bound == pytest.approx(way[-1] / 0.05, rel=1e-3)
    assert story.duration > story.lower_bound


def test_a_spot_that_stands_leaves_the_tip_the_rapid_rate():
    """Turning about the spot costs no feed, but the tip keeps the rapid rate, and it is named."""
    trajectory = timed_piece(straight([0.2, 0.1, 0.3, 0, 0], 0.2, 0.05, rate=np.zeros_like), machine(rapid=0.1))
    t = np.linspace(0.0, trajectory.duration, 20_001)
    assert 0.099 < trajectory.station(t, 1).max() <= 0.1 * (1.0 + 1e-9)
    assert explain(trajectory, machine(rapid=0.1)).causes[0].name in {"rapid rate", "leg 3 acceleration"}
    assert "feed" not in {cause.name for cause in explain(trajectory, machine(rapid=0.1)).causes}


def timed_piece(piece, m):
    result = retime(Path((piece,)), m, limit_jerk=False)
    assert isinstance(result, Trajectory), str(result)
    return result
