"""drift: a leg that was bumped is named; noise alone is not; two machines are an error."""

import datetime
from dataclasses import replace

import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.machine import drift, identify
from pentapod.machine.identification.recording import record_of
from pentapod.machine.report.drift import drift_text
from true_machine import MACHINE, measured, poses, reached, readings, true_numbers

MONDAY = datetime.date(2026, 1, 5)


def record(seen):
    return record_of(identify(seen, MACHINE).calibration, MACHINE.name, MACHINE.robot, MONDAY)


@pytest.fixture(scope="module")
def first():
    return record(measured("pose", 40, 1))


def bumped(change: np.ndarray):
    """The same machine measured again after its numbers have changed."""
    seen = measured("pose", 40, 1, rng=np.random.default_rng(77))
    tips, axes = poses(40, 2001)
    numbers = true_numbers(1)
    moved = readings(numbers + change, tips, axes) - readings(numbers, tips, axes)
    return record(replace(seen, legs=seen.legs + moved))


def test_a_bumped_leg_is_named_in_mm_and_sigma_and_at_the_tip(first):
    change = np.zeros(30)
    change[[14, 17]] = 0.3e-3, 0.4e-3  # leg 3: z of its base joint, zero
    found = drift(first, bumped(change), MACHINE)
    assert found.chance < 1e-6
    assert found.moved
    assert all(one.name.startswith("leg 3") for one in found.moved)
    text = drift_text(found)
    assert "something has moved" in text
    assert "sigma" in text
    tips, axes = poses(6, 3)
    before = readings(true_numbers(1), tips, axes)
    off = np.linalg.norm(reached(true_numbers(1) + change, before, (tips, axes)) - tips, axis=1)
    assert 0.5 * off.max() < found.largest < 2.0 * off.max()
    assert found.tip_sigma < 0.1 * found.largest


def test_one_number_that_changed_is_the_explanation(first):
    change = np.zeros(30)
    change[23] = -0.15e-3
    (one,) = drift(first, bumped(change), MACHINE).moved
    assert one.name == "leg 4 zero"
    assert abs(one.change + 0.15e-3) < 4.0 * one.sigma < 0.05e-3


def test_frames_of_two_stations_are_no_drift():
    """Each fit lays its own frame on the base joints: only what changed on the machine is left."""
    tips, axes = poses(30, 9)
    numbers, change = true_numbers(1), np.zeros(30)
    change[23] = 0.15e-3
    first = measured("pose", 30, 1, own_frame=True, where=(tips, axes))
    second = measured("pose", 30, 1, where=(tips, axes), rng=np.random.default_rng(8))
    slipped = second.legs + readings(numbers + change, tips, axes) - readings(numbers, tips, axes)
    found = drift(record(first), record(replace(second, legs=slipped, frame="instrument")), MACHINE)
    (one,) = found.moved
    assert one.name == "leg 4 zero"
    assert abs(one.change - 0.15e-3) < 4.0 * one.sigma


def test_what_noise_explains_is_said_so(first):
    found = drift(first, bumped(np.zeros(30)), MACHINE)
    assert found.chance > 1e-3
    assert "nothing has moved that errors of measuring do not explain" in drift_text(found)
    assert found.largest < 0.2e-3


def test_a_machine_that_was_shifted_as_a_whole_bends_nothing(first):
    change = np.zeros(30)
    change[0::6] = 0.2e-3
    found = drift(first, bumped(change), MACHINE)
    assert found.largest > 0.15e-3
    assert np.linalg.norm(found.apart_from_frame, axis=1).max() < 0.05e-3


def test_calibrations_of_two_machines(first):
    with pytest.raises(MachineError, match="the calibrations are of two machines"):
        drift(first, replace(first, nominal="0" * 16), MACHINE)
    both = (replace(first, nominal="0" * 16),) * 2
    with pytest.raises(MachineError, match="of another geometry"):
        drift(*both, MACHINE)


def test_without_covariances_nothing_is_said_of_chance(first):
    found = drift(replace(first, fit=None), replace(first, fit=None), MACHINE)
    assert np.isnan(found.chance)
    assert found.moved == ()
    assert "hold no covariances" in drift_text(found)
