"""Where each moment belongs, on motions and paths whose matching can be told by hand."""

import numpy as np
import pytest

from pentapod.verify.replay.free_space import FreeSpaceOptions, PosedPolyline
from pentapod.verify.replay.path_matching import MatchOptions, interval_fractions, match, turns_on_spot


def leaning(angle):
    """Unit vectors (n, 3) that lean by angles (n,) from z towards y: not the way that things go here, which is x."""
    return np.stack([0.0 * angle, np.sin(angle), np.cos(angle)], axis=-1)


def course(x, angle=0.0):
    x = np.asarray(x, dtype=float)
    return PosedPolyline(
        np.stack([x, 0.0 * x, 0.0 * x], axis=1), leaning(np.broadcast_to(angle, x.shape).astype(float))
    )


def test_where_the_axis_counts():
    """Over a length up to the tolerance, where it turns by 0.05 rad for each tolerance of it: told on both sides."""
    length = 1e-3 * np.array([0.5, 0.5, 0.999, 1.001, 0.0, 0.0, 0.999])
    turn = np.array([0.0251, 0.0249, 1.0, 1.0, 1e-9, 0.0, 0.0501])
    path = course(np.concatenate([[0.0], np.cumsum(length)]), np.concatenate([[0.0], np.cumsum(turn)]))
    assert turns_on_spot(path, 1e-3).tolist() == [True, False, True, False, True, False, True]


def test_shares_of_an_interval_by_tilt_centre_and_by_axis():
    """On the spot a share by the tilt centre weighs (length / tolerance)², one by the axis (turn / 0.05 rad)²."""
    path = course([0.0, 4e-4, 2.0], [0.0, 0.1, 0.1])
    moments = course([1e-4, 3e-4, -1e-4, 9e-4, 0.5004, -1.0, 3.0], [0.075, 0.0, -0.1, 0.2, 0.0, 0.0, 0.0])
    interval = np.array([0, 0, 0, 0, 1, 1, 1])
    found = interval_fractions(moments, path, np.array([True, False]), 1e-3, interval)
    by_tilt_centre, by_axis = 0.4**2, 2.0**2
    both = [
        (by_tilt_centre * a + by_axis * b) / (by_tilt_centre + by_axis)
        for a, b in ((0.25, 0.75), (0.75, 0.0), (0, 0), (1, 1))
    ]
    np.testing.assert_allclose(found, [*both, 0.5 / 1.9996, 0.0, 1.0], atol=1e-12)


def test_the_axis_does_not_count_where_the_tilt_centre_goes_on():
    """The motion's axis lags behind by a tenth of a metre: it visits each waypoint where its tilt centre is there."""
    path = course(np.linspace(0.0, 1.0, 6), np.linspace(0.0, 0.5, 6))
    x = np.linspace(0.0, 1.0, 101)
    found = match(course(x, 0.5 * np.maximum(x - 0.1, 0.0)), path, 0.15)
    np.testing.assert_allclose(found.times, [0, 20, 40, 60, 80, 100], atol=1e-9)
    np.testing.assert_allclose(found.waypoint_angles, [0.0, *[0.05] * 5], atol=1e-4)
    np.testing.assert_allclose(found.arcs[:], x, atol=1e-12)
    np.testing.assert_allclose(found.turned[:], 0.5 * x, atol=1e-9)
    np.testing.assert_allclose(found.places, 5.0 * x, atol=1e-9)
    np.testing.assert_allclose(found.angles, 0.5 * np.minimum(x, 0.1), atol=1e-4)


def test_before_and_after_a_turn_on_the_spot_the_axis_does_not_count():
    """It counts at the waypoints where the turn begins and ends, not at those one farther."""
    x = np.array([0.0, 0.1, 0.2, 0.2, 0.3, 0.4])
    path = course(x, [0.0, 0.01, 0.02, 0.22, 0.23, 0.24])
    share = np.linspace(0.0, 1.0, 21)
    way = np.concatenate([0.2 * share, np.full(10, 0.2), 0.2 + 0.2 * share])
    axis = np.concatenate([0.0 * share, np.linspace(0.0, 0.24, 10), 0.24 + 0.0 * share])
    found = match(course(way, axis), path, 0.02)
    assert found.times[1] == pytest.approx(10.0, abs=1e-6)
    assert found.times[4] == pytest.approx(41.0, abs=1e-6)
    # While the tilt centre stands: 20 to 31, with the axis from 0 to 0.24 at the samples 21 to 30.
    assert found.times[2] == pytest.approx(21.0 + 9.0 * 0.02 / 0.24, abs=0.05)
    assert found.times[3] == pytest.approx(21.0 + 9.0 * 0.22 / 0.24, abs=0.05)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-2])
def test_the_closest_moment_of_a_turn_weighs_tilt_centre_and_axis(tolerance):
    """A motion that creeps on as it turns, early by 0.02 rad: 0.05 rad weigh as much as the tolerance."""
    creep, turn, early = 0.8 * tolerance, 0.04, 0.02
    path = course([-1.0, 0.0, 0.0, 1.0], [0.0, 0.0, turn, turn])
    s = np.linspace(-1.0, 1.0, 201)
    x, axis = np.concatenate([[-1.0], creep * s, [1.0]]), np.concatenate([[0.0], turn * s + early, [turn]])
    found = match(course(x, axis), path, tolerance)
    weight = (tolerance / 0.05) ** 2
    # Least of (creep s)² + weight (turn s + early − angle)².
    first, second = (weight * turn * (angle - early) / (creep**2 + weight * turn**2) for angle in (0.0, turn))
    np.testing.assert_allclose(found.times[1:3], [101.0 + 100.0 * first, 101.0 + 100.0 * second], atol=0.05)


def test_a_half_turn_on_the_spot():
    """Opposite axes have no arc between them; the motion that jumps from one to the other is still told well."""
    path = course([0.0, 1.0, 1.0, 2.0], [0.0, 0.0, np.pi, np.pi])
    path.axes[2:] = -path.axes[:1]
    found = match(path, path, 1e-3)
    assert found.distances.max() <= 1e-12
    np.testing.assert_allclose(found.waypoint_angles[[0, 3]], 0.0, atol=1e-12)


def test_axes_are_compared_where_a_waypoint_is_visited():
    """Between two samples, a quarter of the way: the chord between the axes there."""
    found = match(course([0.0, 1.0, 2.0], [0.0, 0.1, 0.1]), course([0.0, 0.25, 2.0], 0.0), 0.1)
    assert found.times[1] == pytest.approx(0.25)
    chord = 0.75 * leaning(np.array(0.0)) + 0.25 * leaning(np.array(0.1))
    expected = [0.0, np.arctan2(chord[1], chord[2]), 0.1]
    np.testing.assert_allclose(found.waypoint_angles, expected, atol=1e-9)


SMALL = MatchOptions(search=FreeSpaceOptions(cells=50_000))
"""Motion and path are so dense that the search would need more cells."""


def crowd(x, stands=0):
    """Motion and path of 2 m that are everywhere near each other, for a tolerance of 20 m."""
    motion = course(np.concatenate([np.full(stands, x[0]), x]))
    return match(motion, course(2.0 * np.linspace(0.0, 1.0, 3001) ** 2), 20.0, options=SMALL)


def test_what_no_search_can_match_is_matched_by_the_way_gone():
    found = crowd(np.linspace(0.0, 3.0, 3001))
    np.testing.assert_allclose(found.times, 3000.0 * np.linspace(0.0, 1.0, 3001) ** 2, atol=1e-6)
    np.testing.assert_allclose(found.arcs[:], np.linspace(0.0, 2.0, 3001), atol=2e-3)
    assert found.distances.max() == pytest.approx(1.0)


def test_while_it_stands_at_the_start_it_is_at_the_start():
    found = crowd(np.linspace(0.0, 2.0, 3001), stands=100)
    assert (found.places[:100] == 0.0).all()
    assert found.distances.max() <= 2e-3


def test_a_motion_that_leaves_the_path_is_matched_beside_it_within_a_bound_of_cells():
    """The search begins anew each time it widens the radius: all of it together is bounded."""
    motion = course(np.linspace(0.0, 1.0, 501) ** 2)
    motion.points[240:260, 1] += 8.0  # metres, for a tolerance of one
    path = course(np.linspace(0.0, 1.0, 301))
    found = match(motion, path, 1.0)
    np.testing.assert_allclose(found.arcs[:200], np.linspace(0.0, 1.0, 501)[:200] ** 2, atol=5e-3)
    few = match(motion, path, 1.0, options=MatchOptions(search=FreeSpaceOptions(widened=1, each=0)))
    travelled = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(motion.points, axis=0), axis=1)))
    np.testing.assert_allclose(few.arcs[:], travelled / travelled[-1], atol=5e-3)
