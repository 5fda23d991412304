"""Deviations of a motion of four samples from a path of three waypoints, told by hand from their parts."""

from types import SimpleNamespace

import numpy as np
import pytest

from pentapod.verify.claims.tracking import axis_deviation, coverage, end, start, tip_deviation
from pentapod.verify.replay.claim import with_allowance
from pentapod.verify.verdict.verdict import Place

TOLERANCE = 2e-5


def replay(lean=(0.0, 0.0, 0.0, 0.0), **changes):
    lean = np.array(lean)
    match = {
        "times": np.array([0.0, 1.5, 3.0]),
        "distances": np.array([1e-6, 2e-6, 5e-6, 4e-6]),
        "waypoint_distances": np.array([3e-6, 1e-6, 2e-6]),
        "angles": np.zeros(4),
        "waypoint_angles": np.zeros(3),
    }
    given = {
        "match": SimpleNamespace(**{**match, **{k: changes.pop(k) for k in list(changes) if k in match}}),
        "interval_bounds": SimpleNamespace(away=1e-6 * np.array([1.0, 9.0, 3.0]), turned=np.array([0.01, 0.02, 0.03])),
        "axes": np.stack([np.sin(lean), 0.0 * lean, np.cos(lean)], axis=1),
        "chord_arcs": np.zeros(3),
        "path_tolerance": TOLERANCE,
        "tilt": 0.1,
        "axis_tolerance": 0.01,
        "toolpath": SimpleNamespace(
            tilt_centre=3e-3, segment_of_interval=np.array([4, 7]), tilt_centres=np.zeros((3, 3))
        ),
        "tilt_centres": np.zeros((4, 3)),
        "place": lambda sample: Place(sample, int(sample), 99),
    }
    return SimpleNamespace(**{**given, **changes})


def test_the_tip_strays_by_the_larger_of_the_chords_that_meet():
    found = tip_deviation(replay())
    assert found.value == pytest.approx(1e3 * (5e-6 + 9e-6))
    assert found.where.time_s == 2
    assert "(here 9 µm)" in found.method
    assert "3 mm from the tip" in found.method
    found = tip_deviation(replay(distances=np.array([1e-6, 2e-6, 5e-6, 1.2e-5])))
    assert found.value == pytest.approx(1e3 * (1.2e-5 + 3e-6))


@pytest.mark.parametrize(
    ("distances", "farthest", "value", "segment"),
    [([3e-6, 1e-6, 2e-6], 1, 1e-6 + 9e-6, 7), ([2e-5, 1e-6, 2e-6], 0, 2e-5 + 1e-6, 4), ([0, 0, 2e-5], 2, 2.3e-5, 7)],
)
def test_a_waypoint_is_as_far_as_its_chord_lets_it_be(distances, farthest, value, segment):
    found = coverage(replay(waypoint_distances=np.array(distances)))
    assert found.value == pytest.approx(1e3 * value)
    assert f"farthest: waypoint {farthest}" in found.method
    assert found.where.segment == segment
    assert found.where.time_s == (0.0, 1.5, 3.0)[farthest]


@pytest.mark.parametrize(("beyond", "count"), [(0.9e-3, 0), (1.1e-3, 2)])
def test_waypoints_that_are_not_reached_are_those_beyond_what_is_allowed(beyond, count):
    farther = TOLERANCE * (1.0 + beyond) - np.array([1e-6, 9e-6, 3e-6])
    found = coverage(replay(waypoint_distances=np.array([farther[0], farther[1], 0.0])))
    assert ("waypoints are not reached" in found.method) == (count > 0)
    assert found.passed == (count == 0)
    assert not count or f"; {count} waypoints" in found.method


@pytest.mark.parametrize("angle", [0.2, 0.9, 1.0, 1.7])
def test_a_straight_line_between_axes_lags_behind_the_arc_by_less_than_is_counted(angle):
    share = np.linspace(0.0, 1.0, 2001)
    lag = np.abs(np.arctan((2.0 * share - 1.0) * np.tan(0.5 * angle)) - (share - 0.5) * angle).max()
    counted = np.radians(axis_deviation(replay(chord_arcs=np.array([0.0, 0.0, angle]))).value) - 0.03
    assert counted >= 0.125 * angle**2 + lag


def test_what_the_axis_turns_between_samples_counts():
    """Of its own turn two eighths of the square, of the path's one and a little; the stray of the nearer chord."""
    found = axis_deviation(replay(lean=[0.0, 0.0, 0.0, 0.2]))
    assert np.radians(found.value) == pytest.approx(0.04 / 4.0 + 0.03, abs=1e-6)
    assert found.where.time_s == 2
    found = axis_deviation(replay(chord_arcs=np.array([0.0, 0.0, 0.2])))
    assert np.radians(found.value) == pytest.approx(0.04 / 8.0 + 0.008 / 50.0 + 0.03, abs=1e-6)
    found = axis_deviation(replay(angles=np.array([0.05, 0.0, 0.0, 0.0])))
    assert np.radians(found.value) == pytest.approx(0.05 + 0.01, abs=1e-9)
    assert found.bound == pytest.approx(np.degrees(0.11))
    assert found.passed


@pytest.mark.parametrize(("angles", "value"), [([0.0, 0.06, 0.0], 0.06 + 0.02), ([0.0, 0.0, 0.06], 0.06 + 0.03)])
def test_the_axis_at_a_waypoint_counts_where_it_is_worse(angles, value):
    found = axis_deviation(replay(waypoint_angles=np.array(angles)))
    assert np.radians(found.value) == pytest.approx(value, abs=1e-9)
    assert found.where.time_s == (1.5 if angles[1] else 3.0)


def test_ends_are_compared_with_ends():
    tilt_centres, way = np.zeros((4, 3)), np.zeros((3, 3))
    tilt_centres[0, 0], way[-1, 1] = 1e-5, 3e-5
    pair = replay(tilt_centres=tilt_centres, toolpath=SimpleNamespace(tilt_centres=way))
    first, last = start(pair), end(pair)
    assert (first.value, last.value) == (pytest.approx(0.01), pytest.approx(0.03))
    assert (first.passed, last.passed) == (True, False)
    assert (first.where.time_s, last.where.time_s) == (0, 3)
    assert first.allowed == pytest.approx(1e3 * with_allowance(TOLERANCE))
