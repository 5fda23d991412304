"""Leg rearrangements that move no singularity: the polynomial keeps its zeros, lengths follow from one another."""

import numpy as np
import pytest

from pentapod.base.errors import ArrayError, MachineError
from pentapod.kinematics import GeneralPentapod, LinearPentapod, singularity_polynomial
from pentapod.theory import LegPencil, cross_ratio

BASE = np.array([[0.58, -0.12], [0.22, 0.55], [-0.33, 0.5], [-0.6, -0.04], [-0.05, -0.59]])
GENERAL = GeneralPentapod(BASE, [0.10, 0.03, -0.05, -0.12, 0.16])
QUADRATIC = LinearPentapod.quadratic(BASE, 0.185)


def poses(count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    i = rng.normal(size=(count, 3))
    return rng.uniform(-1.0, 1.0, size=(count, 3)), i / np.linalg.norm(i, axis=1, keepdims=True)


def on_line(pencil: LegPencil, offset: float, along: float) -> np.ndarray:
    a, b, c = pencil.lines(offset)
    return -c * np.array([a, b]) + along * np.array([-b, a])


@pytest.mark.parametrize("robot", [GENERAL, QUADRATIC], ids=["general", "quadratic"])
def test_the_legs_themselves_are_on_their_lines(robot: GeneralPentapod) -> None:
    pencil = LegPencil.of(robot)
    for place, offset in zip(robot.base, robot.offsets, strict=True):
        assert pencil.distance(place, float(offset)) < 1e-12


@pytest.mark.parametrize("leg", range(5))
@pytest.mark.parametrize("robot", [GENERAL, QUADRATIC], ids=["general", "quadratic"])
def test_a_rearranged_leg_leaves_the_polynomial_but_for_a_factor(robot: GeneralPentapod, leg: int) -> None:
    pencil = LegPencil.of(robot)
    offset = float(robot.offsets[leg]) + 0.04
    moved = pencil.rearranged(leg, on_line(pencil, offset, 0.3 - 0.1 * leg), offset)
    p, i = poses(50)
    ratio = singularity_polynomial(moved, p, i) / singularity_polynomial(robot, p, i)
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-7)
    assert np.linalg.norm(moved.base[leg] - robot.base[leg]) > 0.01


@pytest.mark.parametrize("robot", [GENERAL, QUADRATIC], ids=["general", "quadratic"])
def test_its_length_follows_from_the_five_legs_in_every_pose(robot: GeneralPentapod) -> None:
    pencil = LegPencil.of(robot)
    place = on_line(pencil, 0.07, 0.4)
    leg = pencil.leg(place, 0.07)
    p, i = poses(50)
    real = np.linalg.norm(p + 0.07 * i - np.append(place, 0.0), axis=1)
    np.testing.assert_allclose(leg.length(robot.leg_lengths(p, i)), real, rtol=1e-10)
    assert leg.shares.sum() == pytest.approx(1.0, abs=1e-12)


def test_lines_meet_in_the_vertex_with_the_cross_ratio_of_the_offsets() -> None:
    pencil = LegPencil.of(GENERAL)
    offsets = np.array([-0.1, 0.0, 0.05, 0.2])
    lines = pencil.lines(offsets)
    np.testing.assert_allclose(lines @ pencil.vertex, 0.0, atol=1e-12)
    # Where four lines through a point cut another line, their cross ratio is that of the points.
    cut = np.array([0.3, 0.7, 0.2])
    points = np.cross(lines, cut)
    along = points[:, 0] / points[:, 2]
    assert cross_ratio(*along) == pytest.approx(float(cross_ratio(*offsets)), rel=1e-9)


def test_in_the_quadratic_family_the_lines_are_parallel_to_y() -> None:
    pencil = LegPencil.of(QUADRATIC)
    np.testing.assert_allclose(np.abs(pencil.vertex), [0.0, 1.0, 0.0], atol=1e-12)
    for x in (-0.4, 0.1, 0.5):
        assert pencil.distance(np.array([x, 0.77]), 0.185 * x) < 1e-12


def test_a_leg_off_its_line_is_refused_and_one_that_others_determine_too() -> None:
    pencil = LegPencil.of(QUADRATIC)
    with pytest.raises(ArrayError, match="would move the singularities"):
        pencil.leg(np.array([0.3, 0.2]), 0.3)
    with pytest.raises(ArrayError, match="no such leg"):
        pencil.rearranged(5, QUADRATIC.base[0], float(QUADRATIC.offsets[0]))
    with pytest.raises(MachineError, match="singular"):
        pencil.rearranged(0, QUADRATIC.base[1], float(QUADRATIC.offsets[1]))  # a copy of leg 2
