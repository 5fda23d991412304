"""The 5-UPS+PRPU machine: its file, and its passive limb, whose pose follows from the tool's."""

import dataclasses

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from pentapod.base.errors import MachineError
from pentapod.geometry.directions import angle_between
from pentapod.kinematics.mode import Mode
from pentapod.machine import Machine, check, clearances, pair_names, read_machine, sample_work_volume
from pentapod.machine.leg_ends import rails, strut_ends
from pentapod.machine.reader import machine_bytes
from pentapod.planning.limits.margins import Margins

TEXT = machine_bytes("prpu").decode()
PRPU = Machine.load("prpu")
LIMB = PRPU.limb


def poses() -> tuple[np.ndarray, np.ndarray]:
    """Positions and directions all over the work volume."""
    tips, axes = sample_work_volume(PRPU.work, rings=1, around=7, levels=2)
    return tips + PRPU.tool_length * axes, -axes


def test_strut_is_the_shortest_way_from_its_rail_to_the_tool_axis() -> None:
    p, i = poses()
    foot, end = LIMB.ends(p, i)
    np.testing.assert_allclose(end, p + LIMB.joint * i)
    for k in range(0, len(p), 37):
        best = minimize_scalar(lambda s, k=k: float(np.linalg.norm(LIMB.origin + s * LIMB.rail - end[k])), tol=1e-12)
        place, length, angle = LIMB.at(p[k], i[k])
        np.testing.assert_allclose([place, length], [best.x, best.fun], atol=1e-8)
        assert angle == pytest.approx(angle_between(foot[k] - end[k], -i[k]))


def test_its_joint_lets_the_platform_turn_as_the_robot_says() -> None:
    """The axis of the universal joint that is fixed to the platform is perpendicular to the one along the rail."""
    axes = PRPU.robot.rotation(*poses())[..., 1]
    np.testing.assert_allclose(axes @ LIMB.rail, 0.0, atol=1e-14)
    np.testing.assert_allclose(np.einsum("nk,nk->n", axes, poses()[1]), 0.0, atol=1e-14)


def test_clearances_are_distances_of_samples() -> None:
    """Strut against legs and their arms, all as dense points."""
    p, i = (x[:3] for x in poses())
    found, share = clearances(PRPU, p, i), np.linspace(0.0, 1.0, 400)[:, None]
    for row in range(3):
        foot, end = LIMB.ends(p[row], i[row])
        strut = foot + share * (end - foot)
        joints = PRPU.robot.platform_joints(p[row], i[row])
        for leg in range(5):
            leg_points = PRPU.robot.base_joints[leg] + share * (joints[leg] - PRPU.robot.base_joints[leg])
            arm = joints[leg] + share * (p[row] + PRPU.robot.offsets[leg] * i[row] - joints[leg])
            apart = np.linalg.norm(strut[:, None] - np.concatenate([leg_points, arm]), axis=2).min()
            known = found[row, pair_names(PRPU).index(f"leg {leg + 1}-passive limb")]
            assert known == pytest.approx(apart - LIMB.radius - PRPU.bodies.leg_radius, abs=1e-4)


def test_margins_end_where_the_limb_does() -> None:
    """Signs against the limb's own measures; the same in NumPy and casadi."""
    p, i = poses()
    narrow = dataclasses.replace(
        LIMB, carriage=np.array([-0.1, 0.15]), strut=np.array([0.33, 0.42]), joint_range=np.radians([20.0, 50.0])
    )
    machine = dataclasses.replace(PRPU, limb=narrow)
    margins = Margins.of(machine, Mode(*PRPU.robot.branch(p[0], i[0]).tolist()))
    tips = p + PRPU.tool_length * i
    values = margins(tips, -i)
    names = [limit.name for limit in margins.limits]
    first = names.index("carriage off the rail's lower end")
    place, length, angle = narrow.at(p, i).T
    inside = [place > -0.1, place < 0.15, length > 0.33, length < 0.42, angle < np.radians(50), angle > np.radians(20)]
    np.testing.assert_array_equal(values[:, first : first + 6] > 0.0, np.stack(inside, axis=1))
    assert all(0 < np.count_nonzero(column) < len(p) for column in inside)
    tip, axis = ca.SX.sym("tip", 3), ca.SX.sym("axis", 3)
    formula = ca.Function("f", [tip, axis], [margins.symbolic(tip, axis)])
    np.testing.assert_allclose(np.asarray(formula(tips[9], -i[9])).ravel(), values[9], rtol=1e-10, atol=1e-10)
    assert not check(machine, rings=1, around=6, levels=2).passed


def test_drawings_have_rail_and_strut() -> None:
    p, i = (x[5] for x in poses())
    ((foot, end),), ((low, high),) = strut_ends(PRPU, p + PRPU.tool_length * i, -i), rails(PRPU)
    np.testing.assert_allclose(end, p + LIMB.joint * i)
    assert np.linalg.norm(foot - low) + np.linalg.norm(high - foot) == pytest.approx(np.linalg.norm(high - low))
    assert len(strut_ends(Machine.load("desk"), p, i)) == len(rails(Machine.load("desk"))) == 0


def test_the_limb_is_in_the_digest() -> None:
    other = read_machine(TEXT.replace("strut_diameter_mm = 30", "strut_diameter_mm = 31"), "mine.toml")
    assert other.digest != PRPU.digest


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("rail_direction = [0, 1]", "rail_direction = [0, 0]", "geometry.rail_direction.*no direction"),
        ("strut_mm = [240, 470]", "strut_mm = [500, 270]", "geometry.strut_mm.*the first the smaller"),
        ("strut_mm = [240, 470]", "strut_mm = [0, 500]", "two positive lengths"),
        ("rail_travel_mm = [-260, 260]", "rail_travel_mm = [260, -260]", "geometry.rail_travel_mm"),
        ("strut_diameter_mm = 30", "strut_diameter_mm = 0", "strut_diameter_mm"),
        ("strut_joint_mm = -99", "", "strut_joint_mm"),
        ("strut_joint_mm = -99", "strut_joint_mm = 190", "too short"),
        ('family = "5-ups-prpu"', 'family = "4-ups-spr"', "rail_direction"),
    ],
)
def test_wrong_files_are_one_clear_error(old: str, new: str, words: str) -> None:
    assert old in TEXT
    with pytest.raises(MachineError, match=words):
        read_machine(TEXT.replace(old, new), "mine.toml")
