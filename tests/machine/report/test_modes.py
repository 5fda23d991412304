"""Modes at power-on: the true pose is among those that fit, or there is a refusal; bad input is told."""

import dataclasses

import numpy as np
import pytest

from pentapod.base.errors import InputError
from pentapod.base.refusal import Refusal
from pentapod.geometry.directions import angle_between
from pentapod.kinematics import AsBuiltPentapod
from pentapod.machine import Machine, admissible_modes, clearances
from pentapod.machine.report.modes import AssemblyPoses

DESK = Machine.load("desk")


def reachable(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Poses within strokes, cones and clear of bodies, drawn from far around the work volume."""
    rng = np.random.default_rng(seed)
    i = rng.normal(size=(count, 3)) * [0.6, 0.6, 0.3] + [0.0, 0.0, 0.9]
    i /= np.linalg.norm(i, axis=1, keepdims=True)
    p = DESK.work.centre + rng.uniform(-0.35, 0.35, size=(count, 3)) - DESK.tool_length * i
    vectors, joints = DESK.robot.leg_vectors(p, i), DESK.joints
    length = np.linalg.norm(vectors, axis=2)
    platform = angle_between(-vectors, -i[:, None, :])
    fits = ((length > DESK.legs.min_length) & (length < DESK.legs.max_length)).all(axis=1)
    fits &= (angle_between(vectors, joints.base_axes) < joints.base_cone).all(axis=1)
    fits &= ((platform > joints.platform_range[:, 0]) & (platform < joints.platform_range[:, 1])).all(axis=1)
    fits[fits] &= clearances(DESK, p[fits], i[fits]).min(axis=1) > 0.0
    return p[fits], i[fits]


def test_true_pose_of_any_reachable_one_is_admissible_or_it_is_refused() -> None:
    p, i = reachable(60_000, 1)
    assert len(p) > 100
    legs, refused, several = DESK.robot.leg_lengths(p, i), 0, 0
    for k in range(min(len(legs), 300)):
        found = admissible_modes(DESK, legs[k])
        if isinstance(found, Refusal):
            refused += 1
            continue
        tip = p[k] + DESK.tool_length * i[k]
        assert any(np.linalg.norm(pose.tip - tip) <= pose.error for pose in found.admissible)
        several += len(found.admissible) > 1
    assert refused <= 3  # those next to a singularity
    assert several <= 15


def test_what_excludes_a_mode_is_told() -> None:
    i = np.array([0.0, 0.0, 1.0])
    legs = DESK.robot.leg_lengths(DESK.work.centre - DESK.tool_length * i, i)
    found = admissible_modes(DESK, legs)
    assert isinstance(found, AssemblyPoses)
    (true,) = found.admissible
    np.testing.assert_allclose(true.tip, DESK.work.centre, atol=1e-9)
    assert true.error < 1e-4
    assert str(true.branch) == "++"
    assert all(pose.excluded for pose in found.poses if pose is not true)
    assert any("base joint" in words for pose in found.poses for words in pose.excluded)


def test_wider_joints_exclude_less() -> None:
    joints = dataclasses.replace(DESK.joints, base_cone=np.pi / 2, platform_range=np.array([0.0, np.pi]))
    i = np.array([0.0, 0.0, 1.0])
    legs = DESK.robot.leg_lengths(DESK.work.centre - DESK.tool_length * i, i)
    narrow, wide = (admissible_modes(m, legs) for m in (DESK, dataclasses.replace(DESK, joints=joints)))
    assert isinstance(narrow, AssemblyPoses)
    assert isinstance(wide, AssemblyPoses)
    assert sum(len(pose.excluded) for pose in wide.poses) < sum(len(pose.excluded) for pose in narrow.poses)


def test_legs_close_to_a_singularity_are_refused() -> None:
    i = np.array([np.sqrt(1.0 - 1e-8), 0.0, 1e-4])  # the line almost in the base plane
    found = admissible_modes(DESK, DESK.robot.leg_lengths(np.array([0.0, 0.0, 0.4]), i))
    assert isinstance(found, Refusal)
    assert "singularity" in str(found)


@pytest.mark.parametrize(
    ("legs", "words"),
    [
        ([0.6, 0.6, 0.6, 0.6], "5 positive lengths"),
        ([0.6, 0.6, -0.6, 0.6, 0.6], "5 positive lengths"),
        ([0.6, 0.6, np.nan, 0.6, 0.6], "legs"),
    ],
)
def test_what_is_no_set_of_legs_is_an_error(legs: list[float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        admissible_modes(DESK, legs)


def test_legs_beyond_their_strokes_are_refused_by_name() -> None:
    found = admissible_modes(DESK, [0.6, 0.6, 0.6, 0.6, 6.0])
    assert isinstance(found, Refusal)
    assert "leg 5 reads 6000 mm, stroke 489 to 929" in str(found)


def test_modes_of_a_calibrated_machine_are_proven_complete() -> None:
    rng = np.random.default_rng(4)
    robot = AsBuiltPentapod.of(
        DESK.robot, base_errors=rng.uniform(-2e-4, 2e-4, (5, 3)), radii=rng.uniform(0.0, 0.03, 5), zeros=5e-4
    )
    machine, i = dataclasses.replace(DESK, robot=robot), np.array([0.1, -0.2, 1.0])
    i /= np.linalg.norm(i)
    found = admissible_modes(machine, robot.leg_lengths(DESK.work.centre - DESK.tool_length * i, i))
    assert isinstance(found, AssemblyPoses)
    assert found.complete
    assert [str(pose.branch) for pose in found.poses] == ["++", "+-", "-+", "--"]
    (true,) = found.admissible
    np.testing.assert_allclose(true.tip, DESK.work.centre, atol=1e-9)


@pytest.mark.parametrize("name", ["spr", "prpu"])
def test_modes_of_a_machine_with_passive_joints_are_searched_for(name: str) -> None:
    machine, rng = Machine.load(name), np.random.default_rng(3)
    robot, several = machine.robot, 0
    for _ in range(12):
        i = rng.normal(size=3) * 0.6 + [0.0, 0.0, 1.0]
        i /= np.linalg.norm(i)
        p = robot.home + rng.uniform(-0.25, 0.25, 3)
        found = admissible_modes(machine, robot.leg_lengths(p, i))
        if isinstance(found, Refusal):
            assert "singularity" in found.cause
            continue
        assert not found.complete
        tip = p + machine.tool_length * i
        assert min(np.linalg.norm(pose.tip - tip) for pose in found.poses) < 1e-6
        several += len(found.poses) > 1
    assert several >= 6
    home = np.array([0.0, 0.0, 1.0])
    first = admissible_modes(machine, robot.leg_lengths(robot.home, home)).poses[0]
    assert first.fits
    np.testing.assert_allclose(first.axis, -home, atol=1e-9)
    assert isinstance(admissible_modes(machine, [0.1, 0.9, 0.1, 0.9, 0.1]), Refusal)  # no pose has such legs
