"""Calibration files: read back what was written, belong to one machine, and say what is wrong with them."""

import datetime
import re
from pathlib import Path

import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.kinematics import AsBuiltPentapod
from pentapod.machine import CalibrationRecord, Machine, calibrate, read_calibration, record_of, write_calibration
from pentapod.machine.calibration.calibration_file import calibration_text

DAY = datetime.date(2026, 1, 31)
DESK = Machine.load("desk")
TEXT = (Path(__file__).parents[3] / "src/pentapod/machine/library/desk.toml").read_text(encoding="utf-8")


def poses(rng, n):
    i = np.column_stack([rng.uniform(-0.4, 0.4, (n, 2)), np.ones(n)])
    i /= np.linalg.norm(i, axis=1)[:, None]
    return rng.uniform((-0.1, -0.1, 0.25), (0.1, 0.1, 0.35), (n, 3)), i


@pytest.fixture(scope="module")
def real():
    rng = np.random.default_rng(0)
    return AsBuiltPentapod.of(
        DESK.robot,
        base_errors=2e-4 * rng.normal(size=(5, 3)),
        zeros=5e-4 * rng.normal(size=5),
        radii=[0.0, 0.01, 0.0, 0.03, 0.0],
    )


@pytest.fixture(scope="module")
def record(real) -> CalibrationRecord:
    p, i = poses(np.random.default_rng(1), 40)
    readings = real.leg_lengths(p, i) + 1e-6 * np.random.default_rng(2).normal(size=(40, 5))
    found = calibrate(p, i, readings, DESK.robot, leg_sigma=1e-6)
    return record_of(found, "desk", DESK.robot, DAY)


@pytest.fixture
def written(record, tmp_path):
    write_calibration(record, tmp_path / "desk-0117.toml")
    return tmp_path / "desk-0117.toml"


def machine_file(folder, name="desk-0117.toml", text=TEXT):
    path = folder / "mine.toml"
    path.write_text(f'{text}\n[calibration]\nfile = "{name}"\n', encoding="utf-8")
    return path


def refusal(path):
    with pytest.raises(MachineError) as caught:
        read_calibration(path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(path))
    return caught.value


def test_a_record_read_back_equals_the_one_written(record, written):
    again = read_calibration(written)
    assert again == record
    assert again.digest == record.digest
    assert calibration_text(again) == calibration_text(record)
    assert again.fit.residuals.shape == (40, 5)


def test_a_measured_geometry_is_kept_to_a_picometre(real, record):
    built = record.as_built(DESK.robot)
    p, i = poses(np.random.default_rng(3), 50)
    assert np.abs(built.leg_lengths(p, i) - real.leg_lengths(p, i)).max() < 1e-5
    assert np.abs(built.base - record.geometry.base).max() == 0.0
    assert built.nominal == DESK.robot


def test_a_machine_file_names_its_calibration(real, record, written):
    machine = Machine.load(machine_file(written.parent))
    assert machine.calibration == record
    assert machine.digest != DESK.digest
    p, i = poses(np.random.default_rng(3), 5)
    off = np.abs(machine.robot.leg_lengths(p, i) - real.leg_lengths(p, i)).max()
    assert off < 1e-5 < np.abs(DESK.robot.leg_lengths(p, i) - real.leg_lengths(p, i)).max()


def test_a_calibration_of_another_geometry_is_refused(written):
    path = machine_file(written.parent, text=TEXT.replace("[586, -120]", "[586.5, -120]"))
    with pytest.raises(MachineError, match="of another geometry") as caught:
        Machine.load(path)
    assert str(caught.value).startswith(str(written))
    assert caught.value.key == "nominal"


def test_limits_may_change_after_a_calibration(written):
    faster = TEXT.replace("max_velocity_mm_s = 500", "max_velocity_mm_s = 400").replace(
        "length_mm = 198", "length_mm = 200"
    )
    assert Machine.load(machine_file(written.parent, text=faster)).calibration is not None


def test_a_calibration_of_a_machine_with_guides_is_refused(written):
    path = machine_file(written.parent, text=TEXT + "\n[guides]\nleast_mm = -10\n")
    with pytest.raises(MachineError, match="guides"):
        Machine.load(path)


def test_a_missing_calibration_file_is_one_error(tmp_path):
    with pytest.raises(MachineError, match=r"nothing\.toml: no such"):
        Machine.load(machine_file(tmp_path, "nothing.toml"))


def changed(written, pattern, new):
    text, count = re.subn(pattern, new, written.read_text(encoding="utf-8"), count=1)
    assert count == 1
    written.write_text(text, encoding="utf-8")
    return written


def test_numbers_changed_by_hand_are_found(written):
    error = refusal(changed(written, r"ring_radius_mm = \[[^,]*,", "ring_radius_mm = [0.5,"))
    assert error.key == "digest"
    assert error.line
    changed(written, r"(?m)^digest.*\n", "")
    assert read_calibration(written).geometry.radii[0] == 0.0005


@pytest.mark.parametrize(
    ("pattern", "new", "key"),
    [
        (r"(?m)^date.*$", 'date = "yesterday"', "date"),
        (r"(?m)^nominal.*$", 'nominal = "desk"', "nominal"),
        (r"platform_mm = \[[^,]*,", "platform_mm = [", "geometry.platform_mm"),
        (r"zero_mm = \[[^,]*,", "zero_mm = [nan,", "geometry.zero_mm"),
        (r"ring_radius_mm = \[[^,]*,", "ring_radius_mm = [-1,", "geometry.ring_radius_mm"),
        (r"zero_mm", "zeros_mm", "geometry.zeros_mm"),
        (r'"leg 1 x"', '"leg 7 x"', "fit.identified"),
        (r"covariance_mm2 = \[\n  \[[^,]*,", "covariance_mm2 = [\n  [-1.0,", "fit.covariance_mm2"),
        (r"covariance_mm2 = \[\n.*\n", "covariance_mm2 = [\n", "fit.covariance_mm2"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(written, pattern, new, key):
    error = refusal(changed(written, pattern, new))
    assert error.key.split("[")[0] == key
    assert error.line


def test_metres_read_as_millimetres_are_found(written):
    text = written.read_text(encoding="utf-8")
    rows = re.search(r"base_mm = \[\n.*?\n\]", text, re.DOTALL)
    assert rows
    small = re.sub(r"-?\d+\.\d+", lambda m: repr(float(m[0]) / 1000.0), rows[0])
    written.write_text(re.sub(r"(?m)^digest.*\n", "", text.replace(rows[0], small)), encoding="utf-8")
    with pytest.raises(MachineError, match="millimetres"):
        Machine.load(machine_file(written.parent))
