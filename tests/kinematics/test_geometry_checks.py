"""What a LinearPentapod refuses to be."""

import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.kinematics import Component, GeneralPentapod, LinearPentapod, architectural_measure
from pentapod.kinematics.forward.quadratic import LinearPart

BASE = np.array([(-0.4, 0.2), (-0.2, -0.4), (0.0, 0.0), (0.2, -0.4), (0.4, 0.4)])


def test_offsets_follow_delta_and_arrays_are_read_only() -> None:
    pentapod = LinearPentapod.quadratic(BASE, 0.5)
    np.testing.assert_allclose(pentapod.offsets, 0.5 * BASE[:, 0])
    with pytest.raises(ValueError, match="read-only"):
        pentapod.base[0, 0] = 1.0


@pytest.mark.parametrize("shape", [(4, 2), (6, 2), (5, 3), (10,)])
def test_five_attachments_with_two_coordinates(shape: tuple) -> None:
    with pytest.raises(MachineError, match="base"):
        LinearPentapod.quadratic(np.ones(shape), 0.5)


def test_a_batch_of_bases_is_no_base() -> None:
    with pytest.raises(MachineError, match="base"):
        LinearPentapod.quadratic(np.stack([BASE, BASE]), 0.5)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_not_finite(bad: float) -> None:
    base = BASE.copy()
    base[3, 1] = bad
    with pytest.raises(MachineError, match=r"not finite at index \(3, 1\)"):
        LinearPentapod.quadratic(base, 0.5)
    with pytest.raises(MachineError, match="delta"):
        LinearPentapod.quadratic(BASE, bad)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("large", [1e308, -1e200, 2e9])
def test_numbers_too_large_for_a_machine(large: float) -> None:
    base, offsets = BASE.copy(), 0.5 * BASE[:, 1]
    base[0, 0] = offsets[4] = large
    for build in (
        lambda: LinearPentapod.quadratic(base, 0.5),
        lambda: LinearPentapod.quadratic(BASE, large),
        lambda: GeneralPentapod(base, 0.5 * BASE[:, 1]),
        lambda: GeneralPentapod(BASE, offsets),
    ):
        with pytest.raises(MachineError, match="too large for a machine"):
            build()


@pytest.mark.parametrize("scale", [1e-40, 1e-160, 1e-300])
def test_attachments_that_as_good_as_coincide(scale: float) -> None:
    for build in (
        lambda: LinearPentapod.quadratic(scale * BASE, 0.5),
        lambda: GeneralPentapod(scale * BASE, 0.5 * BASE[:, 1]),
    ):
        with pytest.raises(MachineError, match="architecturally singular"):
            build()


@pytest.mark.parametrize("leg", range(5))
def test_offsets_that_do_not_fit_name_the_leg_and_the_deviation(leg: int) -> None:
    offsets = 0.03 + 0.5 * BASE[:, 0]
    offsets[leg] += 0.25e-3
    # leg 3 is the reference: seen from it, all the others are off
    expected = r"leg \d: its offset is -0.25 mm" if leg == 2 else rf"leg {leg + 1}: its offset is \+0.25 mm"
    for build in (
        lambda: LinearPentapod.from_offsets(BASE, offsets, 0.5),
        lambda: LinearPentapod(BASE, offsets, 0.5),
    ):
        with pytest.raises(MachineError, match=expected) as caught:
            build()
        assert caught.value.key == "offsets"


def test_offsets_within_the_tolerance_are_made_exact() -> None:
    rough = np.round(0.03 + 0.512345678 * BASE[:, 0], 6)
    pentapod = LinearPentapod.from_offsets(BASE, rough, 0.512345678, tolerance=2e-6)
    np.testing.assert_allclose(np.diff(pentapod.offsets), 0.512345678 * np.diff(BASE[:, 0]), rtol=1e-14)
    with pytest.raises(MachineError):
        LinearPentapod.from_offsets(BASE, rough, 0.512345678)


def test_kinematics_and_proofs_are_about_one_machine() -> None:
    exact = 0.03 + 0.5 * BASE[:, 0]
    given = exact + 1e-10 * np.array([1.0, -1.0, 0.0, 1.0, -1.0])  # within the constructor's tolerance
    pentapod = LinearPentapod(BASE, given, 0.5)
    np.testing.assert_array_equal(pentapod.offsets, exact)
    p, i = np.array([0.1, 0.05, 0.6]), np.array([0.36, 0.48, 0.8])
    q, j = pentapod.pose(pentapod.leg_lengths(p, i), pentapod.branch(p, i))
    assert np.abs(np.r_[q - p, j - i]).max() < 1e-14, (
        "the closed form, from δ, and the lengths, from the offsets, agree"
    )


def test_delta_is_fitted_where_it_is_not_claimed() -> None:
    pentapod = LinearPentapod.from_offsets(BASE, 0.03 - 0.7 * BASE[:, 0])
    assert pentapod.delta == pytest.approx(-0.7, rel=1e-14)
    with pytest.raises(MachineError, match="leg"):
        LinearPentapod.from_offsets(BASE, [0.1, 0.2, 0.0, 0.1, 0.2])
    with pytest.raises(MachineError, match="one line"):
        LinearPentapod.from_offsets(BASE * (0.0, 1.0), np.zeros(5))


def test_four_wrong_offsets() -> None:
    with pytest.raises(MachineError, match="offsets"):
        LinearPentapod.from_offsets(BASE, [0.1, 0.2, 0.3, 0.4], 0.5)


ANGLES = np.array([0.3, 1.1, 2.0, 3.3, 5.0])
SINGULAR = {
    "delta = 0": (BASE, 0.0),
    "four collinear attachments": (np.array([(0, 0), (1, 2), (2, 4), (3, 6), (1, 0.5)]), 0.5),
    "two attachments coincide with a third in line in y": (BASE[[0, 0, 2, 3, 3]], 0.5),
    "a parabola with vertical axis": (np.array([(x, 3 * x * x - x + 1) for x in (-2.0, -1, 0.5, 1, 3)]), 0.5),
    "a hyperbola with a vertical asymptote": (np.array([(x, 1 / x) for x in (-2.0, -1, 0.5, 1, 3)]), 0.5),
    "all in one point": (np.ones((5, 2)), 0.5),
}


@pytest.mark.parametrize(("base", "delta"), SINGULAR.values(), ids=SINGULAR.keys())
def test_architecturally_singular_geometries_are_refused(base: np.ndarray, delta: float) -> None:
    with pytest.raises(MachineError, match="architecturally singular"):
        LinearPentapod.quadratic(base, delta)


def test_a_circle_is_no_singular_conic() -> None:
    assert architectural_measure(LinearPentapod.quadratic(np.c_[np.cos(ANGLES), np.sin(ANGLES)], 0.5)) > 1e-3


def test_the_measure_knows_no_scale_and_falls_to_zero_with_f(conic_determinant) -> None:
    pentapod = LinearPentapod.quadratic(BASE, 0.5)
    assert conic_determinant(LinearPentapod.quadratic(5 * BASE, 0.5)) == pytest.approx(264.0, rel=1e-12)
    measure = architectural_measure(pentapod)
    assert 0.01 < measure < 1.0
    for scale in (1e-3, 1.0, 1e4):
        moved = LinearPentapod.quadratic(scale * BASE + (3.0, -2.0), 0.5)
        assert architectural_measure(moved) == pytest.approx(measure, rel=1e-6)
    x = np.array([-2.0, -1.0, 0.5, 1.0, 3.0])
    gaps = [np.c_[x, x * x + gap * np.eye(5)[4]] for gap in (1.0, 0.1, 1e-4)]
    near = [architectural_measure(LinearPentapod.quadratic(base, 0.5)) for base in gaps]
    assert near[0] > near[1] > near[2] > 0.0
    assert near[2] < 1e-4


def test_the_linear_map_is_correctly_rounded() -> None:
    # against Cramer's rule in exact arithmetic
    from fractions import Fraction
    from itertools import permutations

    base, delta = BASE * 1.1 + (0.123, -0.456), 0.7
    exact = [[Fraction(float(c)) for c in a] for a in base]
    slope = Fraction(delta)

    def determinant(m: list) -> Fraction:
        total = Fraction(0)
        for order in permutations(range(4)):
            sign = (-1) ** sum(order[a] > order[b] for a in range(4) for b in range(a + 1, 4))
            total += sign * m[0][order[0]] * m[1][order[1]] * m[2][order[2]] * m[3][order[3]]
        return total

    rows, ks = [], []
    for leg in (0, 1, 3, 4):
        x, y = exact[leg][0] - exact[2][0], exact[leg][1] - exact[2][1]
        rows.append([x, y, slope * x * x, slope * x * y])
        ks.append(x * x + y * y + slope * slope * x * x)
    whole = determinant(rows)
    linear = LinearPart.of(base, delta)
    for unknown in range(4):

        def cramer(rhs: list, k: int = unknown) -> Fraction:
            replaced = [[*row[:k], b, *row[k + 1 :]] for row, b in zip(rows, rhs, strict=True)]
            return determinant(replaced) / whole

        columns = [cramer([Fraction(-1, 2) if r == c else Fraction(0) for r in range(4)]) for c in range(4)]
        expected = [*columns[:2], -sum(columns), *columns[2:]]
        assert linear.linear_map[unknown].tolist() == [float(e) for e in expected]
        assert linear.constant[unknown] == float(cramer([k / 2 for k in ks]))


def test_components_have_names() -> None:
    assert [str(Component.parse(name)) for name in ("++", "+-", "-+", "--")] == ["++", "+-", "-+", "--"]
    from pentapod.base.errors import ArrayError

    with pytest.raises(ArrayError, match="unknown component"):
        Component.parse("+")
