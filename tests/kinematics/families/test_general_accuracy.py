"""How exact the general forward kinematics is where it is hard: nearly quadratic, C1 = 0, nearly singular."""

import mpmath as mp
import numpy as np
import pytest
from scipy.optimize import brentq

from pentapod.kinematics import GeneralPentapod, LinearPentapod, pose_jacobian, singularity_cofactors
from pentapod.kinematics.families.offsets import fit_delta

EPS = float(np.finfo(float).eps)
slow = pytest.mark.slow
BASE = np.array([(-0.4, 0.2), (-0.2, -0.4), (0.05, 0.1), (0.2, -0.4), (0.4, 0.4)])


def random_poses(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    i = rng.normal(size=(n, 3))
    return rng.uniform(-0.8, 0.8, (n, 3)), i / np.linalg.norm(i, axis=1)[:, None]


def inherent_error(pentapod, p: np.ndarray, i: np.ndarray) -> np.ndarray:
    """The backward-error bound: condition number times machine epsilon (metres and radians added)."""
    return (
        EPS
        * np.linalg.norm(pentapod.leg_lengths(p, i), axis=-1)
        * np.linalg.norm(pose_jacobian(pentapod, p, i), axis=(1, 2))
    )


def error(a: tuple, b: tuple) -> np.ndarray:
    return np.linalg.norm(a[0] - b[0], axis=-1) + np.linalg.norm(a[1] - b[1], axis=-1)


def exact_pose(pentapod, legs: np.ndarray, p: np.ndarray, i: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Newton in 50 digits on the leg equations, for the lengths as they are stored."""
    base, z = np.c_[pentapod.base, np.zeros(5)].tolist(), pentapod.offsets.tolist()
    with mp.workdps(50):
        x = mp.matrix([*p.tolist(), *i.tolist()])
        for _ in range(7):
            values, rows = [], []
            for a, s, length in zip(base, z, legs.tolist(), strict=True):
                d = [x[k] + mp.mpf(s) * x[3 + k] - mp.mpf(a[k]) for k in range(3)]
                values.append(sum(c * c for c in d) - mp.mpf(length) ** 2)
                rows.append([2 * c for c in d] + [2 * mp.mpf(s) * c for c in d])
            values.append(sum(x[3 + k] ** 2 for k in range(3)) - 1)
            rows.append([0, 0, 0] + [2 * x[3 + k] for k in range(3)])
            x -= mp.lu_solve(mp.matrix(rows), mp.matrix(values))
        assert mp.norm(mp.matrix(values)) < mp.mpf(10) ** -40
        found = np.array([float(c) for c in x])
    return found[:3], found[3:]


@pytest.mark.parametrize(
    "exponent", [-2, -8, -13, None, *(pytest.param(e, marks=slow) for e in (-4, -6, -10, -12, -14, -15))]
)
def test_near_the_quadratic_family_it_is_as_good_as_the_better_of_both(exponent: int | None) -> None:
    rng = np.random.default_rng(1)
    deviation = 0.0 if exponent is None else 10.0**exponent
    offsets = 0.02 + 0.6 * BASE[:, 0] * (1.0 + deviation * rng.uniform(-1, 1, 5))
    pentapod = GeneralPentapod(BASE, offsets)
    delta = fit_delta(BASE, offsets)
    closed = LinearPentapod.from_offsets(BASE, offsets, tolerance=1.0)
    p, i = random_poses(12, 2)
    legs = pentapod.leg_lengths(p, i)
    exact = tuple(np.array(c) for c in zip(*map(exact_pose, [pentapod] * 12, legs, p, i), strict=True))
    ours = error(pentapod.pose(legs, pentapod.branch(p, i)), exact)
    theirs = error(closed.pose(legs, closed.branch(p, i)), exact)
    bound = inherent_error(pentapod, p, i)
    # no worse than what the rounding of the lengths does; so the closed form can win by rounding only
    assert (ours < 10 * bound).all()
    assert (ours <= np.fmax(np.where(np.isnan(theirs), np.inf, theirs), 10 * bound)).all()
    if deviation > 1e-12:  # the closed form solves another machine: the test would notice if we did too
        assert np.nanmedian(theirs) > 1e-2 * deviation
        assert np.nanmedian(theirs) > 20 * np.median(ours)
    assert delta == pytest.approx(0.6, rel=2e-2)


def design_with_c1(change: float) -> GeneralPentapod:
    """C1 = det [x, y, xz, yz, 1] is 0, exactly, for change = 0, and the other cofactors are sound."""
    rng = np.random.default_rng(5)
    while True:
        x, y, z = rng.integers(-8, 9, (3, 5)) / 16.0
        design = np.stack([x, y, x * z, y * z, np.ones(5)], axis=1)
        low = design.copy()
        low[4, 1], low[4, 3] = 0.0, 0.0  # the determinant is affine in y_5: this is its value at y_5 = 0
        at_zero, at_one = np.linalg.det(low), 0.0
        low[4, 1], low[4, 3] = 1.0, z[4]
        at_one = np.linalg.det(low)
        if abs(at_one - at_zero) < 1e-3:
            continue
        y5 = np.round(-at_zero / (at_one - at_zero) * 64) / 64
        candidate = np.stack([x, np.r_[y[:4], y5]], axis=1)
        try:
            pentapod = GeneralPentapod(candidate, z)
        except ValueError:
            continue
        cofactors = singularity_cofactors(pentapod)
        if abs(y5) < 1 and cofactors[0] == 0.0 and np.abs(cofactors[1:5]).min() > 1e-4:
            shifted = candidate.copy()
            shifted[4, 1] += change
            return GeneralPentapod(shifted, z)


@pytest.mark.parametrize(
    "change", [0.0, 1e-8, *(pytest.param(c, marks=slow) for c in (1e-16, 1e-14, 1e-11, 1e-5, 1e-2))]
)
def test_nothing_happens_where_c1_vanishes(change: float) -> None:
    pentapod = design_with_c1(change)
    c1 = singularity_cofactors(pentapod)[0]
    assert (c1 == 0.0) == (change == 0.0)
    p, i = random_poses(5000, 6)
    legs = pentapod.leg_lengths(p, i)
    found = pentapod.pose(legs, pentapod.branch(p, i))
    assert (error(found, (p, i)) < 10 * inherent_error(pentapod, p, i)).all()
    positions, directions = pentapod.assembly_modes(legs)
    np.testing.assert_allclose(
        pentapod.leg_lengths(positions, directions), np.repeat(legs[:, None], 4, axis=1), rtol=1e-11
    )


@pytest.mark.parametrize(
    "metres", [1e-1, 1e-3, 1e-6, *(pytest.param(m, marks=slow) for m in (1.0, 1e-2, 1e-4, 1e-5, 1e-7, 1e-8, 1e-9))]
)
def test_near_a_singularity_the_error_is_that_of_the_rounded_lengths(metres: float) -> None:
    pentapod = GeneralPentapod(BASE, [-0.3, 0.2, 0.1, -0.15, 0.4])
    rng, tried = np.random.default_rng(7), 0
    for p, i in zip(*random_poses(400, 8), strict=True):
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)

        def value(s: float, p: np.ndarray = p, way: np.ndarray = way, i: np.ndarray = i) -> float:
            return float(pentapod.order_value(p + s * way, i))

        if value(-1.0) * value(1.0) > 0:
            continue
        p = p + (float(brentq(value, -1.0, 1.0, xtol=1e-16)) + metres) * way  # noqa: PLW2901
        mode = pentapod.branch(p, i)
        bound = float(inherent_error(pentapod, p[None], i[None])[0])
        found = pentapod.pose(pentapod.leg_lengths(p, i), mode)
        tried += 1
        assert error(found, (p, i)) < 10 * bound  # and so not NaN
        assert pentapod.branch(*found)[0] == mode[0]
        if bound < 1e-2 * metres:  # and w = 0 is not within rounding either
            np.testing.assert_array_equal(pentapod.branch(*found), mode)
    assert tried > 100


@pytest.mark.parametrize("metres", [0.0, 1e-15, 1e-12, 1e-9, 1e-7, 1e-4])
def test_the_order_is_always_the_one_that_was_asked_for(metres: float) -> None:
    rng, tried, worst = np.random.default_rng(9), 0, []
    for offsets in ([-0.3, 0.2, 0.1, -0.15, 0.4], 0.02 + 0.6 * BASE[:, 0], rng.uniform(-0.5, 0.5, 5)):
        pentapod = GeneralPentapod(BASE, offsets)
        p, i = random_poses(1500, 10)
        way = rng.normal(size=(1500, 3))
        way /= np.linalg.norm(way, axis=1)[:, None]
        ends = [pentapod.order_value(p + s * way, i) for s in (-1.0, 1.0)]
        p, i, way, first = (values[ends[0] * ends[1] < 0] for values in (p, i, way, ends[0]))
        low, high = np.full(len(p), -1.0), np.full(len(p), 1.0)
        for _ in range(60):
            middle = 0.5 * (low + high)
            same = pentapod.order_value(p + middle[:, None] * way, i) * first > 0
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        legs = pentapod.leg_lengths(p + (low - metres)[:, None] * way, i)
        for order in (1, -1):
            found = pentapod.pose(legs, (order, 1))
            known = np.isfinite(found[0][:, 0])
            assert known.mean() > 0.99
            assert (pentapod.branch(*found)[known, 0] == order).all()
            worst.append(np.abs(pentapod.leg_lengths(*found) - legs)[known].max(axis=1))
        tried += len(p)
    assert tried > 1500
    residual = np.concatenate(worst)
    assert np.median(residual) < 4 * EPS
    assert residual.max() < 1e-12
