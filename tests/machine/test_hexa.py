"""The machine with six legs: read from its file, clear of its own arm, its margins one formula, its legs loaded."""

import casadi as ca
import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.geometry.solids import Solid
from pentapod.kinematics import RolledPlatform, leg_load_map
from pentapod.machine import Machine, clearances, pair_names, read_machine
from pentapod.machine.clearance.collision_world import CollisionWorld
from pentapod.machine.clearance.tool_clearance import leg_tool_gaps
from pentapod.machine.reader import machine_bytes
from pentapod.planning.limits.margins import Margins

HEXA = Machine.load("hexa")
TEXT = machine_bytes("hexa").decode()


def poses(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng, work = np.random.default_rng(seed), HEXA.work
    tips = work.centre + rng.uniform(-0.5, 0.5, (count, 3)) * [0.1, 0.1, work.height]
    axes = rng.normal(scale=0.2, size=(count, 3)) - [0.0, 0.0, 1.0]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    return tips + HEXA.tool_length * axes, -axes


def test_legs_are_counted_by_the_family() -> None:
    assert isinstance(HEXA.robot, RolledPlatform)
    assert {len(HEXA.legs.min_length), len(HEXA.joints.base_cone), len(HEXA.drives.moving_mass)} == {6}
    assert len(HEXA.leg_model.lead) == len(HEXA.rail_positions) == 6
    np.testing.assert_array_equal(HEXA.robot.arms, [0, 0, 0, 0, 0, 0.076])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[35, 35, 35, 35, 35, 20]", "[35, 35, 35, 35, 20]", "5 numbers where there are six legs"),
        (", [-469, 408]]", "]", "5 entries where there are six legs"),
        (", 129]", "]", "5 numbers where there are six legs"),
        ("arm_mm = 76", "arm_mm = 0", "arm_mm"),
        ("arm_mm = 76", "arm_mm = 76\nside = 2", "side"),
        ("delta = 0.185", "delta = 0.186", "offsets|platform_mm"),
        ('family = "hexa"', 'family = "general"', "arm_mm: unknown key"),
        ('family = "hexa"', 'family = "hexapod"', "did you mean|unknown"),
    ],
)  # fmt: skip
def test_wrong_files_are_one_clear_error(old: str, new: str, words: str) -> None:
    assert old in TEXT
    with pytest.raises(MachineError, match=words):
        read_machine(TEXT.replace(old, new), "mine.toml")


def test_clearances_are_those_of_points_on_legs_and_arm() -> None:
    s = np.linspace(0.0, 1.0, 600)[:, None]
    robot, bodies = HEXA.robot, HEXA.bodies
    for p, i in zip(*poses(4, 1), strict=True):
        base, joints = robot.base_joints, robot.platform_joints(p, i)
        foot = p + robot.offsets[5] * i
        lines = [base[k] * (1 - s) + joints[k] * s for k in range(6)]
        lines[5] = np.concatenate([lines[5], joints[5] * (1 - s) + foot * s])
        found = dict(zip(pair_names(HEXA), clearances(HEXA, p, i), strict=True))
        for k in range(5):
            apart = np.sqrt(((lines[k][:, None] - lines[5][None]) ** 2).sum(-1)).min() - 2.0 * bodies.leg_radius
            assert found[f"legs {k + 1}-6"] <= apart + 1e-12
            assert found[f"legs {k + 1}-6"] >= apart - 2e-3
        shaft = (p + robot.offsets.min() * i) * (1 - s) + (p + (HEXA.tool_length - bodies.shaft_end) * i) * s
        apart = np.sqrt(((lines[5][:600, None] - shaft[None]) ** 2).sum(-1)).min()
        assert abs(found["leg 6-shaft"] - (apart - bodies.leg_radius - bodies.shaft_radius)) < 2e-3


def test_leg_keeps_clear_of_a_capsule_around_the_holder() -> None:
    p, i = poses(5, 2)
    holder = Solid("holder", 0.03, 0.055, 0.006, 0.02, 0.002)
    gaps = leg_tool_gaps(HEXA, [holder], p, i)
    s, rng = np.linspace(0.0, 1.0, 400)[:, None], np.random.default_rng(3)
    for k in range(5):
        leg = HEXA.robot.base_joints[5] * (1 - s) + HEXA.robot.platform_joints(p[k], i[k])[5] * s
        around = np.cross(i[k], rng.normal(size=(500, 3)))
        around /= np.linalg.norm(around, axis=1, keepdims=True)
        heights = rng.uniform(holder.low, holder.high, (500, 1))
        share = (heights - holder.low) / (holder.high - holder.low)
        radius = holder.low_radius + share * (holder.high_radius - holder.low_radius) + holder.rounding
        points = p[k] + (HEXA.tool_length - heights) * i[k] + radius * around
        apart = np.sqrt(((leg[:, None] - points[None]) ** 2).sum(-1)).min() - HEXA.bodies.leg_radius
        assert gaps[k, 5] <= apart + 1e-9


def test_margins_are_one_formula_for_numbers_and_symbols() -> None:
    tool = (Solid("shank", 0.02, 0.06, 0.006, 0.006, 0.0),)
    margins = Margins.of(HEXA, HEXA.robot.branches[0], CollisionWorld((), tool))
    tip, axis = ca.SX.sym("tip", 3), ca.SX.sym("axis", 3)
    function = ca.Function("margins", [tip, axis], [margins.symbolic(tip, axis)])
    p, i = poses(20, 4)
    tips, axes = p + HEXA.tool_length * i, -i
    symbolic = np.array(function(tips.T, axes.T)).T
    np.testing.assert_allclose(symbolic, margins(tips, axes), rtol=1e-9, atol=1e-12)
    assert {"legs 1 and 6 touch", "leg 6 touches the spindle", "leg 6 touches the shank"} & {
        limit.name for limit in margins.limits
    }


def test_six_legs_hold_a_moment_about_the_tool_axis() -> None:
    p, i = poses(10, 5)
    loads = leg_load_map(HEXA.robot, p, i, HEXA.tool_length)
    rotation = HEXA.robot.rotation(p, i)
    slopes = HEXA.robot.platform.jacobian(p, rotation)  # of another class: by the position of p and a turn
    for k in range(10):
        for load in np.eye(6):
            force, moment = load[:3], load[3:]
            about_p = np.concatenate([force, moment + np.cross(HEXA.tool_length * i[k], force)])
            np.testing.assert_allclose(slopes[k].T @ loads[k] @ load, -about_p, atol=1e-9)
