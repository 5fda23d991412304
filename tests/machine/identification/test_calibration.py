"""Calibration: against scipy with finite differences of pentakins' struts, Monte Carlo, and known gauge freedoms."""

import numpy as np
import pytest
from scipy.linalg import block_diag, null_space
from scipy.optimize import least_squares, minimize_scalar

from pentapod.base.errors import ArrayError
from pentapod.kinematics import AsBuiltPentapod, LinearPentapod
from pentapod.machine import calibrate
from pentapod.machine.calibration.parameters import PARAMETERS

BASE = 0.2 * np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])


@pytest.fixture
def nominal() -> LinearPentapod:
    return LinearPentapod.quadratic(BASE, 0.5)


@pytest.fixture
def real(nominal: LinearPentapod) -> AsBuiltPentapod:
    rng = np.random.default_rng(1)
    return AsBuiltPentapod.of(
        nominal,
        base_errors=rng.normal(size=(5, 3)) * 5e-4,
        offset_errors=rng.normal(size=5) * 3e-4,
        radii=rng.uniform(0.01, 0.03, 5),
        zeros=rng.normal(size=5) * 1e-3,
    )


def poses(n: int, seed: int = 0, lean: float = 0.6) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    p = rng.uniform((-0.25, -0.25, 0.35), (0.25, 0.25, 0.85), (n, 3))
    i = np.c_[rng.uniform(-lean, lean, (n, 2)), np.ones(n)]
    return p, i / np.linalg.norm(i, axis=1)[:, None]


def flat(machine: AsBuiltPentapod) -> np.ndarray:
    return np.c_[machine.base, machine.offsets, machine.radii, machine.zeros].ravel()


def struts(theta: np.ndarray, p: np.ndarray, i: np.ndarray) -> np.ndarray:
    """Readings by pentakins' formula, in frames built from cross products."""
    rows = theta.reshape(5, 6)
    e1 = np.cross(i, [0.0, 1.0, 0.0])
    e1 /= np.linalg.norm(e1, axis=1)[:, None]
    e2 = np.cross(i, e1)
    d = rows[:, :3] - p[:, None]
    x, y, z = (np.einsum("nkc,nc->nk", d, e) for e in (e1, e2, i))
    return np.sqrt((z - rows[:, 3]) ** 2 + (np.sqrt(x * x + y * y) - rows[:, 4]) ** 2) + rows[:, 5]


def test_all_thirty_numbers_are_found_without_noise(nominal, real):
    p, i = poses(60)
    found = calibrate(p, i, real.leg_lengths(p, i), nominal, leg_sigma=1e-7)
    assert found.converged
    assert found.identified == PARAMETERS
    assert found.held == found.gauges == found.at_bound == ()
    assert np.abs(flat(found.machine) - flat(real)).max() < 1e-10
    assert np.abs(found.residuals).max() < 1e-13


def test_scipy_finds_the_same_with_finite_differences(nominal, real):
    p, i = poses(50, seed=2)
    rng = np.random.default_rng(3)
    legs = real.leg_lengths(p, i) + rng.normal(size=(50, 5)) * 1e-5
    found = calibrate(p, i, legs, nominal, leg_sigma=1e-5)
    start = flat(AsBuiltPentapod.of(nominal))
    start[4::6] = 0.02
    other = least_squares(lambda x: (struts(x, p, i) - legs).ravel() / 1e-5, start, "3-point", xtol=1e-15, ftol=1e-15)
    sigma = np.sqrt(np.diag(found.covariance))
    assert (np.abs(flat(found.machine) - other.x) < 1e-3 * sigma).all()
    assert found.chi_square == pytest.approx(2.0 * other.cost, rel=1e-6)
    expected = np.linalg.inv(other.jac.T @ other.jac)
    assert np.abs(found.covariance - expected).max() < 1e-3 * np.abs(expected).max()
    assert found.sigma("leg 2 offset") == pytest.approx(np.sqrt(expected[9, 9]), rel=1e-3)


@pytest.mark.parametrize("trials", [60, pytest.param(1000, marks=pytest.mark.slow)])
def test_the_covariance_is_that_of_many_calibrations(nominal, real, trials):
    p, i = poses(50, seed=4)
    legs = real.leg_lengths(p, i)
    s_l, s_p, s_i = 5e-6, 1e-5, 2e-5
    rng = np.random.default_rng(5)
    deviations, squares = [], []
    for _ in range(trials):
        turn = np.cross(rng.normal(size=i.shape), i) * s_i  # a normal error of s_i to either side
        seen = i + turn
        seen /= np.linalg.norm(seen, axis=1)[:, None]
        found = calibrate(
            p + rng.normal(size=p.shape) * s_p,
            seen,
            legs + rng.normal(size=legs.shape) * s_l,
            nominal,
            leg_sigma=s_l,
            position_sigma=s_p,
            direction_sigma=s_i,
        )
        assert found.converged
        assert len(found.identified) == 30
        deviations.append(flat(found.machine) - flat(real))
        squares.append(found.chi_square / found.freedom)
    deviations = np.array(deviations)
    scatter = np.sqrt((deviations**2).mean(axis=0) / np.diag(found.covariance))
    loose = 5.0 / np.sqrt(2.0 * trials)  # five standard deviations of a standard deviation
    assert (np.abs(scatter - 1.0) < loose).all()
    distance = np.einsum("ta,ab,tb->t", deviations, np.linalg.inv(found.covariance), deviations).mean()
    assert distance == pytest.approx(30.0, abs=5.0 * np.sqrt(60.0 / trials) + 0.3)
    assert np.mean(squares) == pytest.approx(1.0, abs=5.0 * np.sqrt(2.0 / (220 * trials)) + 0.01)


def test_errors_of_the_legs_are_estimated_from_the_residuals(nominal, real):
    p, i = poses(200, seed=6)
    rng = np.random.default_rng(7)
    found = calibrate(p, i, real.leg_lengths(p, i) + rng.normal(size=(200, 5)) * 2e-5, nominal)
    assert found.leg_sigma == pytest.approx(2e-5, rel=0.15)
    away = np.abs(flat(found.machine) - flat(real)) / np.sqrt(np.diag(found.covariance))
    assert away.max() < 4.5


def measured_with_errors(nominal, real, rng, ratio: float, leg_sigma: float = 5e-6, n: int = 50):
    """One calibration from readings with errors of leg_sigma and poses whose errors are `ratio` times as large."""
    p, i = poses(n, seed=4)
    s_p, s_i = ratio * leg_sigma, ratio * leg_sigma / 0.4
    seen = i + np.cross(rng.normal(size=i.shape), i) * s_i
    legs = real.leg_lengths(p, i) + rng.normal(size=(n, 5)) * leg_sigma
    seen, p = seen / np.linalg.norm(seen, axis=1)[:, None], p + rng.normal(size=p.shape) * s_p
    return calibrate(p, seen, legs, nominal, position_sigma=s_p, direction_sigma=s_i), (p, seen, legs, s_p, s_i)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.0, 0.3, 1.0, 2.0, 3.0, 5.0, 10.0])
def test_two_sigma_hold_what_they_should_whatever_the_errors_of_the_poses(nominal, real, ratio):
    rng, outside, fit = np.random.default_rng(21), [], []
    for _ in range(600):
        found, _ = measured_with_errors(nominal, real, rng, ratio)
        assert found.converged
        away = np.abs(flat(found.machine) - flat(real)) / np.sqrt(np.diag(found.covariance))
        outside.append((away > 2.0).mean())
        fit.append(found.chi_square / found.freedom)
    assert 0.04 <= np.mean(outside) <= 0.055
    assert np.mean(fit) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("ratio", [1.0, 3.0, 10.0])
def test_residuals_are_as_large_as_the_estimated_errors_say(nominal, real, ratio):
    rng = np.random.default_rng(22)
    fits = [measured_with_errors(nominal, real, rng, ratio)[0] for _ in range(8)]
    mean = np.mean([fit.chi_square / fit.freedom for fit in fits])
    assert mean == pytest.approx(1.0, abs=3.0 * np.sqrt(2.0 / (220 * 8)))


@pytest.mark.parametrize("ratio", [0.0, 0.5, 2.0])
def test_estimated_errors_are_the_most_likely_ones(nominal, real, ratio):
    """The likelihood of what the parameters cannot change, from dense matrices and finite differences."""
    found, (p, i, legs, s_p, s_i) = measured_with_errors(nominal, real, np.random.default_rng(23), ratio, n=20)
    theta, h = flat(found.machine), 1e-6
    columns = [(struts(theta + d, p, i) - struts(theta - d, p, i)).ravel() / (2 * h) for d in h * np.eye(30)]
    free = null_space(np.stack(columns, axis=1).T)
    combined = free.T @ (legs - struts(theta, p, i)).ravel()
    moves, start = [], flat(AsBuiltPentapod.of(nominal))  # errors of poses move the nominal machine's readings
    for position, direction in zip(p, i, strict=True):
        by_p = [(position + d, direction, position - d, direction) for d in h * np.eye(3)]
        by_i = [(position, direction + d, position, direction - d) for d in h * null_space(direction[None]).T]
        changes = [
            struts(start, q[None], j[None])[0] - struts(start, r[None], k[None])[0] for q, j, r, k in by_p + by_i
        ]
        change = np.stack(changes, axis=1) / (2 * h) * ([s_p] * 3 + [s_i] * 2)
        moves.append(change @ change.T)
    added = free.T @ block_diag(*moves) @ free

    def cost(log_sigma: float) -> float:
        covariance = added + np.exp(2.0 * log_sigma) * np.eye(len(combined))
        return float(np.linalg.slogdet(covariance)[1] + combined @ np.linalg.solve(covariance, combined))

    best = minimize_scalar(cost, bounds=(np.log(1e-7), np.log(1e-4)), method="bounded", options={"xatol": 1e-6})
    assert found.leg_sigma == pytest.approx(np.exp(best.x), rel=2e-3)


def test_poses_that_explain_all_residuals_leave_no_error_to_the_legs(nominal, real):
    p, i = poses(40, seed=24)
    found = calibrate(p, i, real.leg_lengths(p, i), nominal, position_sigma=1e-5, direction_sigma=1e-5)
    assert found.leg_sigma < 1e-9
    assert found.converged
    assert np.abs(flat(found.machine) - flat(real)).max() < 1e-9


def test_where_the_tool_never_leans_offset_and_base_joint_slide_together(nominal):
    rng = np.random.default_rng(8)
    real = AsBuiltPentapod.of(nominal, base_errors=rng.normal(size=(5, 3)) * 3e-4, zeros=rng.normal(size=5) * 3e-4)
    p, _ = poses(60, seed=9)
    axis = np.array([0.48, -0.36, 0.8])
    i = np.tile(axis, (60, 1))
    found = calibrate(p, i, real.leg_lengths(p, i), nominal, leg_sigma=1e-6, identify=("base", "offsets", "zeros"))
    assert found.converged
    assert {f"leg {k} offset" for k in range(1, 6)} <= set(found.held)
    assert len(found.gauges) == 5
    assert found.gauges[1] == "leg 2: offset +1, x +0.48, y -0.36, z +0.8 change no reading"
    slid = AsBuiltPentapod(
        found.machine.base + 0.01 * axis, found.machine.offsets + 0.01, found.machine.radii, found.machine.zeros
    )
    assert np.abs(slid.leg_lengths(p, i) - found.machine.leg_lengths(p, i)).max() < 1e-15
    assert np.abs(found.residuals).max() < 1e-12, "all the same it reads as the real machine does in such poses"
    assert found.sigma("leg 1 offset") == 0.0
    assert found.sigma("leg 1 z") > 0.0


def test_few_poses_identify_no_more_than_they_read(nominal, real):
    p, i = poses(3)
    found = calibrate(p, i, real.leg_lengths(p, i), nominal, leg_sigma=1e-6)
    assert len(found.identified) <= 15
    assert len(found.identified) + len(found.held) == 30
    assert len(found.gauges) == len(found.held)
    with pytest.raises(ArrayError, match="cannot tell their own errors"):
        calibrate(p, i, real.leg_lengths(p, i), nominal)


def test_what_noise_would_hide_is_held(nominal, real):
    p, i = poses(40, lean=0.02)
    legs = real.leg_lengths(p, i)
    sharp, blunt = (calibrate(p, i, legs, nominal, leg_sigma=sigma) for sigma in (1e-9, 2e-3))
    assert len(blunt.identified) < len(sharp.identified)
    assert max(blunt.sigma(name) for name in blunt.identified) < 0.1


def test_radii_stay_possible(nominal):
    real = AsBuiltPentapod.of(nominal, zeros=1e-4)
    p, i = poses(50, seed=10)
    legs = real.leg_lengths(p, i) + np.random.default_rng(11).normal(size=(50, 5)) * 2e-5
    found = calibrate(p, i, legs, nominal, leg_sigma=2e-5)
    assert found.converged
    assert (found.machine.radii >= 0.0).all()
    assert found.at_bound
    assert all("radius" in name for name in found.at_bound)
    assert set(found.at_bound) <= set(found.held)


def test_only_what_is_asked_for_moves(nominal, real):
    p, i = poses(50)
    found = calibrate(p, i, real.leg_lengths(p, i), nominal, leg_sigma=1e-5, identify=["zeros"])
    assert found.identified == tuple(f"leg {k} zero" for k in range(1, 6))
    assert np.array_equal(found.machine.base, np.c_[nominal.base, np.zeros(5)])
    again = calibrate(p, i, real.leg_lengths(p, i), found.machine, leg_sigma=1e-5)
    assert np.abs(flat(again.machine) - flat(real)).max() < 1e-9


def test_bad_input(nominal, real):
    p, i = poses(10)
    legs = real.leg_lengths(p, i)
    cases = [
        (lambda: calibrate(p, i, legs[:9], nominal), r"legs has shape \(9, 5\); expected shape \(10, 5\)"),
        (lambda: calibrate(p, 2.0 * i, legs, nominal), "is not a unit vector"),
        (lambda: calibrate(p, 0.5 * i, legs, nominal), r"is not a unit vector \(got 0\.(5|49999)"),
        (lambda: calibrate(p, i, legs, nominal, leg_sigma=-1.0), "leg_sigma must not be negative"),
        (lambda: calibrate(p, i, legs, nominal, leg_sigma=0.0), "without errors of the legs"),
        (lambda: calibrate(p, i, legs, nominal, identify=["ofsets"]), 'did you mean "offsets"'),
        (lambda: calibrate(p, i, legs * np.nan, nominal), "legs is not finite"),
        (lambda: calibrate(p[:0], i[:0], legs[:0], nominal), "no poses"),
        (lambda: calibrate(p, i, legs, nominal, leg_sigma=1e-6).sigma("leg 6 x"), "unknown parameter"),
    ]
    for call, message in cases:
        with pytest.raises(ArrayError, match=message):
            call()
