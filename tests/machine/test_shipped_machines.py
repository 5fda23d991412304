"""What every shipped machine promises: limits kept in its work volume, poses and legs inverse, modes told apart."""

import numpy as np
import pytest

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
    assert machine.architecture >= 0.02


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
        np.testing.assert_allclose(machine.robot.leg_lengths(*found), legs, atol=1e-9)


def test_true_mode_is_admissible_at_power_on(machine: Machine) -> None:
    """The readings are off by as much as they may be; the pose is in the work volume, where no limit is broken."""
    p, i = poses(machine, 60, 3)
    legs = machine.robot.leg_lengths(p, i)
    errors = np.random.default_rng(4).choice([-1e-5, 1e-5], size=legs.shape)
    for k, row in enumerate(legs + errors):
        found = admissible_modes(machine, row, leg_error=1e-5)
        assert isinstance(found, AssemblyPoses)
        tip = p[k] + machine.tool_length * i[k]
        assert any(np.linalg.norm(pose.tip - tip) <= pose.error for pose in found.admissible)
