"""The matching bounds the Fréchet distance, and is tight for motions that follow their path."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.verify.replay.free_space import PosedPolyline
from pentapod.verify.replay.path_matching import match, pose_at


def course(points, axes=None):
    points = np.asarray(points, dtype=float)
    if axes is None:
        axes = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
    return PosedPolyline(points, np.asarray(axes, dtype=float))


def worst(found):
    return max(found.distances.max(), found.waypoint_distances.max())


def stretch(p, a, b, radius):
    """Parameters in [0, 1] of the segment a b within the radius of the point p, or None."""
    d, f = b - a, a - p
    square, half, rest = d @ d, d @ f, f @ f - radius**2
    if square == 0.0:
        return (0.0, 1.0) if rest <= 0 else None
    disc = half**2 - square * rest
    if disc < 0:
        return None
    low, high = (-half - np.sqrt(disc)) / square, (-half + np.sqrt(disc)) / square
    low, high = max(low, 0.0), min(high, 1.0)
    return (low, high) if low <= high else None


def frechet_at_most(p, q, radius):
    """Whether the Fréchet distance of two polylines is ≤ radius: free-space diagram of Alt and Godau (1995)."""
    if np.linalg.norm(p[0] - q[0]) > radius or np.linalg.norm(p[-1] - q[-1]) > radius:
        return False
    n, m = len(p) - 1, len(q) - 1
    # Reachable parts of the cells' borders: at the vertices of p along q, and at those of q along p.
    at_p, at_q = np.full((n + 1, m, 2), np.nan), np.full((n, m + 1, 2), np.nan)
    for i in range(n + 1):
        for j in range(m + 1):
            if j < m:
                free = stretch(p[i], q[j], q[j + 1], radius)
                at_p[i, j] = border(free, at_p[:, j], i, at_q[i - 1, j] if i else None, at_p[0, j - 1] if j else None)
            if i < n:
                free = stretch(q[j], p[i], p[i + 1], radius)
                at_q[i, j] = border(free, at_q[i], j, at_p[i, j - 1] if j else None, at_q[i - 1, 0] if i else None)
    return at_p[n, m - 1, 1] == 1.0 or at_q[n - 1, m, 1] == 1.0


def border(free, opposite, index, beside, before):
    """The reachable part of a border that is free in `free`.

    From the cell behind it (index > 0): anywhere when that cell is entered from the side, else not before the
    place where it is entered from the opposite border. On the rim: only along the rim from the corner.
    """
    nothing = (np.nan, np.nan)
    if not free:
        return nothing
    if index == 0:
        return free if free[0] == 0.0 and (before is None or before[1] == 1.0) else nothing
    start = 0.0 if not np.isnan(beside[0]) else opposite[index - 1][0]
    low = max(start, free[0])
    return (low, free[1]) if not np.isnan(start) and low <= free[1] else nothing


def frechet(p, q):
    low, high = 0.0, 100.0
    for _ in range(45):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if frechet_at_most(p, q, middle) else (middle, high)
    return high


def test_oracle_knows_segments():
    p, q = np.array([[0.0, 0, 0], [4, 0, 0]]), np.array([[0.0, 1, 0], [4, 3, 0]])
    assert frechet(p, q) == pytest.approx(3.0)
    zigzag = np.array([[0.0, 0, 0], [3, 0, 0], [1, 0, 0], [4, 0, 0]])
    assert frechet(p, zigzag) == pytest.approx(1.0)


small = st.integers(2, 7)


def reversing(seed):
    """A path with reversals shorter than twice the tolerance, a motion along it, and the tolerance it keeps.

    Both walk in steps of up to a few tolerances, forth and back; the motion wanders within the tolerance of a monotone
    way along the path, and stands here and there. So there is a matching within the tolerance, by construction.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 60))
    heading = np.cumsum(0.3 * rng.normal(size=n - 1))
    back = np.where(rng.random(n - 1) < rng.choice([0.1, 0.3, 0.5]), -1.0, 1.0)
    step = 2.0 * rng.random(n - 1) * back * rng.choice([1.0, 1.0, 4.0], size=n - 1)
    flat = np.stack([np.cos(heading), np.sin(heading), 0.2 * rng.normal(size=n - 1)], axis=1)
    path = np.concatenate([np.zeros((1, 3)), np.cumsum(step[:, None] * flat, axis=0)])
    # Every corner of the motion lies within the tolerance of the place that it belongs to, and so do those of the path.
    each = int(rng.integers(1, 12))
    ways = np.concatenate([np.arange(n), rng.uniform(0.0, n - 1.0, each * n), rng.integers(0, n, n // 4)])
    places = np.sort(ways)
    on = np.stack([np.interp(places, np.arange(n), column) for column in path.T], axis=1)
    off = rng.normal(size=on.shape)
    off *= rng.uniform(0.0, 1.0, len(on))[:, None] / np.linalg.norm(off, axis=1)[:, None]
    return path, on + off


@pytest.mark.parametrize("seeds", [range(150), pytest.param(range(150, 10_150), marks=pytest.mark.slow)])
def test_a_motion_within_the_tolerance_of_short_reversals_never_fails(seeds):
    """The largest distance of the construction is one; so no motion may look farther off than that."""
    for seed in seeds:
        path, motion = reversing(seed)
        assert worst(match(course(motion), course(path), 1.0)) <= 1.001, seed


@pytest.mark.parametrize("seeds", [range(8), pytest.param(range(8, 500), marks=pytest.mark.slow)])
def test_the_largest_distance_is_the_frechet_distance(seeds):
    """Not below it, which would be a false pass; above by a thousandth at most, within a few tolerances."""
    for seed in seeds:
        path, motion = reversing(seed)
        path, motion = path[:12], motion[: max(2, min(len(motion), 40))]
        exact = frechet(motion, path)
        for tolerance in (0.5 * exact, 0.9 * exact, exact, 1.5 * exact, 5.0 * exact):
            found = worst(match(course(motion), course(path), tolerance))
            assert exact * (1.0 - 1e-9) <= found <= exact * (1.0 + 2e-3), (seed, tolerance / exact)


def test_the_distance_is_that_of_the_discrete_oracle_between_dense_curves():
    """Another oracle that shares nothing: all couplings of dense points, by dynamic programming."""
    for seed in range(4):
        path, motion = reversing(seed)
        path, motion = path[:6], motion[:12]
        p, q = densely(motion, 60), densely(path, 60)
        apart = np.linalg.norm(p[:, None] - q[None, :], axis=2)
        table = np.empty_like(apart)
        table[0], table[:, 0] = np.maximum.accumulate(apart[0]), np.maximum.accumulate(apart[:, 0])
        for i in range(1, len(p)):
            for j in range(1, len(q)):
                table[i, j] = max(apart[i, j], min(table[i - 1, j], table[i - 1, j - 1], table[i, j - 1]))
        found = worst(match(course(motion), course(path), 1.0))
        grain = max(np.linalg.norm(np.diff(x, axis=0), axis=1).max() for x in (p, q))
        assert table[-1, -1] - grain <= found <= table[-1, -1] * 1.002


def test_steps_of_a_few_hundredths_of_a_millimetre_there_and_back():
    """An early pass of a waypoint, within the tolerance, leaves no time for those between: it must not be taken."""
    step, tolerance = 0.035, 0.02
    x = step * np.array([0.0, 1.0, 2.0, 1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 4.0])
    path = np.stack([x, 0.0 * x, 0.0 * x], axis=1)
    motion = densely(path, 7) + np.array([0.0, 0.0159, 0.0])
    motion[:, 0] += 0.003 * np.sin(np.arange(len(motion)))
    motion[[0, -1], 0] = path[[0, -1], 0]
    assert worst(match(course(motion), course(path), tolerance)) <= 0.0165


def test_what_the_motion_is_off_its_chords_counts():
    """Where it may be far off the chord the matching comes nearer: the sum is the least."""
    path = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    motion = densely(path, 40) + np.array([0.0, 0.5, 0.0])
    away = np.where(np.arange(40) == 17, 0.4, 0.0)
    assert match(course(motion), course(path), 1.0, chord_deviations=away).distances.max() == pytest.approx(0.5)
    found = match(course(motion), course(path), 0.8, chord_deviations=away)
    assert found.distances.max() == pytest.approx(0.5)


def test_axes_keep_order_where_a_matching_keeps_both():
    """The tilt centre stands; the axis trembles there and back: within the bound of the axes there is an order."""
    rng = np.random.default_rng(1)
    angle = np.radians(2.0) * np.cumsum(np.where(rng.random(60) < 0.4, -1.0, 1.0))
    moved = np.interp(np.linspace(0.0, 59.0, 600), np.arange(60), angle) + np.radians(1.5) * rng.uniform(-1, 1, 600)
    moved[[0, -1]] = angle[[0, -1]]
    spot = [np.stack([np.sin(a), 0.0 * a, np.cos(a)], axis=1) for a in (angle, moved)]
    path, motion = (course(np.zeros((len(a), 3)), a) for a in spot)
    found = match(motion, path, 1e-3, axis_bound=np.radians(1.6))
    assert max(found.angles.max(), found.waypoint_angles.max()) <= np.radians(1.61)


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**32 - 1), small, small, st.sampled_from([0.05, 0.5, 3.0]))
def test_never_below_the_frechet_distance(seed, n, m, tolerance):
    """Whatever the curves: the largest distance of the matching is at least their Fréchet distance."""
    random = np.random.default_rng(seed)
    path, motion = random.integers(0, 5, (n, 3)).astype(float), random.integers(0, 5, (m, 3)).astype(float)
    motion += 0.1 * random.standard_normal(motion.shape)
    found = match(course(motion), course(path), tolerance)
    assert worst(found) >= frechet(motion, path) - 1e-6


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), small)
def test_matching_is_in_order(seed, n):
    random = np.random.default_rng(seed)
    path, motion = random.standard_normal((n, 3)), random.standard_normal((40, 3))
    found = match(course(motion), course(path), 0.5)
    assert (np.diff(found.places) >= 0).all()
    assert (np.diff(found.times) >= 0).all()
    assert found.places[0] == 0.0
    assert found.places[-1] == n - 1
    # Between two waypoints' visits a sample belongs to the interval of these waypoints.
    k = np.arange(40)
    for j in range(n - 1):
        between = (k > found.times[j]) & (k < found.times[j + 1])
        assert ((found.places[between] >= j) & (found.places[between] <= j + 1)).all()


def densely(points, per_interval, noise=0.0, seed=0):
    points = np.asarray(points, dtype=float)
    f = np.arange(per_interval) / per_interval
    dense = (points[:-1, None] + f[:, None] * np.diff(points, axis=0)[:, None]).reshape(-1, points.shape[1])
    dense = np.concatenate([dense, points[-1:]])
    return dense + noise * np.random.default_rng(seed).uniform(-1, 1, dense.shape)


def zigzag(passes, spacing):
    rows = [[(x, spacing * k, 0.0) for x in np.linspace(0, 10, 21)][:: 1 if k % 2 == 0 else -1] for k in range(passes)]
    return np.concatenate(rows)


def retraces():
    up, down = [(0.0, 0, z) for z in range(6)], [(0.0, 0, z) for z in range(5, -1, -1)]
    return np.array([*down, *up[1:], *down[1:], (1.0, 0, 0)])


def circles():
    angle = np.linspace(0, 6 * np.pi, 241)
    return np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)


@pytest.mark.parametrize("tolerance", [0.01, 0.2])
@pytest.mark.parametrize("path", [zigzag(9, 0.5), retraces(), circles()], ids=["zigzag", "retraces", "circles"])
@pytest.mark.parametrize("per_interval", [1, 3, 40])
def test_motion_on_the_path_is_matched_to_the_noise(path, per_interval, tolerance):
    noise = 0.2 * tolerance
    found = match(course(densely(path, per_interval, noise)), course(path), tolerance)
    assert worst(found) <= tolerance


@pytest.mark.parametrize("pause", [2, 500])
def test_turn_on_the_spot_is_matched_by_the_axis(pause):
    """The tilt centre stands at x = 1 while the axis turns there and back; both wait there, too."""
    turn = np.radians(40.0) * np.sin(np.linspace(0, np.pi, 11))
    there = np.stack([np.sin(turn), 0 * turn, np.cos(turn)], axis=1)
    up = np.array([[0.0, 0.0, 1.0]])
    path = course([[0.0, 0, 0], *[[1.0, 0, 0]] * 11, [2.0, 0, 0]], np.concatenate([up, there, up]))
    fine = np.radians(40.0) * np.sin(np.linspace(0, np.pi, 201))
    turning = np.stack([np.sin(fine), 0 * fine, np.cos(fine)], axis=1)
    before = np.array([[x, 0, 0] for x in np.linspace(0, 1, 100)])
    after = before + np.array([1.0, 0, 0])
    spot = np.repeat([[1.0, 0, 0]], pause + 201, axis=0)
    axes = np.concatenate([np.repeat(up, 100 + pause, axis=0), turning, np.repeat(up, 100, axis=0)])
    found = match(course(np.concatenate([before, spot, after]), axes), path, 1e-3)
    assert worst(found) <= 1e-3
    assert max(found.angles.max(), found.waypoint_angles.max()) < np.radians(0.5)
    still = match(course(np.concatenate([before, spot, after]), np.repeat(up, len(axes), axis=0)), path, 1e-3)
    assert worst(still) <= 1e-3
    assert max(still.angles.max(), still.waypoint_angles.max()) == pytest.approx(np.radians(40.0), rel=0.02)


@pytest.mark.parametrize("angle", [0.0, 1e-8, 0.9])
def test_between_waypoints_points_are_on_the_line_and_axes_on_the_arc(angle):
    share = np.linspace(0.0, 1.0, 11)
    axes = np.array([[0.0, 0.0, 1.0], [np.sin(angle), 0.0, np.cos(angle)]])
    points, found = pose_at(course(np.array([[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]), axes), np.array([angle]), share)
    np.testing.assert_allclose(points, np.stack([1.0 + 2.0 * share, 0.0 * share, 0.0 * share], axis=1), atol=1e-15)
    expected = np.stack([np.sin(share * angle), 0.0 * share, np.cos(share * angle)], axis=1)
    np.testing.assert_allclose(found, expected, atol=1e-15)


def test_skipped_waypoints_are_named():
    path = zigzag(9, 0.5)
    skipping = np.concatenate([path[:84], path[126:]])
    found = match(course(densely(skipping, 20)), course(path), 0.01)
    far = np.flatnonzero(found.waypoint_distances > 0.01)
    assert far.min() >= 84
    assert far.max() < 126
    assert len(far) >= 38


def test_offset_is_measured_beyond_the_tolerance():
    path = zigzag(9, 0.5)
    moved = densely(path, 20) + np.array([0.0, 0.0, 0.07])
    assert worst(match(course(moved), course(path), 0.01)) == pytest.approx(0.07, rel=1e-6)
