"""Bare waypoints to samples: SciPy's spline and toppra's own chain as oracles."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from pentapod.base.errors import InputError
from pentapod.base.refusal import Refusal
from pentapod.timing import WaypointMotion, through_waypoints


def waves(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Stations (count,), unevenly spaced, and waypoints (count, 3) on sums of waves."""
    rng = np.random.default_rng(seed)
    s = np.cumsum(rng.uniform(0.2, 1.8, count)) / count
    return s, np.stack([np.sin((3 + k) * s + k) + 0.2 * np.cos(17 * s) for k in range(3)], axis=1)


def motion(s, q, engine="core", period=1e-3, velocity=0.8, acceleration=5.0) -> WaypointMotion:
    found = through_waypoints(s, q, velocity=velocity, acceleration=acceleration, period=period, engine=engine)
    assert isinstance(found, WaypointMotion)
    return found


@given(st.integers(4, 60), st.integers(1, 7), st.integers(0, 10**6), st.sampled_from([1e-6, 1.0, 1e4]))
@settings(max_examples=60, deadline=None)
def test_waypoint_samples_are_on_scipys_spline(count, columns, seed, scale):
    rng = np.random.default_rng(seed)
    s = scale * np.cumsum(rng.uniform(0.1, 2.0, count))
    q = scale * rng.normal(size=(count, columns))
    found = motion(s, q, velocity=scale, acceleration=7 * scale, period=0.01)
    times = np.arange(len(found.rows)) * found.period
    expected = CubicSpline(s, q)(found.law(times))
    assert np.abs(found.rows - expected).max() < 1e-12 * np.abs(q).max()
    assert (found.rows[0] == q[0]).all()
    assert (found.rows[-1] == q[-1]).all()
    assert times[-2] < found.law.duration <= times[-1] + 1e-9


def test_four_waypoints_are_one_cubic():
    s = np.array([0.0, 0.3, 0.4, 1.0])
    found = motion(s, (s**3 - 2 * s)[:, None], period=1e-2)
    at = found.law(np.arange(len(found.rows)) * 1e-2)
    assert np.allclose(found.rows[:, 0], at**3 - 2 * at, rtol=0, atol=1e-14)


def test_waypoint_motion_keeps_the_limits_and_uses_one_everywhere():
    s, q = waves(800)
    velocity, acceleration = np.array([0.4, 0.6, 0.5]), np.array([3.0, 4.0, 5.0])
    found = motion(s, q, velocity=velocity, acceleration=acceleration)
    curve, law = CubicSpline(s, q), found.law
    first, second, v = curve(s, 1), curve(s, 2), law.speeds[:, None]
    rates = np.abs(first * v) / velocity
    ends = [
        np.abs(first[side] * law.accelerations[:, None] + second[side] * v[side] ** 2) / acceleration
        for side in (slice(None, -1), slice(1, None))
    ]
    most = np.maximum(*ends).max(axis=1)
    assert max(rates.max(), most.max()) < 1 + 1e-9
    # Bang-bang: in nearly each stage one limit leaves nothing.
    used = np.maximum(most, np.maximum(rates[:-1], rates[1:]).max(axis=1))
    assert np.quantile(used, 0.05) > 0.99


def test_waypoint_motions_of_both_engines_agree():
    s, q = waves(500)
    core, peer = (motion(s, q, engine) for engine in ("core", "toppra"))
    assert peer.law.duration == pytest.approx(core.law.duration, rel=1e-5)


def test_waypoint_motion_lasts_as_long_as_by_toppra():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        toppra = pytest.importorskip("toppra")
        from toppra import algorithm, constraint
    toppra.setup_logging(level="ERROR")
    s, q = waves(1500, seed=4)
    one = np.ones((3, 1))
    limits = [
        constraint.JointVelocityConstraint(0.8 * one * [-1, 1]),
        constraint.JointAccelerationConstraint(
            5.0 * one * [-1, 1], discretization_scheme=constraint.DiscretizationType.Interpolation
        ),
    ]
    solver = algorithm.TOPPRA(
        limits, toppra.SplineInterpolator(s, q), gridpoints=s, parametrizer="ParametrizeConstAccel"
    )
    peer = solver.compute_trajectory(0.0, 0.0)
    assert motion(s, q).law.duration == pytest.approx(peer.duration, rel=1e-5)


def test_waypoints_that_do_not_move_are_refused():
    found = through_waypoints([0, 1, 2, 3, 4], np.ones((5, 2)), velocity=1, acceleration=1, period=1e-3)
    assert isinstance(found, Refusal)
    assert "bounds" in found.cause


@pytest.mark.parametrize(
    "changes",
    [
        {"stations": [0.0, 1.0, 1.0, 2.0]},
        {"stations": [0.0, 1.0, 2.0]},
        {"stations": [[0.0], [1.0], [2.0], [3.0]]},
        {"waypoints": [0.0, 1.0, 2.0, 3.0]},
        {"waypoints": [[0.0], [np.nan], [2.0], [3.0]]},
        {"velocity": 0.0},
        {"velocity": [1.0, 1.0]},
        {"acceleration": np.inf},
        {"period": -1.0},
        {"engine": "fast"},
    ],
)
def test_waypoints_bad_input_is_named(changes):
    usual = {
        "stations": [0.0, 1.0, 2.0, 3.0],
        "waypoints": [[0.0], [1.0], [3.0], [2.0]],
        "velocity": 1.0,
        "acceleration": 1.0,
        "period": 0.01,
    }
    through_waypoints(**usual)
    with pytest.raises(InputError):
        through_waypoints(**(usual | changes))
