"""F, conics, and the distance of a design from the singular ones, against exact arithmetic, sampling and searching."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from pentapod.base.errors import ArrayError, MachineError
from pentapod.kinematics import LinearPentapod, attachment_conic, conic_determinant, forbidden_conic
from pentapod.theory import architectural_distance

PAPER = np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])
INTEGERS = st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), min_size=5, max_size=5)


def exact_determinant(rows: list[list[int]]) -> Fraction:
    """Laplace expansion over the rationals."""
    if len(rows) == 1:
        return Fraction(rows[0][0])
    minors = ([row[:k] + row[k + 1 :] for row in rows[1:]] for k in range(len(rows)))
    return sum(((-1) ** k * rows[0][k] * exact_determinant(minor) for k, minor in enumerate(minors)), Fraction(0))


@given(INTEGERS)
def test_f_is_the_determinant_of_five_rows(points: list[tuple[int, int]]) -> None:
    exact = exact_determinant([[x * x, x * y, x, y, 1] for x, y in points])
    assert float(conic_determinant(points)) == pytest.approx(float(exact), abs=1e-6)


def test_the_figures_f() -> None:
    assert float(conic_determinant(PAPER)) == pytest.approx(264.0, rel=1e-14)


@settings(max_examples=50)
@given(INTEGERS, st.integers(0, 4))
def test_conics_pass_through_what_they_should(points: list[tuple[int, int]], leg: int) -> None:
    base = np.array(points, dtype=float)
    f = float(conic_determinant(base))
    whole = attachment_conic(base)
    assert np.abs(whole(base)).max() < 1e-5  # of values up to 1e8
    assert abs(whole.coefficients[2]) == pytest.approx(abs(f), abs=1e-7)
    forbidden = forbidden_conic(base, leg)
    values = forbidden(base)
    assert values[leg] == pytest.approx(f, abs=1e-5)
    assert np.abs(np.delete(values, leg)).max() < 1e-5
    assert forbidden.coefficients[2] == 0.0


def test_an_attachment_on_its_conic_makes_the_machine_singular() -> None:
    for leg in range(5):
        conic = forbidden_conic(PAPER, leg)
        x = np.linspace(-3.3, 3.3, 41)
        y = conic.y_at(x)
        for place in np.stack([x, y], axis=1)[np.isfinite(y)]:
            base = PAPER.copy()
            base[leg] = place
            with pytest.raises(MachineError, match=r"singular|one line"):
                LinearPentapod.quadratic(base, 0.5)


def test_a_conic_with_a_squared_y_has_no_single_height() -> None:
    with pytest.raises(ArrayError, match="infinity"):
        attachment_conic(PAPER).y_at(0.0)
    with pytest.raises(ArrayError, match="shape"):
        attachment_conic(PAPER[:4])


def designs(count: int, seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [PAPER, *rng.uniform(-1.0, 1.0, size=(count, 5, 2))]


def test_one_attachment_alone_against_a_fine_curve() -> None:
    for base in designs(8, 31):
        alone = architectural_distance(base).alone
        for leg in range(5):
            # dense walk around the attachment: the smallest circle on which F changes its sign
            turn = np.linspace(0.0, 2.0 * np.pi, 1441)
            circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)

            def signs(radius, leg=leg, base=base, circle=circle):
                moved = np.repeat(base[None], len(circle), axis=0)
                moved[:, leg] += radius * circle
                return np.sign(conic_determinant(moved))

            sign = np.sign(conic_determinant(base))
            assert (signs(alone[leg] * (1 - 1e-4)) == sign).all()
            assert (signs(alone[leg] * (1 + 1e-4)) != sign).any()


@pytest.mark.slow
def test_all_attachments_together_against_many_descents() -> None:
    rng = np.random.default_rng(32)
    for base in designs(3, 33):
        distance = architectural_distance(base)
        assert np.linalg.norm(distance.nearest - base) == pytest.approx(distance.together, rel=1e-12)
        f, nearest = conic_determinant(base), conic_determinant(distance.nearest)
        assert abs(nearest) < 1e-13 * abs(f) or abs(nearest) < 1e-14
        assert distance.together <= distance.alone.min()
        found = []
        for _ in range(12):
            answer = minimize(
                lambda x, base=base: ((x - base.ravel()) ** 2).sum(),
                base.ravel() + rng.normal(size=10) * 0.5,
                method="SLSQP",
                constraints={"type": "eq", "fun": lambda x, f=f: conic_determinant(x.reshape(5, 2)) / f},
                options={"ftol": 1e-13, "maxiter": 300},
            )
            if answer.success and abs(conic_determinant(answer.x.reshape(5, 2))) < 1e-9 * abs(f):
                found.append(np.sqrt(answer.fun))
        assert found
        assert min(found) == pytest.approx(distance.together, rel=1e-5)


@pytest.mark.slow
def test_smaller_movements_keep_the_sign_of_f() -> None:
    rng = np.random.default_rng(34)
    for base in designs(6, 35):
        together = architectural_distance(base).together
        moves = rng.normal(size=(20000, 5, 2))
        moves *= together / np.linalg.norm(moves, axis=(1, 2), keepdims=True)
        assert (np.sign(conic_determinant(base + 0.999 * moves)) == np.sign(conic_determinant(base))).all()


def test_singular_designs_are_at_distance_zero() -> None:
    collinear = np.array([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0), (5.0, -1.0)])
    assert architectural_distance(collinear).together == 0.0
    assert architectural_distance(np.ones((5, 2))).together == 0.0
    upright = np.array([(1.0, 0.0), (1.0, 2.0), (1.0, 5.0), (3.0, 3.0), (5.0, -1.0)])  # three on a line along y
    assert architectural_distance(upright).together < 1e-14
    assert abs(conic_determinant(upright)) < 1e-13


def test_the_distance_scales_with_the_machine() -> None:
    one, thousandth = architectural_distance(PAPER), architectural_distance(1e-3 * PAPER)
    assert thousandth.together == pytest.approx(1e-3 * one.together, rel=1e-10)
    np.testing.assert_allclose(thousandth.alone, 1e-3 * one.alone, rtol=1e-10)
