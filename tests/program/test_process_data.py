"""Spindle, coolant, tool and laser in a program: in its file, and in the files of every post."""

from dataclasses import replace
from hashlib import sha256

import numpy as np
import pytest

from pentapod.base.errors import ProgramError
from pentapod.program import Switch, read_csv, write_csv
from pentapod.program.csv import csv_bytes
from pentapod.program.posts import find_post, post_names, read_post, write_post
from pentapod.program.posts.linuxcnc.trivkins import gcode, knots, words_at
from pentapod.program.posts.registry import LASER_POWER
from pentapod.program.program import Program
from short_motion import given, motion

SWITCHES = (Switch(0, ("T12", "M6", "S12000", "M3")), Switch(400, ("M8",)), Switch(1200, ("M9", "M5")))


@pytest.fixture
def program():
    plain, _ = motion()
    power = np.zeros(len(plain.legs))
    power[300:600], power[600:900] = 0.25, 1 / 3
    return replace(plain, switches=SWITCHES, laser_power=np.round(power, 6))


def test_a_file_gives_switches_and_power_back_and_says_so_in_its_header(tmp_path, program):
    file = write_csv(program, tmp_path / "program.csv")
    text = file.read_text()
    assert '# switches = [[0, "T12", "M6", "S12000", "M3"], [400, "M8"], [1200, "M9", "M5"]]\n' in text
    assert "# laser_power = true\n" in text
    assert "leg5_mm,laser_power\n" in text
    assert read_csv(file) == program


def test_a_program_that_says_nothing_has_no_such_lines(tmp_path, program):
    text = write_csv(replace(program, switches=(), laser_power=None), tmp_path / "program.csv").read_text()
    assert "switches" not in text
    assert "laser" not in text


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ('[400, "M8"]', '[1201, "M8"]', "switches"),
        ('[400, "M8"]', '[0, "M8"]', "switches"),
        ('[400, "M8"]', "[400, 8]", "switches"),
        ("# laser_power = true", "# laser_power = 1", "laser_power"),
        ("# laser_power = true\n", "", "wrong column names"),
        (",0.250000\n", ",1.250000\n", "not a share of the laser's full power"),
    ],
)
def test_bad_process_data_in_a_file_are_refused(tmp_path, program, old, new, what):
    file = write_csv(program, tmp_path / "program.csv")
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(ProgramError, match=what):
        read_csv(file)


@pytest.mark.parametrize("name", [name for name in post_names() if not find_post(name).takes_toolpath])
def test_every_post_gives_switches_back_and_the_power_where_it_says_that_it_can(tmp_path, program, name):
    if name == "hdf5":
        pytest.importorskip("h5py")
    files = write_post(
        replace(given(), program=program), name, tmp_path, unverified=name != "cam", **verdict(name, program)
    )
    assert files
    found = read_post(tmp_path, name)
    assert isinstance(found, Program)
    assert found.switches == SWITCHES
    if LASER_POWER in find_post(name).loses:
        assert found.laser_power is None
    else:
        np.testing.assert_array_equal(found.laser_power, program.laser_power)


def verdict(name, program):
    """A passed verdict for the format that has no comments."""
    if name != "cam":
        return {}
    return {"verdict": {"passed": True, "sha256": {"program": sha256(csv_bytes(program)).hexdigest()}}}


def test_linuxcnc_gets_words_power_and_the_tool_in_its_table(tmp_path, program):
    write_post(replace(given(), program=program), "linuxcnc", tmp_path, unverified=True)
    code = (tmp_path / "trivkins" / "program.ngc").read_text().splitlines()
    first = next(k for k, line in enumerate(code) if line.startswith("G1"))
    assert code[first - 4 : first] == ["T12", "M6", "S12000", "M3"]
    assert code[-5:] == ["M9", "M5", "M67 E0 Q0", "G94", "M2"]
    assert "T12 P2 Z0 D0 ;" in (tmp_path / "trivkins" / "tool.tbl").read_text()
    hal = (tmp_path / "stream" / "stream.hal").read_text()
    assert "loadrt streamer depth=16000 cfg=ffffff\n" in hal
    assert "net laser-power streamer.0.pin.5\n" in hal
    moves, power = 0, []
    for line in code:
        moves += line.startswith("G1")
        power += [(moves, line)] if line.startswith("M67") else []
    assert power[:3] == [(1, "M67 E0 Q0"), (31, "M67 E0 Q0.25"), (61, "M67 E0 Q0.333333")]


def test_a_switch_comes_before_the_move_in_which_it_happens(program):
    times = knots(program)
    said = words_at(program, times)
    assert said[0] == ["T12", "M6", "S12000", "M3"]
    assert "M8" in said[41]  # the move from 0.4 s to 0.41 s
    assert gcode(np.ones((2, 5)), 0.01) == gcode(np.ones((2, 5)), 0.01, {})
