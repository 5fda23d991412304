"""Measurement files: what is written is read back; every mistake is one line with file, line, column and remedy."""

import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.machine import read_measurements, write_measurements
from pentapod.machine.identification.measurements_file import measurements_text
from true_machine import measured


@pytest.mark.parametrize("instrument", ["pose", "tracker", "plate", "ballbar", "dock"])
def test_what_is_written_is_read_back(instrument, tmp_path):
    given = measured(instrument, 9, 1, setups=1 if instrument in ("pose", "dock") else 2)
    again = read_measurements(write_measurements(given, tmp_path / "m.csv"))
    assert np.abs(again.legs - given.legs).max() < 1e-9
    assert np.abs(again.seen - given.seen).max() < 1e-8
    assert (again.setups == given.setups).all()
    for name in ("instrument", "frame", "component", "machine", "digest", "target", "leg_sigma", "position_sigma"):
        assert getattr(again, name) == getattr(given, name), name
    assert again.direction_sigma == pytest.approx(given.direction_sigma)
    first = (tmp_path / "m.csv").read_text().splitlines()
    assert first[again.lines[0] - 1].startswith("1,")


def test_poses_that_were_not_measured_are_left_out(tmp_path):
    text = measurements_text(measured("tracker", 6, 1)).splitlines()
    cells = text[-2].split(",")
    text[-2] = ",".join([*cells[:-3], "", "", ""])
    (tmp_path / "m.csv").write_text("\n".join(text))
    assert len(read_measurements(tmp_path / "m.csv")) == 5


def wrong(old: str, new: str):
    def change(text: str) -> str:
        assert old in text
        return text.replace(old, new, 1)

    return change


CASES = [
    (
        wrong("# pentapod_measurements = 1\n", ""),
        r"m\.csv:1: not a measurements file; expected # pentapod",
    ),
    (wrong("measurements = 1", "measurements = 2"), "unknown format version"),
    (wrong('"tracker"', '"traker"'), r'instrument: unknown \(got .traker.\); did you mean "tracker"'),
    (wrong("target_mm", "taget_mm"), r'taget_mm: unknown key; did you mean "target_mm"'),
    (wrong("# position_sigma_mm = 0.01\n", ""), "position_sigma_mm: the key is missing"),
    (wrong("= 0.01", "= ten"), r"m\.csv:\d+: position_sigma_mm: cannot read"),
    (wrong("= 0.01", "= -1"), "position_sigma must not be negative"),
    (wrong("leg2_mm,", "leg2,"), "wrong column names"),
    (wrong('"++"', '"+"'), "component: unknown component|unknown component"),
    (lambda text: text + "7,1,1,2,3\n", r"m\.csv:\d+: wrong number of columns \(got 5\)"),
    (lambda text: text.replace(".", "x", 400).replace("0x", "0."), "m.csv"),
    (lambda text: text[: text.index("pose,")], "wrong column names"),
    (lambda text: text[: text.index("\n", text.index("pose,")) + 1], "no pose was measured"),
    (lambda text: text.rsplit(",", 1)[0] + ",\n", r"z_mm: the cell is empty; fill it in, or leave all"),
    (lambda text: text.rsplit(",", 1)[0] + ",nan\n", r"z_mm: not a finite number \(got 'nan'\)"),
    (lambda text: "", "not a measurements file"),
]


@pytest.mark.parametrize(("change", "message"), CASES)
def test_one_line_for_each_mistake(change, message, tmp_path):
    file = tmp_path / "m.csv"
    file.write_text(change(measurements_text(measured("tracker", 5, 1))))
    with pytest.raises(MachineError, match=message) as caught:
        read_measurements(file)
    assert "\n" not in str(caught.value)


def test_files_that_are_none(tmp_path):
    with pytest.raises(MachineError, match='no such measurements file; "pentapod calibrate plan" writes one'):
        read_measurements(tmp_path / "none.csv")
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MachineError, match="not a text file"):
        read_measurements(tmp_path / "bytes.csv")
