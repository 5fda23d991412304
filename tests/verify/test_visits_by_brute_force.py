"""When a motion passes waypoints: against dense moments, all assignments, and motions whose answer is plain."""

from itertools import product

import numpy as np
import pytest

from pentapod.verify.visits import Course, _in_order, _pairs, _Passes, _passes, _settled, find_visits

UP = np.array([0.0, 0.0, 1.0])


def course(points, axes=UP):
    points = np.asarray(points, dtype=float)
    return Course(points, np.broadcast_to(np.asarray(axes, dtype=float), points.shape))


def on_x(*x):
    return np.stack([np.array(x, dtype=float), np.zeros(len(x)), np.zeros(len(x))], axis=1)


def wandering(seed):
    """A motion that walks, leaps and stands, and waypoints about it."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(40, 3)) * rng.choice([0.0, 0.02, 0.3, 2.5], size=(40, 1))
    points = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    return points, points[rng.integers(0, 41, 25)] + rng.normal(size=(25, 3)) * 0.2


def visits(motion, path, radius, weight=0.0):
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path.points, axis=0), axis=1))])
    return find_visits(motion, path, arc, radius, np.full(len(arc), weight))


@pytest.mark.parametrize("radius", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("seed", range(4))
def test_pairs_are_all_that_may_be_near_and_few_others(seed, radius):
    points, waypoints = wandering(seed)
    waypoint, chord = _pairs(points, waypoints, radius)
    pairs = list(zip(waypoint.tolist(), chord.tolist(), strict=True))
    assert pairs == sorted(set(pairs))
    step = np.diff(points, axis=0)
    square = np.maximum((step**2).sum(axis=1), 1e-300)
    for k, w in enumerate(waypoints):
        share = np.clip(((w - points[:-1]) * step).sum(axis=1) / square, 0.0, 1.0)
        near = np.linalg.norm(points[:-1] + share[:, None] * step - w, axis=1) <= radius
        assert {(k, c) for c in np.flatnonzero(near).tolist()} <= set(pairs)
    # Chords up to the radius are searched together, others with such as are up to twice as long or half as long.
    lengths = np.linalg.norm(step, axis=1)[chord]
    middles = 0.5 * (points[chord] + points[chord + 1])
    reach = radius + np.maximum(0.5 * radius, lengths)
    assert (np.linalg.norm(waypoints[waypoint] - middles, axis=1) <= reach).all()


def test_one_long_chord_does_not_make_pairs_of_all():
    """Nine million pairs, were all searched as far as the longest chord reaches; all but a few are far apart."""
    x = np.linspace(0.0, 1.0, 3001)
    found = visits(course(on_x(*x, 5.0)), course(on_x(*x, 5.0)), 1e-4)
    assert found is not None
    np.testing.assert_allclose(found.times, np.arange(3002), atol=1e-6)


def test_a_search_that_would_fill_the_memory_is_not_made():
    """Each of three thousand chords near each of three thousand waypoints."""
    assert visits(course(np.zeros((3001, 3))), course(np.zeros((3001, 3))), 1e-4) is None
    assert visits(course(np.zeros((301, 3))), course(np.zeros((301, 3))), 1e-4) is not None


@pytest.mark.parametrize("seed", range(6))
def test_stays_are_those_of_dense_moments(seed):
    points, waypoints = wandering(seed)
    radius, per = 0.4, 400
    motion, path = course(points), course(waypoints)
    found = _passes(motion, path, np.zeros(25), radius, _pairs(points, waypoints, radius))
    moments = np.arange(40 * per + 1) / per
    dense = np.stack([np.interp(moments, np.arange(41), column) for column in points.T], axis=1)
    for k, w in enumerate(waypoints):
        away = np.linalg.norm(dense - w, axis=1)
        edges = np.diff(np.concatenate([[0], (away <= radius).astype(int), [0]]))
        begins, stops = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
        own = found.waypoint == k
        assert (found.enter[own] <= found.best[own]).all()
        assert (found.best[own] <= found.leave[own]).all()
        for at in (*found.enter[own], *found.leave[own]):
            assert np.linalg.norm([np.interp(at, np.arange(41), column) for column in points.T] - w) <= radius + 1e-9
        # What is shorter than the moments are apart may be missed by them.
        enter, leave, best = (x[own][found.leave[own] - found.enter[own] > 2.0 / per] for x in times_of(found))
        long = stops - begins > 1
        assert len(enter) == long.sum()
        np.testing.assert_allclose(enter, moments[begins[long]], atol=1.01 / per)
        np.testing.assert_allclose(leave, moments[stops[long]], atol=1.01 / per)
        for low, high, at in zip(begins[long], stops[long], best, strict=True):
            point = [np.interp(at, np.arange(41), column) for column in points.T]
            assert np.linalg.norm(point - w) <= away[low : high + 1].min() + 1e-9
    assert (np.lexsort((found.enter, found.waypoint)) == np.arange(len(found.waypoint))).all()


def times_of(passes):
    return passes.enter, passes.leave, passes.best


def test_a_motion_that_stands_is_near_or_is_not():
    """Two seconds at 0, a leap, two at 1: only what stands near counts, from its first sample to its last."""
    found = _passes(
        course(on_x(0, 0, 0, 1, 1, 1)),
        course(on_x(0.0, 1.0)),
        np.zeros(2),
        0.1,
        _pairs(on_x(0, 0, 0, 1, 1, 1), on_x(0.0, 1.0), 0.1),
    )
    assert found.waypoint.tolist() == [0, 1]
    np.testing.assert_allclose(found.enter, [0.0, 2.9], atol=1e-12)
    np.testing.assert_allclose(found.leave, [2.1, 5.0], atol=1e-12)
    assert found.best[0] in (0.0, 1.0, 2.0)
    assert found.best[1] in (3.0, 4.0, 5.0)


def test_nothing_is_passed_by_a_motion_elsewhere():
    found = visits(course(on_x(5.0, 6.0, 7.0)), course(on_x(0.0, 1.0, 3.0)), 0.1)
    assert found.missed.all()
    np.testing.assert_allclose(found.times, [0.0, 2.0 / 3.0, 2.0])


@pytest.mark.parametrize("ahead", [0.0, 0.3])
def test_both_begin_and_end_together_whatever_is_nearest(ahead):
    """The motion goes beyond either end of the path, where it is nearest to them a little later and earlier."""
    motion = course(on_x(-ahead, *range(1, 10), 10 + ahead))
    found = visits(motion, course(on_x(0.0, 0.5, 1.0, 5.0, 9.5, 10.0)), 0.45)
    assert not found.missed.any()
    begin = (0.5 + ahead) / (1.0 + ahead)
    np.testing.assert_allclose(found.times, [0.0, begin, 1.0, 5.0, 10.0 - begin, 10.0], atol=1e-12)


def test_what_is_missed_is_visited_between_its_neighbours():
    """By arc length: the motion goes straight past a spike of the path, from which it stays away."""
    spike = np.array([[0.0, 0, 0], [2.0, 0, 0], [2.0, 3, 0], [2.0, 0, 0], [4.0, 0, 0]])
    motion = course(on_x(*np.linspace(0.0, 4.0, 9)))
    found = visits(motion, course(spike), 0.1)
    assert found.missed.tolist() == [False, False, True, False, False]
    np.testing.assert_allclose(found.times, [0.0, 4.0, 4.0, 4.0, 8.0], atol=1e-12)
    blind = np.array([[0.0, 0, 0], [1.0, 0, 0], [1.5, 1.0, 0], [3.0, 0, 0], [4.0, 0, 0]])
    found = visits(motion, course(blind), 0.1)
    assert found.missed.tolist() == [False, False, True, False, False]
    legs = np.hypot(0.5, 1.0), np.hypot(1.5, 1.0)
    np.testing.assert_allclose(found.times, [0.0, 2.0, 2.0 + 4.0 * legs[0] / sum(legs), 6.0, 8.0], atol=1e-12)


def test_the_first_waypoint_may_be_missed_and_others_not():
    motion = course(on_x(*range(9)))
    found = visits(motion, course([[0.0, 1.0, 0], [2.0, 0, 0], [5.0, 0, 0], [8.0, 1.0, 0]]), 0.1)
    assert found.missed.tolist() == [True, False, False, True]
    np.testing.assert_allclose(found.times, [0.0, 2.0, 5.0, 8.0], atol=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_the_earliest_stays_in_order(seed):
    """One waypoint after the other: the earliest of its stays that does not end before the latest begin so far."""
    rng = np.random.default_rng(seed)
    waypoint = np.sort(rng.integers(0, 4, 8))
    enter = rng.integers(0, 12, 8).astype(float)
    enter = enter[np.lexsort((enter, waypoint))]
    passes = _Passes(waypoint, enter, enter + rng.integers(0, 4, 8), enter)
    chosen = _in_order(passes, 4)
    now = 0.0
    for k in range(4):
        possible = [c for c in range(8) if waypoint[c] == k and passes.leave[c] >= now]
        assert chosen[k] == (possible[0] if possible else -1)
        if possible:
            now = max(now, enter[possible[0]])


def along(points, moments):
    return np.stack([np.interp(moments, np.arange(len(points)), column) for column in points.T], axis=-1)


@pytest.mark.parametrize("weight", [0.0, 0.02])
@pytest.mark.parametrize("seed", range(20))
def test_waypoints_in_doubt_are_assigned_together(seed, weight):
    """Three waypoints too near each other for a noisy motion, each with a stay: against all times in order on a grid.

    All are in doubt where their axes count; else those whose closest moments are out of order.
    """
    rng = np.random.default_rng(seed)
    count, per = 9, 8
    points = on_x(*np.linspace(0.0, 0.4, count)) + 0.12 * rng.normal(size=(count, 3))
    waypoints = on_x(*np.linspace(0.0, 0.4, 5)) + 0.05 * rng.normal(size=(5, 3))
    tilt = 0.3 * rng.normal(size=(count + 5, 3)) + UP
    begins = rng.integers(0, 5, 3)
    stops = np.maximum.accumulate(begins + rng.integers(0, 5, 3)).clip(max=7)

    def cost(k, moments):
        off = ((along(points, moments) - waypoints[k]) ** 2).sum(axis=-1)
        return off + weight * ((along(tilt[:count], moments) - tilt[count + k]) ** 2).sum(axis=-1)

    grids = [np.arange(per * a, per * (b + 1) + 1) / per for a, b in zip(begins, stops, strict=True)]
    costs = [cost(k, grid) for k, grid in zip((1, 2, 3), grids, strict=True)]
    closest = np.array([grid[of.argmin()] for grid, of in zip(grids, costs, strict=True)])
    # The first and the last waypoint are missed, and not in doubt.
    passes = _Passes(np.array([1, 2, 3]), begins + 0.3, stops + 0.6, closest)
    guess = np.array([0.0, *passes.best, count - 1.0])
    chosen, weights = np.array([-1, 0, 1, 2, -1]), np.full(5, weight)
    settled = _settled(Course(points, tilt[:count]), Course(waypoints, tilt[count:]), weights, chosen, passes, guess)
    assert settled[[0, 4]].tolist() == [0.0, count - 1.0]
    orders = product(*(range(len(grid)) for grid in grids))
    ordered = [(a, b, c) for a, b, c in orders if grids[0][a] <= grids[1][b] <= grids[2][c]]
    best = min(costs[0][a] + costs[1][b] + costs[2][c] for a, b, c in ordered)
    assert sum(float(cost(k, settled[k])) for k in (1, 2, 3)) <= best + 1e-12
    assert (np.diff(settled[1:4]) >= -1.0).all()  # in order but within one chord, which is left to the caller
    for k, t in enumerate(settled[1:4]):
        assert begins[k] <= t <= stops[k] + 1


def test_a_turn_that_the_motion_reaches_with_its_last_sample_alone():
    found = visits(course(on_x(0, 1, 2)), course(on_x(0, 3, 3, 3)), 1.0, weight=1.0)
    assert not found.missed.any()
    assert found.times.tolist() == [0.0, 2.0, 2.0, 2.0]
