"""Deviations of a motion of five samples from a path of three waypoints, computed by hand from their parts."""

import numpy as np
import pytest
import replay_cases as cases

from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify.claims.path_deviation import axis_deviation, coverage, end, start, tip_deviation
from pentapod.verify.replay.claim import with_allowance

TOLERANCE = 2e-5


def replay(lean=(0.0, 0.0, 0.0, 0.0, 0.0), centres=((0.0,) * 3,) * 5, waypoints=((0.0,) * 3,) * 3, **match):
    """Two segments of one interval each; chords that may deviate by 1, 9, 3 and 2 µm, and by 0.01 to 0.03 rad."""
    lean, axes = np.array(lean), np.tile([0.0, 0.0, 1.0], (2, 1))
    tips = np.array(waypoints) - [0.0, 0.0, 3e-3]
    segments = tuple(Segment(SegmentKind.CUT, tips[k : k + 2], axes, 0.1) for k in range(2))
    given = {
        "times": [0.0, 1.5, 4.0],
        "places": [0.0, 0.5, 1.0, 1.5, 2.0],
        "distances": [1e-6, 2e-6, 5e-6, 4e-6, 1e-6],
        "waypoint_distances": [3e-6, 1e-6, 2e-6],
    }
    return cases.measured(
        Toolpath(segments, 3e-3),
        centres,
        np.stack([np.sin(lean), 0.0 * lean, np.cos(lean)], axis=1),
        match={**given, **match},
        bounds={
            "deviations": 1e-6 * np.array([1.0, 9.0, 3.0, 2.0]),
            "axis_deviations": np.array([0.01, 0.02, 0.03, 0.01]),
        },
        tilt=0.1,
        axis_tolerance=0.01,
    )


def sample_of(found):
    return round(found.where.time_s / (0.5 * cases.PERIOD), 6)


def test_tip_deviation_counts_the_larger_of_the_chords_that_meet():
    found = tip_deviation(replay())
    assert found.value == pytest.approx(1e3 * (5e-6 + 9e-6))
    assert (sample_of(found), found.where.segment) == (2, 1)
    assert "(here 9 µm)" in found.method
    assert "3 mm from the tip" in found.method
    found = tip_deviation(replay(distances=[1e-6, 2e-6, 5e-6, 1.2e-5, 1e-6]))
    assert found.value == pytest.approx(1e3 * (1.2e-5 + 3e-6))


@pytest.mark.parametrize(
    ("distances", "farthest", "value", "segment"),
    [([3e-6, 1e-6, 2e-6], 1, 1e-6 + 9e-6, 1), ([2e-5, 1e-6, 2e-6], 0, 2e-5 + 1e-6, 0), ([0, 0, 2e-5], 2, 2.2e-5, 1)],
)
def test_a_waypoint_is_as_far_as_its_chord_lets_it_be(distances, farthest, value, segment):
    found = coverage(replay(waypoint_distances=np.array(distances)))
    assert found.value == pytest.approx(1e3 * value)
    assert f"farthest: waypoint {farthest}" in found.method
    assert found.where.segment == segment
    assert sample_of(found) == (0.0, 1.5, 4.0)[farthest]


@pytest.mark.parametrize(("beyond", "count"), [(0.9e-3, 0), (1.1e-3, 2)])
def test_waypoints_that_are_not_reached_are_those_beyond_what_is_allowed(beyond, count):
    farther = TOLERANCE * (1.0 + beyond) - np.array([1e-6, 9e-6])
    found = coverage(replay(waypoint_distances=np.array([farther[0], farther[1], 0.0])))
    assert ("waypoints are not reached" in found.method) == (count > 0)
    assert found.passed == (count == 0)
    assert not count or f"; {count} waypoints" in found.method


@pytest.mark.parametrize("angle", [0.2, 0.9, 1.0, 1.7])
def test_a_straight_line_between_axes_lags_behind_the_arc_by_less_than_is_counted(angle):
    share = np.linspace(0.0, 1.0, 2001)
    lag = np.abs(np.arctan((2.0 * share - 1.0) * np.tan(0.5 * angle)) - (share - 0.5) * angle).max()
    counted = np.radians(axis_deviation(replay(turned=[0.0, 0.0, 0.0, angle, angle])).value) - 0.03
    assert counted >= 0.125 * angle**2 + lag


def test_what_the_axis_turns_between_samples_counts():
    """Two eighths of the square of its own turn, one and a little of the path's; the deviation of the nearer chord."""
    found = axis_deviation(replay(lean=[0.0, 0.0, 0.0, 0.2, 0.2]))
    assert np.radians(found.value) == pytest.approx(0.04 / 4.0 + 0.03, abs=1e-6)
    assert sample_of(found) == 2
    found = axis_deviation(replay(turned=[0.0, 0.0, 0.0, 0.2, 0.2]))
    assert np.radians(found.value) == pytest.approx(0.04 / 8.0 + 0.008 / 50.0 + 0.03, abs=1e-6)
    found = axis_deviation(replay(angles=[0.05, 0.0, 0.0, 0.0, 0.0]))
    assert np.radians(found.value) == pytest.approx(0.05 + 0.01, abs=1e-9)
    assert found.bound == pytest.approx(np.degrees(0.11))
    assert found.passed


def test_a_turn_of_the_path_by_way_of_waypoints_counts_in_their_steps():
    """The path turns by 1 rad between samples 1 and 2 while the tool is still: ten waypoints, 0.1 rad apart."""
    turns = np.linspace(0.0, 1.0, 11)
    given = {
        "times": np.concatenate([[0.0], 1.0 + turns, [4.0]]),
        "turned": [0.0, 0.0, 1.0, 1.0, 1.0],
        "waypoint_turned": np.concatenate([[0.0], turns, [1.0]]),
        "waypoint_distances": np.zeros(13),
        "waypoint_angles": np.concatenate([[0.5], 0.5 + 0.5 * turns, [1.0]]),
        "angles": [0.5, 0.5, 1.0, 1.0, 1.0],
    }
    found = axis_deviation(replay(waypoints=((0.0,) * 3,) * 3, **given))
    exact, step = 1.0, 0.01 / 8.0 + 0.001 / 50.0
    assert exact + 0.03 < np.radians(found.value) < exact + 0.03 + 1.2 * step


@pytest.mark.parametrize(("angles", "value"), [([0.0, 0.06, 0.0], 0.06 + 0.02), ([0.0, 0.0, 0.06], 0.06 + 0.01)])
def test_the_axis_at_a_waypoint_counts_where_it_is_worse(angles, value):
    found = axis_deviation(replay(waypoint_angles=np.array(angles)))
    assert np.radians(found.value) == pytest.approx(value, abs=1e-9)
    assert sample_of(found) == (1.5 if angles[1] else 4.0)


@pytest.mark.parametrize("at_once", [1, 2, 7, 39])
@pytest.mark.parametrize("seed", range(4))
def test_axes_of_a_long_program_are_judged_in_parts_as_all_at_once(at_once, seed, monkeypatch):
    """No part misses a step between events that the whole has, and waypoints at the time of a sample are among them."""
    rng, count = np.random.default_rng(seed), 40
    times = np.sort(np.append(rng.uniform(0.0, 39.0, 40), np.repeat(rng.integers(1, 39, 12), 2)))
    times[[0, -1]] = 0.0, 39.0
    events = np.sort(np.concatenate([np.arange(count), times]), kind="stable")
    turned = np.cumsum(rng.exponential(0.02, len(events)) * (rng.uniform(size=len(events)) < 0.4))
    own = np.searchsorted(events, np.arange(count))
    spare = np.ones(len(events), dtype=bool)
    spare[own] = False
    lean = np.cumsum(rng.normal(scale=0.02, size=count))
    axes = np.stack([np.sin(lean), 0.0 * lean, np.cos(lean)], axis=1)
    off, deviations = rng.uniform(0.0, 0.05, len(events)), rng.uniform(0.0, 0.02, count - 1)
    tips, upright = np.zeros((len(times), 3)), np.tile([0.0, 0.0, 1.0], (len(times), 1))
    path = Toolpath((Segment(SegmentKind.CUT, tips, upright, 0.1),))
    match = {
        "times": times, "turned": turned[own], "waypoint_turned": turned[spare],
        "angles": off[own], "waypoint_angles": off[spare],
    }  # fmt: skip
    bounds = {"axis_deviations": deviations}
    asked = {"match": match, "bounds": bounds, "tilt": 0.1, "axis_tolerance": 0.01}
    given = cases.measured(path, np.zeros((count, 3)), axes, **asked)
    whole = np.radians(axis_deviation(given).value)
    monkeypatch.setattr("pentapod.verify.claims.path_deviation.CHORDS_AT_ONCE", at_once)
    found = np.radians(axis_deviation(given).value)
    # Each step by itself, from the larger of the angles at both of its ends.
    chord = np.minimum(events[:-1].astype(int), count - 2)
    turn = np.abs(np.diff(lean))[chord]
    rise = 0.25 * turn**2 + 0.125 * np.diff(turned) ** 2 + np.diff(turned) ** 3 / 50.0
    apart = 2.0 * np.sin(0.5 * np.maximum(off[:-1], off[1:])) + rise
    least = float((2.0 * np.arcsin(0.5 * apart) + deviations[chord]).max())
    assert least - 1e-12 <= found <= whole + 1e-12


def test_ends_are_compared_with_ends():
    tilt_centres, way = np.zeros((5, 3)), np.zeros((3, 3))
    tilt_centres[0, 0], way[-1, 1] = 1e-5, 3e-5
    pair = replay(centres=tilt_centres, waypoints=way)
    first, last = start(pair), end(pair)
    assert (first.value, last.value) == (pytest.approx(0.01), pytest.approx(0.03))
    assert (first.passed, last.passed) == (True, False)
    assert (sample_of(first), sample_of(last)) == (0, 4)
    assert first.allowed == pytest.approx(1e3 * with_allowance(TOLERANCE))
