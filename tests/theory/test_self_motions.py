"""Self-motions: legs keep their lengths along them, and designs without them have no flat quartic."""

import numpy as np
import pytest

from pentapod.base.errors import ArrayError
from pentapod.kinematics import GeneralPentapod, LinearPentapod
from pentapod.theory import SelfMotions, self_motions

BASE = np.array([[0.58, -0.12], [0.22, 0.55], [-0.33, 0.5], [-0.6, -0.04], [-0.05, -0.59]])
OFFSETS = np.array([0.10, 0.03, -0.05, -0.12, 0.16])
ANGLES = np.linspace(0.0, 2.0 * np.pi, 41)


def keeps_the_legs(robot: LinearPentapod | GeneralPentapod, motion: SelfMotions, **which: float) -> None:
    p, i = motion.poses(ANGLES, **which)
    legs = robot.leg_lengths(p, i)
    np.testing.assert_allclose(np.linalg.norm(i, axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(legs, np.broadcast_to(legs[0], legs.shape), atol=1e-13)
    assert np.abs(np.concatenate([np.ptp(p, axis=0), np.ptp(i, axis=0)])).max() > 0.05


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("delta", [1.0, 1.7, -2.5])
def test_the_quadratic_family_translates_on_circles_from_delta_1_on(delta: float, side: int) -> None:
    robot = LinearPentapod.from_offsets(BASE, 0.03 + delta * BASE[:, 0], delta)
    (motion,) = self_motions(robot)
    assert motion.kind == "circular translation"
    keeps_the_legs(robot, motion, size=0.7, shift=0.2, side=side)
    p, i = motion.poses(ANGLES, size=0.7, shift=0.2)
    np.testing.assert_array_equal(i[:, 2], 0.0)
    assert np.ptp(p[:, 2]) == pytest.approx(1.4)


def test_below_delta_1_and_in_general_there_are_none() -> None:
    assert self_motions(LinearPentapod.quadratic(BASE, 0.999)) == ()
    assert self_motions(GeneralPentapod(BASE, OFFSETS)) == ()


def test_the_x_axis_of_the_family_may_point_anywhere() -> None:
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    robot = GeneralPentapod(BASE @ turn.T, 0.01 + 1.3 * BASE[:, 0])
    (motion,) = self_motions(robot)
    np.testing.assert_allclose(motion.along, [0.8, 0.6], atol=1e-12)
    keeps_the_legs(robot, motion, size=0.4, shift=-0.3)


def test_four_base_joints_on_a_line_turn_about_the_fifths_platform_joint() -> None:
    base = BASE.copy()
    base[1:] = [[-0.5, -0.3], [-0.1, 0.0], [0.3, 0.3], [0.7, 0.6]]
    robot = GeneralPentapod(base, OFFSETS)
    (motion,) = self_motions(robot)
    assert motion.kind == "turn about a point of the base"
    assert motion.offset == OFFSETS[0]
    keeps_the_legs(robot, motion, size=0.3, shift=0.25)
    p, i = motion.poses(ANGLES, size=0.3, shift=0.25)
    pivot = p + OFFSETS[0] * i
    np.testing.assert_allclose(pivot, np.broadcast_to(pivot[0], pivot.shape), atol=1e-14)
    assert pivot[0, 2] == pytest.approx(0.0, abs=1e-15)


def test_three_legs_on_one_platform_joint_turn_about_it() -> None:
    robot = GeneralPentapod(BASE, [0.1, 0.1, 0.1, -0.12, 0.16])
    motions = [motion for motion in self_motions(robot) if motion.offset == 0.1]
    assert len(motions) == 1
    keeps_the_legs(robot, motions[0], size=-0.4, shift=0.1)


def test_two_on_one_platform_joint_and_three_base_joints_on_a_line() -> None:
    base = BASE.copy()
    base[2:] = [[-0.4, -0.5], [0.0, -0.5], [0.5, -0.5]]
    robot = GeneralPentapod(base, [0.05, 0.05, -0.1, 0.2, 0.12])
    (motion,) = self_motions(robot)
    keeps_the_legs(robot, motion, size=0.0, shift=-0.2)


def test_a_self_motion_makes_the_quartic_of_its_legs_vanish_and_other_legs_do_not() -> None:
    """f at points of the solution line, by the leg equations solved here; the classification is not asked."""
    robot = LinearPentapod.quadratic(BASE, 1.7)
    general = GeneralPentapod(robot.base, robot.offsets)
    (motion,) = self_motions(robot)
    p, i = motion.poses(np.array([0.3]), size=0.7, shift=0.2)

    def largest(legs: np.ndarray) -> float:
        e = general.equations
        x = e.linear_map @ np.square(legs) + e.constant
        values = []
        for tau in np.linspace(-0.5, 0.5, 7):
            t, px, py, u, v = x + tau * e.null_vector
            values.append((1 - u * u - v * v) * (legs[2] ** 2 - px * px - py * py) - (t - px * u - py * v) ** 2)
        return float(np.abs(values).max())

    legs = robot.leg_lengths(p, i)[0]
    assert largest(legs) < 1e-12
    assert largest(legs + 0.01 * np.array([1.0, -1.0, 1.0, 1.0, -1.0])) > 1e-4


def test_random_designs_have_a_quartic_that_cannot_vanish() -> None:
    rng = np.random.default_rng(2)
    for _ in range(100):
        robot = GeneralPentapod(rng.uniform(-1, 1, (5, 2)), rng.uniform(-1, 1, 5))
        _, nx, ny, nu, nv = robot.equations.null_vector
        assert abs(nx * nv - ny * nu) > 0.0
        assert self_motions(robot) == ()


def test_what_does_not_exist_is_an_error() -> None:
    base = BASE.copy()
    base[1:] = [[-0.5, -0.3], [-0.1, 0.0], [0.3, 0.3], [0.7, 0.6]]
    (motion,) = self_motions(GeneralPentapod(base, OFFSETS))
    with pytest.raises(ArrayError, match="out of range"):
        motion.poses(ANGLES, size=1.2, shift=0.0)
    with pytest.raises(ArrayError, match="two sides"):
        motion.poses(ANGLES, size=0.2, shift=0.0, side=0)
