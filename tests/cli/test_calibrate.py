"""pentapod calibrate and machine drift: from a measurement file to programs that hit, and every mistake in a line."""

import json
import tomllib

import numpy as np
import pytest

from pentapod.cli.main import run
from pentapod.machine import Machine, write_measurements
from pentapod.machine.reader import machine_bytes
from true_machine import MACHINE, TOOL, measured, poses, reached, true_numbers


@pytest.fixture
def file(tmp_path):
    return write_measurements(measured("pose", 24, 1, given=False), tmp_path / "m.csv")


def test_a_machine_is_calibrated_from_its_own_file_and_hits(file, tmp_path, capsys):
    """The calibrated legs take the tip of the true machine to where it shall be; the designed ones do not."""
    assert run(["calibrate", "fit", str(file), "--date", "2026-03-01"]) == 0
    said = capsys.readouterr().out
    assert "30 of 30 numbers found" in said
    assert "0 left out" in said
    assert 'file = "calibration.toml"' in said
    page = (tmp_path / "calibration.html").read_text()
    assert "found, mm" in page
    assert "held out" in page
    own = machine_bytes("desk").decode() + '\n[calibration]\nfile = "calibration.toml"\n'
    (tmp_path / "own.toml").write_text(own)
    machine, near = Machine.load(tmp_path / "own.toml"), poses(8, 42)
    tips, axes = near
    off = {}
    for name, one in (("calibrated", machine), ("designed", MACHINE)):
        legs = one.robot.leg_lengths(tips + TOOL * axes, -axes)
        off[name] = np.linalg.norm(reached(true_numbers(1), legs, near) - tips, axis=1).max()
    assert off["calibrated"] < 50e-6
    assert off["designed"] > 1e-3
    assert tomllib.loads((tmp_path / "calibration.toml").read_text())["date"].isoformat() == "2026-03-01"


def test_json_and_choices(file, tmp_path, capsys):
    out = tmp_path / "zeros.toml"
    assert run(["calibrate", "fit", str(file), "--find", "zeros", "-o", str(out), "--json", "--keep-outliers"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["identified"] == [f"leg {k} zero" for k in range(1, 6)]
    assert content["calibration"] == str(out)
    assert run(["calibrate", "fit", str(file), "-q", "-o", str(out)]) == 0
    assert capsys.readouterr() == ("", "")


def test_mistakes_are_one_line(file, tmp_path, capsys):
    text = file.read_text()
    cases = {
        "no such measurements file": None,
        "no machine ships under this name": text.replace('"desk"', '"mine"'),
        "of another geometry": text.replace('# nominal = "', '# nominal = "0'),
        "wrong column names": text.replace("leg1_mm", "leg_1"),
        "poses tell": "\n".join(text.splitlines()[:-20]),
    }
    for message, changed in cases.items():
        bad = tmp_path / "bad.csv"
        bad.unlink(missing_ok=True)
        if changed is not None:
            bad.write_text(changed)
        assert run(["calibrate", "fit", str(bad)]) == 2
        said = capsys.readouterr()
        assert said.out == ""
        assert message in said.err
        assert said.err.count("\n") == 1
        assert not (tmp_path / "calibration.toml").exists()


def test_drift_compares_two_files(file, tmp_path, capsys):
    other = write_measurements(measured("pose", 24, 2, given=False), tmp_path / "n.csv")
    for name, one in (("a", file), ("b", other)):
        assert run(["calibrate", "fit", str(one), "-o", str(tmp_path / f"{name}.toml"), "-q"]) == 0
    both = [str(tmp_path / "a.toml"), str(tmp_path / "b.toml")]
    assert run(["machine", "drift", *both]) == 0
    assert "something has moved" in capsys.readouterr().out
    assert run(["machine", "drift", *both, "--within", "0.1", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["tip_largest_mm"] > 0.1
    assert run(["machine", "drift", both[0], str(tmp_path / "none.toml")]) == 2
    assert "none.toml" in capsys.readouterr().err


def test_measurements_that_were_filled_in_are_not_written_over(file, tmp_path, capsys):
    """The empty list of the command may be; what an instrument saw, or touches, cannot be had again."""
    kept = file.rename(tmp_path / "measurements.csv").read_bytes()
    assert run(["calibrate", "plan", "desk", "-n", "7", "-o", str(tmp_path)]) == 2
    assert "measurements.csv: holds measurements, which would be lost; choose another" in capsys.readouterr().err
    assert (tmp_path / "measurements.csv").read_bytes() == kept
    write_measurements(measured("pose", 24, 1, given=False), tmp_path / "measurements.csv", empty=True)
    assert run(["calibrate", "plan", "desk", "-n", "7", "-o", str(tmp_path), "-q"]) == 0
    head = "# probe_length_mm = 198\nleg1_mm,leg2_mm,leg3_mm,leg4_mm,leg5_mm\n"
    (tmp_path / "touches.csv").write_text(head + "600,600,600,600,600\n")
    assert run(["register", "plan", str(tmp_path), "-o", str(tmp_path)]) == 2
    assert "touches.csv: holds touches, which would be lost" in capsys.readouterr().err
    (tmp_path / "touches.csv").write_text(head)
    assert run(["register", "plan", str(tmp_path), "-o", str(tmp_path)]) == 2  # another error: no run is here
    assert "touches" not in capsys.readouterr().err
