"""What every shipped machine promises: limits kept in its work volume, poses and legs inverse, modes told apart."""

import itertools

import numpy as np
import pytest

from lengths import examples
from pentapod.machine import Machine, admissible_modes, check, explain, shipped_machines
from pentapod.machine.report.modes import AssemblyPoses


@pytest.fixture(scope="module", params=shipped_machines())
def machine(request: pytest.FixtureRequest) -> Machine:
    return Machine.load(request.param)


def poses(machine: Machine, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions and directions of random tips and tool axes of the work volume."""
    rng, work = np.random.default_rng(seed), machine.work
    radius, turn = 0.5 * work.diameter * np.sqrt(rng.random(count)), rng.uniform(0.0, 2.0 * np.pi, count)
    up = (rng.random(count) - 0.5) * work.height
    tips = work.centre + np.stack([radius * np.cos(turn), radius * np.sin(turn), up], axis=1)
    lean, azimuth = work.tilt * np.sqrt(rng.random(count)), rng.uniform(0.0, 2.0 * np.pi, count)
    i = np.stack([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)], axis=1)
    return tips - machine.tool_length * i, i


def test_keeps_its_limits_in_its_work_volume_and_is_explained(machine: Machine) -> None:
    report = check(machine)
    assert report.passed, [finding for finding in report.findings if not finding.passed]
    text = explain(report)
    assert f"machine {machine.name}" in text
    assert all(surface.name in text for surface in machine.robot.singularities)
    assert machine.architecture >= 0.015


def test_forward_kinematics_undoes_inverse_kinematics(machine: Machine) -> None:
    p, i = poses(machine, 300, 1)
    legs, branch = machine.robot.leg_lengths(p, i), machine.robot.branch(p, i)
    assert len({tuple(signs) for signs in branch.tolist()}) == 1  # one component holds the work volume
    found = machine.robot.pose(legs, branch)
    np.testing.assert_allclose(found[0], p, atol=1e-11)
    np.testing.assert_allclose(found[1], i, atol=1e-11)


def test_all_modes_have_the_legs(machine: Machine) -> None:
    legs = machine.robot.leg_lengths(*poses(machine, 100, 2))
    for branch in machine.robot.branches:
        found = machine.robot.pose(legs, np.array(branch, dtype=float))
        there = np.isfinite(found[0]).all(axis=1)
        assert there.all() or machine.robot.arms.any()  # a leg beside the line fits some modes only
        np.testing.assert_allclose(machine.robot.leg_lengths(*found)[there], legs[there], atol=1e-9)


def test_true_mode_is_admissible_at_power_on(machine: Machine) -> None:
    """The readings are off by as much as they may be; the pose is in the work volume, where no limit is broken."""
    p, i = poses(machine, examples(20, 60), 3)
    legs = machine.robot.leg_lengths(p, i)
    errors = np.random.default_rng(4).choice([-1e-5, 1e-5], size=legs.shape)
    for k, row in enumerate(legs + errors):
        found = admissible_modes(machine, row, leg_error=1e-5)
        assert isinstance(found, AssemblyPoses)
        tip = p[k] + machine.tool_length * i[k]
        assert any(np.linalg.norm(pose.tip - tip) <= pose.error for pose in found.admissible)


def test_no_position_of_the_rails_is_architecturally_singular() -> None:
    """F is affine in the y of each joint, so its extremes over the travel are at the corners."""
    guides = Machine.load("guide").guides
    assert guides is not None
    np.testing.assert_array_equal(guides.guides, [[0.0, 1.0]] * 5)
    corners = np.array(list(itertools.product(*guides.travel)))
    values = guides.determinant(corners)
    assert len(values) == 32
    assert (np.sign(values) == np.sign(guides.determinant(np.zeros(5)))).all()
    assert np.abs(values).min() > 0.1 * abs(float(guides.determinant(np.zeros(5))))


def test_steep_and_bench_general_are_advertised_for_what_they_were_designed() -> None:
    steep, general = Machine.load("steep"), Machine.load("bench-general")
    assert steep.work.tilt >= np.radians(45.0)
    assert general.work.tilt >= np.radians(30.0)
    for machine in (steep, general):
        report = check(machine, rings=3, around=20)
        assert machine.work.diameter >= 0.15
        assert machine.work.height >= 0.06
        assert report.clearance >= 0.005
        assert report.margins[1] >= 0.2
        assert report.amplification <= 5.9
        stroke = machine.legs.max_length - machine.legs.min_length
        assert (machine.legs.min_length - stroke >= 0.049).all()  # room for nut and joints, as in `desk`
