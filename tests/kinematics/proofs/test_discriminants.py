"""The discriminants along motions of the legs, as polynomials, against those of the legs at each time."""

import numpy as np
import pytest
from leg_motions import segments
from scipy.interpolate import BPoly

from pentapod.kinematics import LinearPentapod, certify_component
from pentapod.kinematics.proofs.certificate import Discriminants

T = np.linspace(0.0, 1.0, 7)


def values(coefficients: np.ndarray) -> np.ndarray:
    """The values (..., 7) at times T of polynomials (..., n + 1), by scipy."""
    return np.moveaxis(BPoly(np.moveaxis(coefficients, -1, 0)[:, None], [0.0, 1.0])(T), 0, -1)


@pytest.mark.parametrize("k", [0, 1, 3, 5])
def test_discriminants_are_those_of_the_legs_at_each_time(pentapod: LinearPentapod, k: int) -> None:
    legs = segments(pentapod, 170, k, 1, 0.01)
    found = Discriminants.of(pentapod, legs, tops=True)
    squares = np.moveaxis(values(legs), 1, 0) ** 2
    q, py, u, v = pentapod.linear_part(squares)
    delta = pentapod.delta
    r_squared, n_squared = squares[2] - py**2, 1.0 - 2.0 * delta * u + delta**2 * (1.0 - v**2)
    c = q + delta * v * py
    w_squared, s_squared = 1.0 - u**2 - v**2, r_squared * n_squared - c**2
    np.testing.assert_allclose(values(found.w_squared), w_squared, atol=1e-10)
    np.testing.assert_allclose(values(found.s_squared), s_squared, atol=1e-9 * s_squared.max())
    np.testing.assert_array_equal(found.largest, np.abs(legs).max(axis=-1).T)
    for top, form in zip(found.tops, (py, u, v, r_squared, n_squared, c), strict=True):
        assert (top >= np.abs(form).max(axis=-1) * (1.0 - 1e-9)).all()


def test_legs_that_are_no_numbers_stay_undecided(pentapod: LinearPentapod) -> None:
    legs = segments(pentapod, 40, 3, 1, 0.01)
    legs[5, 2, 0], legs[6, 1, -1], legs[7] = np.nan, np.inf, 0.0
    for leg_error in (0.0, 1e-4):
        proof = certify_component(pentapod, legs, (1, 1), leg_error=leg_error)
        assert proof.undecided[5:8].all()
        assert proof.proven.mean() > 0.4
