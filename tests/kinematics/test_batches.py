"""Arguments that do not belong together: one clear error from every function that takes poses, legs or labels."""

import numpy as np
import pytest

from pentapod.base.errors import ArrayError
from pentapod.kinematics import (
    AsBuiltPentapod,
    GeneralPentapod,
    LinearPentapod,
    ReconfigurablePentapod,
    SixLegPlatform,
    as_built_pose,
    forbidden_conic,
    leg_force_map,
    orientation_distance,
    pose_jacobian,
    position_distance,
    singularity_polynomial,
    singularity_values,
    tip_compliance,
    tip_stiffness,
)
from pentapod.theory import cell_of, choose_rail_positions, conditioning_criterion, singularity_free_sphere

BASE = 0.2 * np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])
ROBOT = LinearPentapod.quadratic(BASE, 0.5)
GENERAL = GeneralPentapod(BASE, [0.31, -0.2, 0.05, 0.14, -0.1])
BUILT = AsBuiltPentapod.of(ROBOT)
SIX = SixLegPlatform(ROBOT, [0.1, 0.1, 0.0], [0.1, 0.0, 0.2])
GUIDED = ReconfigurablePentapod.along_y(ROBOT, np.tile((-0.1, 0.1), (5, 1)))
SPRINGS = np.full(5, 1e6)

OF_POSES = {
    "leg_vectors": ROBOT.leg_vectors,
    "leg_lengths": ROBOT.leg_lengths,
    "component": ROBOT.branch,
    "mode": GENERAL.branch,
    "order_value": GENERAL.order_value,
    "as built, leg_lengths": BUILT.leg_lengths,
    "as built, jacobian": BUILT.jacobian,
    "sixth_leg_range": SIX.sixth_leg_range,
    "jacobian": ROBOT.jacobian,
    "pose_jacobian": lambda p, i: pose_jacobian(ROBOT, p, i),
    "singularity_values": lambda p, i: singularity_values(ROBOT, p, i),
    "singularity_polynomial": lambda p, i: singularity_polynomial(GENERAL, p, i),
    "position_distance": lambda p, i: position_distance(ROBOT, p, i),
    "orientation_distance": lambda p, i: orientation_distance(ROBOT, p, i),
    "singularity_free_sphere": lambda p, i: singularity_free_sphere(ROBOT, p, i),
    "cell_of": lambda p, i: cell_of(ROBOT, p, i),
    "leg_force_map": lambda p, i: leg_force_map(ROBOT, p, i, 0.1),
    "tip_stiffness": lambda p, i: tip_stiffness(ROBOT, p, i, SPRINGS, 0.1),
    "tip_compliance": lambda p, i: tip_compliance(ROBOT, p, i, SPRINGS, 0.1),
    "choose_rail_positions": lambda p, i: choose_rail_positions(GUIDED, p, i, conditioning_criterion(1.0)),
}


@pytest.mark.parametrize("name", OF_POSES)
def test_batches_of_positions_and_directions_that_do_not_fit(name: str) -> None:
    with pytest.raises(ArrayError, match=r"position has shape \(3, 3\), direction \(2, 3\); expected leading axes"):
        OF_POSES[name](np.ones((3, 3)), np.ones((2, 3)))
    with pytest.raises(ArrayError, match=r"position has shape \(2,\)"):
        OF_POSES[name](np.ones(2), np.ones(3))


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (lambda legs: ROBOT.pose(legs, np.ones((2, 2))), r"legs has shape \(3, 5\), component \(2, 2\)"),
        (lambda legs: GENERAL.pose(legs, np.ones((2, 2))), r"legs has shape \(3, 5\), mode \(2, 2\)"),
        (
            lambda legs: as_built_pose(BUILT, ROBOT, legs, np.ones((2, 2))),
            r"legs has shape \(3, 5\), component \(2, 2\)",
        ),
        (lambda legs: SIX.pose(np.c_[legs, legs[:, 0]], np.ones((2, 3))), r"legs has shape \(3, 6\), label \(2, 3\)"),
        (
            lambda legs: SIX.leg_lengths(legs[:, :3], np.ones((2, 3, 3))),
            r"position has shape \(3, 3\), rotation \(2, 3, 3\)",
        ),
        (lambda legs: ROBOT.pose(legs, (1, 3)), r"component is out of range \(got 3\.0\); expected \+1 or −1"),
        (lambda legs: ROBOT.pose(legs + 1j, (1, 1)), "legs is complex; expected real numbers"),
        (lambda legs: ROBOT.pose([[1, 2], [1]], (1, 1)), "legs is not an array of numbers"),
        (lambda legs: forbidden_conic(BASE, 5), r"there is no such leg \(got 5\); expected 0 … 4"),
        (lambda legs: forbidden_conic(BASE, -1), r"there is no such leg \(got -1\)"),
        (lambda legs: GUIDED.forbidden_rail_positions(7, np.zeros(5)), r"there is no such leg \(got 7\)"),
        (lambda legs: leg_force_map(ROBOT, np.ones(3), np.ones(3), np.nan), "tool_length is not finite"),
        (lambda legs: tip_stiffness(ROBOT, np.ones(3), np.ones(3), SPRINGS, "long"), "tool_length is not an array"),
        (
            lambda legs: choose_rail_positions(GUIDED, legs[:0, :3], legs[:0, :3], conditioning_criterion(1.0)),
            "nothing to choose",
        ),
    ],
)
def test_other_arguments_that_make_no_sense(action, words: str) -> None:
    with pytest.raises(ArrayError, match=words):
        action(np.ones((3, 5)))
