"""Stiffness of legs and joints: keys of the machine file, springs in series, what `machine check` says of the tip."""

from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.kinematics import AsBuiltPentapod, leg_force_map
from pentapod.machine import Machine, Stiffness, check, explain, read_machine
from pentapod.machine.dynamics.deflection import Yielding

DESK = (resources.files("pentapod.machine") / "library" / "desk.toml").read_text(encoding="utf-8")


def desk(legs: str = "", joints: str = "") -> Machine:
    text = DESK.replace("min_length_mm", f"{legs}\nmin_length_mm", 1).replace("[joints]\n", f"[joints]\n{joints}\n")
    return read_machine(text, "my.toml")


def test_springs_of_a_leg_and_its_joints_are_in_series() -> None:
    machine = desk("stiffness_n_um = [20, 20, 20, 20, 40]\nrigidity_kn = 10000", "stiffness_n_um = 60")
    lengths = np.full((1, 5), 0.5)
    by_hand = 1e-6 / 20 + 1e-6 / 60 + 0.5 / 1e7
    np.testing.assert_allclose(machine.stiffness.yielding(lengths)[0, :4], by_hand)
    np.testing.assert_allclose(machine.stiffness.yielding(lengths)[0, 4], by_hand - 1e-6 / 40)
    assert not Machine.load("desk").stiffness.given
    assert machine.digest == Machine.load("desk").digest  # no program depends on it


@pytest.mark.parametrize(
    ("legs", "joints", "key"),
    [
        ("stiffness_n_um = 0", "", "legs.stiffness_n_um"),
        ("stiffness_n_um = [20, 20]", "", "legs.stiffness_n_um"),
        ("rigidity_kn = -1", "", "legs.rigidity_kn"),
        ("", "stiffness_n_um = -3", "joints.stiffness_n_um"),
    ],
)
def test_wrong_stiffness_is_one_line_with_its_key(legs: str, joints: str, key: str) -> None:
    with pytest.raises(MachineError, match=key) as caught:
        desk(legs, joints)
    assert "\n" not in str(caught.value)


def test_the_tip_yields_as_exact_forward_kinematics_of_shortened_legs_says() -> None:
    machine = desk("stiffness_n_um = [15, 20, 25, 30, 35]", "stiffness_n_um = 100")
    robot, tool, i = machine.robot, machine.tool_length, np.array([0.0, 0.2, np.sqrt(0.96)])
    p, force = machine.work.centre - tool * i, np.array([50.0, -60.0, 70.0])
    lengths = robot.leg_lengths(p, i)
    push = leg_force_map(robot, p, i, tool) @ force
    at, along = robot.pose(lengths - push * machine.stiffness.yielding(lengths), robot.branch(p, i))
    shift = at + tool * along - p - tool * i
    found = Yielding.of(machine, p[None], i[None], push[None]).shift[0]
    assert 10e-6 < np.linalg.norm(found) < 1e-3
    assert np.linalg.norm(found - shift) < 2e-3 * np.linalg.norm(found)


def test_machine_check_tells_the_softest_pose_and_direction() -> None:
    machine = desk("stiffness_n_um = 20")
    report = check(machine)
    softness = report.softness
    assert softness is not None
    assert 0.2e6 < softness.softest < softness.stiffest < 20e6
    twice = check(replace(machine, stiffness=Stiffness(leg_stiffness=np.full(5, 40e6)))).softness
    assert twice.softest == pytest.approx(2.0 * softness.softest)
    np.testing.assert_allclose(twice.direction, softness.direction, atol=1e-9)
    assert "stiffness at the tip" in explain(report)
    assert f"{1e-6 * softness.softest:.3g} to" in explain(report)
    assert check(Machine.load("desk")).softness is None
    assert "stiffness at the tip" not in explain(check(Machine.load("desk")))


def test_springs_along_the_axes_give_the_shift_by_hand() -> None:
    """Three legs along x, y, z end at p, two along x and y a height above it: a lever for forces across the tool."""
    height, tool, springs = 0.1, 0.3, np.array([10e6, 20e6, 30e6, 40e6, 50e6])
    feet = np.array([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, height], [0.0, -1.0, height]])
    robot = AsBuiltPentapod(feet, np.array([0.0, 0.0, 0.0, height, height]), np.zeros(5), np.zeros(5), desk().robot)
    machine = replace(Machine.load("desk"), robot=robot, tool_length=tool, stiffness=Stiffness(leg_stiffness=springs))
    # The nominal machine only names the branches.
    upright = (np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))
    share = tool / height
    by_hand = np.array(
        [(1 - share) ** 2 / springs[0] + share**2 / springs[3], (1 - share) ** 2 / springs[1] + share**2 / springs[4]]
    )
    for way, yields in zip(np.eye(3), (*by_hand, 1.0 / springs[2]), strict=True):
        push = leg_force_map(robot, *upright, tool) @ (100.0 * way)
        np.testing.assert_allclose(
            Yielding.of(machine, *upright, push).shift[0], 100.0 * yields * way, rtol=1e-9, atol=1e-15
        )
    found = Yielding.of(machine, *upright)
    np.testing.assert_allclose(found.softest, by_hand.max(), rtol=1e-9)
    np.testing.assert_allclose(np.abs(found.ways[0]), [1.0, 0.0, 0.0], atol=1e-9)
