"""Guides: the singular locus stays, F and its zeros by exact arithmetic, the choice against a brute-force grid."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from pentapod.base.errors import ArrayError, MachineError
from pentapod.kinematics import LinearPentapod, ReconfigurablePentapod, square_jacobian, tip_compliance
from pentapod.theory import choose_rail_positions, conditioning_criterion, stiffness_criterion

TRAVEL = np.tile((-0.6, 0.6), (5, 1))


def machines(pentapod: LinearPentapod) -> list[ReconfigurablePentapod]:
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    skew = np.array([(0.6, 0.8), (0.0, 1.0), (0.0, 0.0), (1.0, 0.0), (-0.8, 0.6)])
    return [
        ReconfigurablePentapod.along_y(pentapod, 0.5 * size * TRAVEL),
        ReconfigurablePentapod.along_x(pentapod, 0.5 * size * TRAVEL),
        ReconfigurablePentapod(pentapod, skew, 0.5 * size * TRAVEL),
    ]


def test_the_singular_locus_stays(pentapod: LinearPentapod, random_poses, leg_determinant, conic_determinant) -> None:
    """The leg determinant at any rail_positions is that at no slides times a constant, the ratio of the F."""
    rng = np.random.default_rng(51)
    p, i = random_poses(pentapod, 300, seed=52)
    before = leg_determinant(pentapod, p, i)
    for robot in machines(pentapod):
        for rail_positions in rng.uniform(robot.travel[:, 0], robot.travel[:, 1], size=(6, 5)):
            moved = robot.at(rail_positions)
            assert moved.lever == pytest.approx(pentapod.lever, abs=1e-12)
            ratio = conic_determinant(moved) / conic_determinant(pentapod)
            after = leg_determinant(moved, p, i)
            np.testing.assert_allclose(after, ratio * before, rtol=1e-6, atol=1e-9 * np.abs(after).max())
            np.testing.assert_array_equal(moved.branch(p, i), pentapod.branch(p, i))


def test_the_identity_behind_it_over_the_rationals() -> None:
    """det = δ² w F S for rational designs, poses and rail_positions, without rounding: an identity, not a
    coincidence."""
    rng = np.random.default_rng(53)

    def det(rows):
        if len(rows) == 1:
            return rows[0][0]
        minors = ([row[:k] + row[k + 1 :] for row in rows[1:]] for k in range(len(rows)))
        return sum(((-1) ** k * rows[0][k] * det(minor) for k, minor in enumerate(minors)), Fraction(0))

    for _ in range(20):
        x, y, g, h, s = (list(map(Fraction, rng.integers(-9, 10, size=5).tolist())) for _ in range(5))
        x = [a + c * t for a, c, t in zip(x, g, s, strict=True)]
        y = [a + c * t for a, c, t in zip(y, h, s, strict=True)]
        delta, px, py, pz = (Fraction(int(n), 7) for n in rng.integers(1, 30, size=4))
        a, b = (Fraction(int(n), 7) for n in rng.integers(1, 7, size=2))  # a² + b² ≠ 1: no such fractions with 7
        n = a * a + b * b + 1
        u, v, w = 2 * a / n, 2 * b / n, (a * a + b * b - 1) / n
        f = det([[p * p, p * q, p, q, Fraction(1)] for p, q in zip(x, y, strict=True)])
        rows = []
        for p, q in zip(x, y, strict=True):
            z = delta * p
            d = (px + z * u - p, py + z * v - q, pz + z * w)
            # two directions across i, of determinant (t1 × t2) · i = 1 when w ≠ 0
            rows.append([*d, z * (d[0] - u / w * d[2]), z * (d[1] - v / w * d[2])])
        scale = det([[Fraction(1), Fraction(0), -u / w], [Fraction(0), Fraction(1), -v / w], [u, v, w]])
        assert det(rows) == delta**2 * w * f * (delta * w * px + (1 - delta * u) * pz) * scale


def test_f_vanishes_at_the_forbidden_rail_positions_and_nowhere_else(pentapod: LinearPentapod) -> None:
    rng = np.random.default_rng(54)
    for robot in machines(pentapod):
        rail_positions = rng.uniform(robot.travel[:, 0], robot.travel[:, 1])
        for leg in range(5):
            found = robot.forbidden_rail_positions(leg, rail_positions)
            reach = 10.0 * np.abs(robot.travel).max()
            walk = np.repeat(rail_positions[None], 40_001, axis=0)
            walk[:, leg] = np.linspace(-reach, reach, len(walk))
            if not robot.guides[leg].any():
                assert found.size == 0
                continue
            sign = np.sign(robot.determinant(walk))
            changes = walk[np.flatnonzero(sign[1:] != sign[:-1]), leg]
            near = found[np.abs(found) < reach]
            assert len(changes) == len(near)
            np.testing.assert_allclose(changes, near, atol=2.0 * reach / 40_000)


def test_the_way_there_is_watched(paper: LinearPentapod) -> None:
    robot = ReconfigurablePentapod.along_y(paper, np.tile((-20.0, 20.0), (5, 1)))
    forbidden = robot.forbidden_rail_positions(0, np.zeros(5))[0]
    beyond, before = np.zeros(5), np.zeros(5)
    beyond[0], before[0] = 1.2 * forbidden, 0.99 * forbidden
    assert robot.stays_regular(np.zeros(5), before)
    assert not robot.stays_regular(np.zeros(5), beyond)
    rng = np.random.default_rng(55)
    for end in rng.uniform(-6.0, 6.0, size=(40, 5)):
        way = np.linspace(0.0, 1.0, 20_001)[:, None] * end
        signs = np.sign(robot.determinant(way))
        assert robot.stays_regular(np.zeros(5), end) == bool((signs == signs[0]).all())


POSES = (
    np.array([(0.1, 0.2, 2.5), (-0.8, 0.4, 3.0), (0.7, -0.6, 2.8)]),
    np.array([(0.1, 0.0, 1.0), (0.0, 0.3, 1.0), (-0.2, 0.1, 1.0)]),
)


def test_the_criteria_are_what_they_say(paper: LinearPentapod) -> None:
    p, i = POSES[0], POSES[1] / np.linalg.norm(POSES[1], axis=1)[:, None]
    springs = np.array([2.0e6, 3.0e6, 2.5e6, 4.0e6, 1.5e6])
    one = (paper.base[None], paper.offsets[None], p, i)
    scaled = square_jacobian(paper, p, i) / np.array([1.0, 1.0, 1.0, 0.7, 0.7])
    np.testing.assert_allclose(conditioning_criterion(0.7)(*one)[0], 1.0 / np.linalg.cond(scaled), rtol=1e-10)
    softest = 1.0 / np.linalg.eigvalsh(tip_compliance(paper, p, i, springs, 0.3)[:, :3, :3])[:, -1]
    np.testing.assert_allclose(stiffness_criterion(springs, 0.3)(*one)[0], softest, rtol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("cells", [11, 41])
@pytest.mark.parametrize("name", ["conditioning", "stiffness"])
def test_the_choice_is_as_good_as_a_fine_grid(paper: LinearPentapod, name: str, cells: int) -> None:
    criterion = {"conditioning": conditioning_criterion(1.0), "stiffness": stiffness_criterion([1e6] * 5, 0.3)}[name]
    travel = np.zeros((5, 2))
    travel[[0, 4]] = (-1.5, 1.5)
    robot = ReconfigurablePentapod.along_y(paper, travel)
    choice = choose_rail_positions(robot, *POSES, criterion, candidates=128)
    i = POSES[1] / np.linalg.norm(POSES[1], axis=1)[:, None]
    best = 0.0
    for a, b in itertools.product(np.linspace(-1.5, 1.5, cells), repeat=2):
        rail_positions = np.array([a, 0.0, 0.0, 0.0, b])
        if robot.stays_regular(np.zeros(5), rail_positions):
            try:
                moved = robot.at(rail_positions)
            except MachineError:
                continue
            best = max(best, criterion(moved.base[None], moved.offsets[None], POSES[0], i).min())
    assert choice.value >= best * (1 - 1e-6)
    assert choice.value > choice.start_value
    assert ((choice.rail_positions >= travel[:, 0]) & (choice.rail_positions <= travel[:, 1])).all()
    assert robot.stays_regular(np.zeros(5), choice.rail_positions)
    assert criterion(
        robot.at(choice.rail_positions).base[None], robot.at(choice.rail_positions).offsets[None], POSES[0], i
    ).min() == (pytest.approx(choice.value, rel=1e-9))


def test_bad_guides(paper: LinearPentapod) -> None:
    with pytest.raises(MachineError, match="unit"):
        ReconfigurablePentapod(paper, np.full((5, 2), 0.5), TRAVEL)
    with pytest.raises(MachineError, match="ends before"):
        ReconfigurablePentapod.along_x(paper, -TRAVEL)
    robot = ReconfigurablePentapod.along_y(paper, TRAVEL)
    with pytest.raises(ArrayError, match="outside the travel"):
        choose_rail_positions(robot, *POSES, conditioning_criterion(1.0), start=np.ones(5))
    with pytest.raises(ArrayError, match="shape"):
        robot.base_at([1.0, 2.0])
    with pytest.raises(MachineError, match="singular"):
        ReconfigurablePentapod.along_y(paper, 50.0 * TRAVEL).at(
            [robot.forbidden_rail_positions(0, np.zeros(5))[0], 0, 0, 0, 0]
        )
    with pytest.raises(ArrayError, match="positive"):
        conditioning_criterion(0.0)
    with pytest.raises(ArrayError, match="positive"):
        stiffness_criterion([0.0] * 5, 0.1)
