"""The component certificate against exact rational arithmetic: never a false proof."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from leg_motions import Exact, grazing, segments
from rational_polynomials import add, at, divided, positive_on_unit_interval, power_form, times

from pentapod.base.errors import ArrayError
from pentapod.kinematics import COMPONENTS, LinearPentapod, certify_component, singularity_values
from pentapod.kinematics.proofs import certificate
from pentapod.numerics.bernstein import elevate, split


@pytest.mark.parametrize("k", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_bounds_hold_in_exact_arithmetic_on_random_intervals(pentapod: LinearPentapod, k: int) -> None:
    n = 30 if k == 1 else 8
    coefficients = np.concatenate([segments(pentapod, n, k, seed, reach) for seed, reach in ((0, 1e-3), (1, 0.2))])
    noise = np.random.default_rng(0).normal(size=(n // 2, 5, k + 1))
    coefficients[-(n // 2) :] += 0.3 * np.abs(pentapod.base).max() * noise
    proof = certify_component(pentapod, coefficients, COMPONENTS[0])
    exact = Exact(pentapod)
    for index, interval in enumerate(coefficients):
        d1, product = exact.interval(interval)
        s_squared = divided(product, [4 * c for c in d1])
        for polynomial, bound in ((d1, proof.w_lower[index]), (s_squared, proof.s_lower[index])):
            least = min(at(polynomial, Fraction(j, 16)) for j in range(17))
            assert bound == 0.0 or least >= Fraction(float(bound)) ** 2
            # and it is a bound of all values, not of samples only
            assert bound == 0.0 or positive_on_unit_interval(add(polynomial, [-(Fraction(float(bound)) ** 2)]))
            assert bound > 0.0 or least < 1e-6
    assert 0.4 < proof.proven.mean() < 1.0  # small motions are proven, and not everything is


def test_small_intervals_have_tight_bounds(pentapod: LinearPentapod) -> None:
    rng = np.random.default_rng(0)
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    p = rng.uniform(-1.0, 1.0, size=(500, 3)) * size + (0.0, 0.0, 2.0 * size)
    i = rng.normal(size=(500, 3)) * 0.3 + (0.0, 0.0, 1.0)
    i /= np.linalg.norm(i, axis=1)[:, None]
    legs = pentapod.leg_lengths(p, i)
    w, s = singularity_values(pentapod, p, i)
    clear = (abs(s) > 0.1 * size) & (w > 0.1)
    proof = certify_component(pentapod, np.stack([legs, legs], axis=-1)[clear], (1, 1))
    assert proof.holds
    assert (proof.w_lower <= w[clear]).all()
    assert (proof.s_lower <= abs(s[clear])).all()
    np.testing.assert_allclose(proof.w_lower, w[clear], rtol=1e-6)
    np.testing.assert_allclose(proof.s_lower, abs(s[clear]), rtol=1e-6)


@pytest.mark.parametrize("which", [0, 1], ids=["w", "S"])
def test_grazing_intervals_are_never_proven_falsely(paper: LinearPentapod, which: int) -> None:
    intervals = grazing(paper, which, 150)
    assert len(intervals) >= 100
    proof = certify_component(paper, intervals, (1, 1), depth=40)
    exact = Exact(paper)
    counts = {(a, b): 0 for a in (True, False) for b in (True, False)}
    for index, interval in enumerate(intervals):
        d1, product = exact.interval(interval)
        polynomial = d1 if which == 0 else divided(product, [4 * c for c in d1])
        truth = positive_on_unit_interval(polynomial)
        counts[truth, bool(proof.proven[index])] += 1
    assert counts[False, True] == 0
    # both cases occur, many of those that are true are proven, and some are nearer to 0 than rounding can tell
    assert counts[False, False] > 20
    assert counts[True, True] > 20
    assert counts[True, False] > 0


def test_a_false_bound_would_be_seen(paper: LinearPentapod) -> None:
    """The oracle itself: w² and 4 w² S² at one pose, known from the pose."""
    p, i = np.array([0.5, 0.25, 3.0]), np.array([0.36, 0.48, 0.8])
    legs = paper.leg_lengths(p, i)
    d1, product = Exact(paper)([[Fraction(float(leg))] for leg in legs])
    w, s = singularity_values(paper, p, i)
    assert float(d1[0]) == pytest.approx(w**2, rel=1e-13)
    assert float(product[0]) == pytest.approx(4 * w**2 * s**2, rel=1e-13)
    one = [Fraction(1)]
    touching = times([Fraction(-1, 3), *one], [Fraction(-1, 3), *one])
    assert not positive_on_unit_interval(touching)
    assert positive_on_unit_interval(add(touching, [Fraction(1, 10**30)]))
    assert not positive_on_unit_interval(add(touching, [Fraction(-1, 10**30)]))


def test_motions_through_a_singularity_are_not_proven(pentapod: LinearPentapod) -> None:
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    steps = np.linspace(-1.0, 1.0, 201)
    # S = 0 at the middle of the first motion, which moves square to the plane; w = 0 at that of the second
    i = np.array([0.2, 0.1, 1.0]) / np.linalg.norm([0.2, 0.1, 1.0])
    p = np.array([0.1, 0.3, 0.0]) * size
    normal = np.array([pentapod.delta * i[2], 0.0, 1.0 - pentapod.delta * i[0]])
    normal /= np.linalg.norm(normal)
    _, s = singularity_values(pentapod, [p, p + normal], i)
    p = p - s[0] / (s[1] - s[0]) * normal
    falling = p + size * steps[:, None] * normal
    turning = np.c_[0.6 * np.cos(steps / 2), 0.8 * np.cos(steps / 2), np.sin(steps / 2)]
    above = np.array([0.2, 0.1, 1.5]) * size
    for positions, directions in ((falling, i[None]), (above[None], turning)):
        w, s = singularity_values(pentapod, positions, directions)
        component = pentapod.branch(positions, directions)
        legs = pentapod.leg_lengths(positions, directions)
        proof = certify_component(pentapod, np.stack([legs[:-1], legs[1:]], axis=-1), component[0])
        assert (component[0] * component[-1] == (1, -1)).all() or (component[0] * component[-1] == (-1, 1)).all()
        assert not proof.proven[99:101].any()
        far = (np.abs(s) > 0.2 * size) & (np.abs(w) > 0.1)
        assert proof.proven[far[:-1] & far[1:]].all()
        assert (proof.w_lower <= np.minimum(np.abs(w[:-1]), np.abs(w[1:]))).all()
        assert (proof.s_lower <= np.minimum(np.abs(s[:-1]), np.abs(s[1:]))).all()


def test_the_same_motion_in_any_degree_and_in_halves(pentapod: LinearPentapod) -> None:
    linear = segments(pentapod, 300, 1, 5, 0.05)
    proof = certify_component(pentapod, linear, (1, 1))
    assert proof.proven.mean() > 0.2
    whole = certify_component(pentapod, linear, (1, 1), depth=0)
    for by in (1, 2, 4):
        assert (certify_component(pentapod, elevate(linear, by), (1, 1)).proven == proof.proven).all()
        # a higher degree holds the curve tighter, but for the larger rounding error
        raised = certify_component(pentapod, elevate(linear, by), (1, 1), depth=0)
        assert (raised.w_lower**2 >= whole.w_lower**2 - 1e-9).all()
        assert (raised.s_lower**2 >= whole.s_lower**2 - 1e-9).all()
    halves = [certify_component(pentapod, half, (1, 1)) for half in split(linear)]
    assert ((halves[0].proven & halves[1].proven) == proof.proven).all()
    both = np.minimum(halves[0].s_lower, halves[1].s_lower)
    assert (both[proof.proven] >= proof.s_lower[proof.proven] * (1 - 1e-9)).all()


def test_legs_at_rest_are_a_motion_of_degree_zero(paper: LinearPentapod) -> None:
    legs = paper.leg_lengths([0.5, 0.25, 3.0], [0.36, 0.48, 0.8])
    proof = certify_component(paper, legs[None, :, None], (1, 1))
    assert proof.w_lower[0] == pytest.approx(0.8, rel=1e-12)
    assert proof.w_lower[0] < 0.8


@pytest.mark.parametrize("k", [1, 3])
def test_a_leg_error_covers_every_motion_within_it(paper: LinearPentapod, k: int) -> None:
    coefficients = segments(paper, 12, k, 9, 0.02)
    error = 2e-3
    sharp, covered = (certify_component(paper, coefficients, (1, 1), leg_error=e) for e in (0.0, error))
    assert covered.proven.any()
    assert (covered.w_lower <= sharp.w_lower).all()
    assert (covered.s_lower <= sharp.s_lower).all()
    exact, rng = Exact(paper), np.random.default_rng(0)
    worst = np.inf
    for index in np.flatnonzero(covered.proven):
        for _ in range(20):
            t, signs = Fraction(int(rng.integers(0, 65)), 64), rng.choice([-1.0, 1.0], 5)
            legs = [
                [at(power_form(c), t) + Fraction(float(e))]
                for c, e in zip(coefficients[index], signs * error, strict=True)
            ]
            d1, product = exact(legs)
            assert d1[0] >= Fraction(float(covered.w_lower[index])) ** 2
            assert product[0] >= 4 * d1[0] * Fraction(float(covered.s_lower[index])) ** 2
            worst = min(worst, float(d1[0]) - sharp.w_lower[index] ** 2)
    assert worst < 0.0  # the sharp bound would not have covered them


def test_leg_errors_whose_effects_cancel_do_not_lose_the_proof(paper: LinearPentapod, monkeypatch) -> None:
    """Near S = 0 legs that are off move w² and S² by far less than the sum of what they do to each form."""
    coefficients, error = segments(paper, 400, 1, 9, 1e-3, height=0.5), 2e-2
    covered = certify_component(paper, coefficients, (1, 1), leg_error=error)
    endless = np.full((2, 1), np.inf)
    monkeypatch.setattr(certificate, "_close_shifts", lambda *_: endless)
    quick = certify_component(paper, coefficients, (1, 1), leg_error=error)
    only_close = np.flatnonzero(covered.proven & ~quick.proven)
    assert (covered.proven >= quick.proven).all()
    assert len(only_close) > 0.05 * len(coefficients)
    exact, corners = Exact(paper), np.array(list(product((-error, error), repeat=5)))
    for index in only_close[:12]:
        for corner in corners:
            legs = [
                [Fraction(float(c[0])) + Fraction(float(e))] for c, e in zip(coefficients[index], corner, strict=True)
            ]
            d1, four = exact(legs)
            assert d1[0] >= Fraction(float(covered.w_lower[index])) ** 2
            assert four[0] >= 4 * d1[0] * Fraction(float(covered.s_lower[index])) ** 2


def test_intervals_are_judged_one_by_one(pentapod: LinearPentapod) -> None:
    coefficients = segments(pentapod, 5000, 1, 3, 0.2)
    coefficients[17, 3, 1] = np.nan
    coefficients[18, 0, 0] = np.inf
    coefficients[19] = 1e200
    coefficients[20] = 0.0
    proof = certify_component(pentapod, coefficients, (-1, 1))
    assert not proof.proven[17:21].any()
    for k in (0, 16, 21, 2047, 2048, 4999):
        alone = certify_component(pentapod, coefficients[k : k + 1], (-1, 1))
        np.testing.assert_allclose(alone.w_lower[0], proof.w_lower[k], rtol=1e-9, atol=1e-12)
        assert alone.proven[0] == proof.proven[k]
    assert (proof.proven == ((proof.w_lower > 0) & (proof.s_lower > 0))).all()
    assert certify_component(pentapod, coefficients[:0], (1, 1)).holds
    assert str(proof.component) == "-+"
    with pytest.raises(ValueError, match="read-only"):
        proof.proven[0] = True


def test_wrong_arguments(paper: LinearPentapod) -> None:
    good = np.ones((3, 5, 2))
    for bad in (np.ones((5, 2)), np.ones((3, 4, 2)), np.ones((3, 5, 0))):
        with pytest.raises(ArrayError, match="leg_coefficients"):
            certify_component(paper, bad, (1, 1))
    for component in ((0, 1), (1, 1, 1), np.ones((3, 2))):
        with pytest.raises(ArrayError, match="component"):
            certify_component(paper, good, component)
    with pytest.raises(ArrayError, match="negative"):
        certify_component(paper, good, (1, 1), leg_error=-1.0)
