"""Motions that are proven to meet a singularity: the sides of their ends, exactly and by finite differences."""

from fractions import Fraction

import flint
import numpy as np
import pytest
from scipy.optimize import fsolve
from test_motion import BASE, DELTA, grazing_intervals, linear, smooth_motion, struts, tangent_jacobian

from pentapod.kinematics import AsBuiltPentapod, LinearPentapod, certify_motion
from pentapod.kinematics.tubes.tube import determinant_sign


def test_signs_of_determinants_over_the_rationals() -> None:
    rng = np.random.default_rng(0)
    matrices = rng.normal(size=(300, 6, 6)) * 10.0 ** rng.integers(-6, 7, (300, 6, 1))
    matrices[:60, 5] = matrices[:60, 4]  # singular
    matrices[60:120, 5] = matrices[60:120, 4] + 1e-13 * rng.normal(size=(60, 6))
    matrices[120:130, 0] = 0.0
    found = determinant_sign(matrices)
    exact = np.array([np.sign(float(flint_determinant(matrix))) for matrix in matrices])
    assert (found * exact >= 0).all()
    assert (found[exact == 0] == 0).all()
    assert (found[130:] == exact[130:]).all()
    assert set(found.tolist()) == {-1, 0, 1}


def flint_determinant(matrix: np.ndarray) -> Fraction:
    entries = [Fraction(x) for x in matrix.ravel().tolist()]
    value = flint.fmpq_mat(*matrix.shape, [flint.fmpq(x.numerator, x.denominator) for x in entries]).det()
    return Fraction(int(value.p), int(value.q))


@pytest.mark.parametrize("leg_error", [0.0, 1e-6])
def test_refuted_are_the_intervals_whose_ends_are_on_different_sides(leg_error: float) -> None:
    """General pentapods, rings and zeros too; the sides by finite differences in pentakins' coordinates."""
    refuted = crossed = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        base = np.c_[BASE + rng.normal(size=(5, 2)) * 0.1, rng.normal(size=5) * 1e-3]
        machine = AsBuiltPentapod(base, rng.uniform(-0.3, 0.3, 5), rng.uniform(0, 0.01, 5), rng.normal(size=5) * 1e-3)
        p, i = smooth_motion(60)
        p[:, 2] = 0.4 * np.sin(rng.uniform(8, 16) * np.linspace(0.0, 1.0, 61) + rng.uniform(0, 6))
        found = certify_motion(machine, linear(machine.leg_lengths(p, i)), p, i, leg_error=leg_error, depth=1)
        sides = np.sign([np.linalg.det(tangent_jacobian(machine, *pose)) for pose in zip(p, i, strict=True)])
        change = sides[1:] != sides[:-1]
        assert not (found.refuted & ~change).any()
        assert not (found.refuted & found.proven).any()
        refuted, crossed = refuted + found.refuted.sum(), crossed + change.sum()
        for n in np.flatnonzero(found.refuted)[: 3 if leg_error else 0]:
            near = [solved(machine, p[k], i[k], leg_error * rng.choice([-1.0, 1.0], 5)) for k in (n, n + 1)]
            assert np.sign([np.linalg.det(tangent_jacobian(machine, *pose)) for pose in near]).prod() < 0
    assert crossed > 20
    assert refuted > (0.9 if leg_error == 0.0 else 0.5) * crossed


def solved(machine: AsBuiltPentapod, p: np.ndarray, i: np.ndarray, change: np.ndarray) -> tuple:
    """The pose next to p, i where the legs have changed, by scipy's hybrid method in pentakins' coordinates."""
    start = np.r_[p, np.arcsin(-i[1]), np.arctan2(i[0], i[2])]
    want = struts(start, machine) + change
    x = fsolve(lambda x: struts(x, machine) - want, start, xtol=1e-10)
    assert np.abs(struts(x, machine) - want).max() < 1e-12
    return x[:3], np.array([np.cos(x[3]) * np.sin(x[4]), -np.sin(x[3]), np.cos(x[3]) * np.cos(x[4])])


def test_going_to_and_fro_is_not_refuted_and_a_lost_pose_is_undecided() -> None:
    nominal = LinearPentapod.quadratic(BASE, DELTA)
    machine = AsBuiltPentapod.of(nominal)
    for seed in range(4):
        coefficients, p, i = grazing_intervals(nominal, 15, seed)
        coefficients = np.maximum(coefficients, 1e-3)
        assert not certify_motion(machine, coefficients, p, i, depth=1).refuted.any(), "both ends are in one component"
    p, i = smooth_motion(3)
    legs = linear(machine.leg_lengths(p, i))
    lost = certify_motion(machine, legs, np.where(p == p[1], np.nan, p), i)
    assert lost.undecided.tolist() == [True, True, False]
