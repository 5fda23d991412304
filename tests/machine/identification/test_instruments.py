"""identify: what each instrument tells of a machine with known errors; scales by finite differences, Monte Carlo."""

from dataclasses import replace

import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.kinematics import AsBuiltPentapod, Component
from pentapod.machine import identify
from pentapod.machine.identification.identification import believed
from pentapod.machine.identification.least_squares import GROUPS, solved
from pentapod.machine.identification.observations import in_machine_frame, observations_of
from pentapod.machine.identification.sensitivity import numbers_of
from true_machine import MACHINE, frame_free, measured, poses, reached, true_numbers

EVERY = [("pose", 12, 1), ("tracker", 20, 1), ("plate", 24, 2), ("ballbar", 80, 1), ("ballbar", 90, 2)]


@pytest.mark.parametrize(("instrument", "n", "setups"), EVERY)
def test_every_instrument_finds_the_machine_without_noise(instrument, n, setups):
    found = identify(measured(instrument, n, 1, noise=0.0, setups=setups), MACHINE)
    assert found.calibration.converged
    assert found.outliers == ()
    near = poses(5, seed=7)
    tips = reached(true_numbers(1), found.calibration.machine.leg_lengths(*_pose(*near)), near)
    off = frame_free(tips, near[0]) if instrument == "ballbar" else tips - near[0]
    assert np.abs(off).max() < 2e-8
    if instrument != "ballbar":
        assert len(found.calibration.identified) == 30
        assert np.abs(numbers_of(found.calibration.machine) - true_numbers(1)).max() < 1e-7
    assert np.nanmax(found.held_out) < 1e-7


@pytest.mark.parametrize(("instrument", "n"), [("pose", 20), ("tracker", 30)])
def test_a_frame_of_the_instruments_own_is_found(instrument, n):
    found = identify(measured(instrument, n, 2, noise=0.0, own_frame=True), MACHINE)
    near = poses(5, seed=8)
    tips = reached(true_numbers(2), found.calibration.machine.leg_lengths(*_pose(*near)), near)
    assert np.abs(frame_free(tips, near[0])).max() < 2e-8
    base, true = found.calibration.machine.base, true_numbers(2).reshape(5, 6)[:, :3]
    assert np.abs(frame_free(true, MACHINE.robot.base_joints) + MACHINE.robot.base_joints - base).max() < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize("instrument", ["pose", "ballbar"])
def test_the_covariance_in_the_frame_of_the_base_joints(instrument):
    """24 numbers are measured, the frame is defined: squared distances in sigmas are 24 in the mean."""
    ringed = replace(MACHINE, robot=AsBuiltPentapod.of(MACHINE.robot, radii=15e-3))
    true, squares = true_numbers(6, 15e-3), []
    true.reshape(5, 6)[:, :3] = frame_free(true.reshape(5, 6)[:, :3], MACHINE.robot.base_joints) + np.array(
        MACHINE.robot.base_joints
    )
    own, n = instrument == "pose", {"pose": 20, "ballbar": 120}[instrument]
    for trial in range(100):
        rng = np.random.default_rng(trial)
        made = identify(
            measured(instrument, n, 6, ring=15e-3, own_frame=own, rng=rng), ringed, keep_outliers=True
        ).calibration
        assert len(made.identified) == 30
        sigma = np.sqrt(np.diag(made.covariance))
        values, vectors = np.linalg.eigh(made.covariance / np.outer(sigma, sigma))
        assert (values < 1e-11 * values[-1]).sum() == 6
        squares.append(np.square(vectors[:, 6:].T @ ((numbers_of(made.machine) - true) / sigma) / np.sqrt(values[6:])))
    assert np.sum(squares, axis=1).mean() == pytest.approx(24.0, abs=3.5 * np.sqrt(48.0 / 100))


def test_a_few_docks_tell_the_zeros_alone():
    found = identify(measured("dock", 6, 3, given=False), MACHINE)
    assert found.calibration.identified == tuple(f"leg {k} zero" for k in range(1, 6))
    near = poses(20, seed=9)
    off = [
        np.linalg.norm(reached(true_numbers(3), legs, near) - near[0], axis=1).mean()
        for legs in (MACHINE.robot.leg_lengths(*_pose(*near)), found.calibration.machine.leg_lengths(*_pose(*near)))
    ]
    assert off[1] < 0.5 * off[0]
    assert found.tip_sigma > 0.3 * off[1], "the tolerances of building count, as the joints are not found"


@pytest.mark.parametrize(("instrument", "setups"), [("pose", 1), ("tracker", 2), ("ballbar", 2)])
def test_columns_are_the_finite_differences_of_residuals(instrument, setups):
    design = believed(MACHINE)
    seen = observations_of(in_machine_frame(measured(instrument, 20, 4, setups=setups), design), design)
    theta = seen.start + 1e-4 * np.random.default_rng(0).normal(size=len(seen.start))
    theta[4:30:6] = np.abs(theta[4:30:6]) + 1e-3
    columns, h = seen.columns(theta), 1e-7
    for k in range(len(theta)):
        step = h * np.eye(len(theta))[k]
        numeric = (seen.residuals(theta - step) - seen.residuals(theta + step)) / (2.0 * h)
        assert np.abs(columns[..., k] - numeric).max() < 2e-5 * max(1.0, np.abs(numeric).max())


def test_the_predicted_errors_of_the_tip_are_those_that_come():
    near, ratios = poses(5, seed=10), []
    for seed in range(4):
        found = identify(measured("tracker", 30, seed), MACHINE)
        tips = reached(true_numbers(seed), found.calibration.machine.leg_lengths(*_pose(*near)), near)
        ratios.append(np.square(tips - near[0]).sum(axis=1).mean() / found.tip_sigma**2)
    assert 0.3 < np.mean(ratios) < 2.5


@pytest.mark.slow
@pytest.mark.parametrize(("instrument", "n"), [("pose", 20), ("tracker", 30), ("plate", 40)])
def test_two_sigma_hold_what_they_should_of_partial_measurements_too(instrument, n):
    """Rings are far from 0, where a bound would cut the distribution."""
    ringed = replace(MACHINE, robot=AsBuiltPentapod.of(MACHINE.robot, radii=15e-3))
    outside, true = [], true_numbers(5, 15e-3)
    for trial in range(600):
        rng = np.random.default_rng(trial + 5000)
        seen = observations_of(measured(instrument, n, 5, ring=15e-3, rng=rng), believed(ringed))
        found = solved(seen, tuple(GROUPS), 2e-6, 5e-3)
        assert found.converged
        assert len(found.inner) == 30
        outside.append((np.abs(found.theta - true) > 2.0 * np.sqrt(np.diag(found.covariance))).mean())
    assert 0.04 <= np.mean(outside) <= 0.055


def _pose(tips, axes):
    return tips + MACHINE.tool_length * axes, -axes


@pytest.mark.slow
def test_a_ball_bar_in_another_component_is_told_so():
    seen = replace(measured("ballbar", 60, 3, setups=3), component=Component(1, -1))
    with pytest.raises(MachineError, match=r'in component .*, the file says "\+-"; write .*"\+\+".*"--"'):
        identify(seen, MACHINE)
