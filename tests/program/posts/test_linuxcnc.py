"""The folder for LinuxCNC, played by the LinuxCNC that is installed: HAL, interpreter, planner and kinematics module.

Needs the Debian package linuxcnc-uspace and the right to a network of its own (`unshare`); skipped without.
"""

from __future__ import annotations

import configparser
import dataclasses
import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from linuxcnc_runs import built, play, real
from pentapod.base.errors import InputError, ProgramError
from pentapod.geometry.rigid import RigidTransform
from pentapod.program import Program
from pentapod.program.posts import PostInput, write_post
from pentapod.program.posts.linuxcnc.trivkins import read_gcode
from pentapod.program.posts.motion import lengths_at
from short_motion import given, motion, post

MM = 1e3
AT_THE_LIMIT_S = 0.842
"""So short the motion needs 98 % of the accelerations that the legs have; 0.76 s takes 120 %."""


def ini_of(file: Path) -> configparser.ConfigParser:
    ini = configparser.ConfigParser(strict=False, interpolation=None)
    ini.optionxform = str
    ini.read(file)
    return ini


def streamed(tmp_path, code=0, **changes):
    what = given(**changes)
    post(what, "linuxcnc", tmp_path)
    table = play(tmp_path / "stream", code)
    said = (tmp_path / "stream" / "test.log").read_text()
    changed = float(re.search(r"the limits changed the lengths by at most (\S+) mm", said)[1])
    assert changed == pytest.approx(np.abs(table[:, :5] - table[:, 5:]).max(), rel=1e-5)
    return MM * what.program.legs, table[:, :5], table[:, 5:]


@real
def test_hal_plays_every_setpoint_and_the_limits_change_nothing(tmp_path):
    plan, before, after = streamed(tmp_path, duration=AT_THE_LIMIT_S)
    assert np.abs(np.diff(plan, 2, axis=0)).max() / 1e-6 > 0.97 * 5000.0
    assert np.array_equal(before, after)
    first = int(np.flatnonzero(np.abs(np.diff(before, axis=0)).max(axis=1) > 0.0)[0])
    # halsampler prints six decimals; the first rows of the plan, at rest, look alike.
    played = min(
        np.abs(after[start : start + len(plan)] - plan).max() for start in range(max(0, first - 100), first + 2)
    )
    assert played < 1e-6
    assert np.abs(after[-1] - plan[-1]).max() < 1e-6


@real
def test_hal_clips_a_program_beyond_the_limits(tmp_path):
    plan, before, after = streamed(tmp_path, code=1, duration=0.76)
    assert "FAILED: limit3 clipped the program" in (tmp_path / "stream" / "test.log").read_text()
    assert np.abs(np.diff(plan, 2, axis=0)).max() / 1e-6 == pytest.approx(1.2 * 5000.0, rel=0.01)
    assert np.abs(before[-1] - plan[-1]).max() < 1e-6
    assert np.abs(before - after).max() > 0.5


@pytest.mark.slow
@real
def test_the_legs_as_axes_keep_path_and_time(tmp_path):
    what = given(duration=3.0)
    post(what, "linuxcnc", tmp_path)
    table = play(tmp_path / "trivkins")
    joints = table[table[:, 0] > 1.0]  # homing comes before
    moving = np.flatnonzero(joints[:, 5] > 0)
    assert abs(len(moving) * what.program.period - what.program.duration) < 0.005 * what.program.duration
    said = (tmp_path / "trivkins" / "test.log").read_text()
    told = float(re.search(r"the legs moved for (\S+) s", said)[1])
    assert told == pytest.approx(len(moving) * what.program.period, abs=1e-9)
    check_accelerations(joints[moving[0] : moving[-1] + 1, :5], what, tmp_path, said)
    curve = MM * lengths_at(what.program, np.linspace(0.0, what.program.duration, 150_001))
    away, _ = cKDTree(curve).query(joints[moving[0] : moving[-1] + 1, :5])
    assert away.max() < 0.02
    assert np.abs(joints[-1, :5] - curve[-1]).max() < 1e-6


def check_accelerations(legs, what, folder, said):
    """More than the legs have, for a program that needs a tenth; less than is said; and play.sh says how much."""
    commanded = np.abs(np.diff(legs, 2, axis=0)).max() / what.program.period**2
    needed = MM * np.abs(np.diff(what.program.legs, 2, axis=0)).max() / what.program.period**2
    limit = MM * what.machine.legs.max_acceleration.min()
    text = re.sub(r"\s+", " ", (folder / "README.md").read_text(encoding="utf-8"))
    told = re.search(
        r"its accelerations are not.*?(\d+) mm/s² here, where the legs of the machine have (\d+) mm/s²", text
    )
    assert float(told[2]) == pytest.approx(limit)
    ini = ini_of(folder / "trivkins" / "pentapod.ini")
    allowed = [float(ini[f"JOINT_{k}"]["MAX_ACCELERATION"]) for k in range(5)]
    assert float(told[1]) == pytest.approx(max(allowed), abs=1.0)
    assert needed < 0.1 * limit < limit < commanded <= float(told[1])
    measured = float(re.search(r"largest acceleration that was commanded: (\d+) mm/s²", said)[1])
    assert measured == pytest.approx(commanded, abs=1.0)


def unverified(folder):
    write_post(given(duration=1.0), "linuxcnc", folder, unverified=True)
    files = [file for file in folder.rglob("*") if file.is_file()]
    assert all("UNVERIFIED" in "".join(file.read_text().splitlines()[:2]) for file in files)


def test_an_unverified_folder_has_its_mark_in_every_file(tmp_path):
    unverified(tmp_path)


@pytest.mark.slow
@built
def test_an_unverified_folder_runs_with_its_mark_in_every_file(tmp_path):
    unverified(tmp_path)
    for part in ("stream", "player", "trivkins", "kinematics"):
        table = play(tmp_path / part)
        assert len(table) > 300


@pytest.mark.slow
@real
def test_what_linuxcnc_refuses_is_said(tmp_path):
    post(given(duration=0.5), "linuxcnc", tmp_path)
    program = tmp_path / "trivkins" / "program.ngc"
    program.write_text(program.read_text().replace("\nG64\n", "\nG64 Q\n"))
    with pytest.raises(AssertionError, match=r"FAILED: .*No characters found"):
        play(tmp_path / "trivkins")


@built
def test_kinematics_module_leads_the_tool_along_the_toolpath(tmp_path):
    what = given(duration=1.0)
    post(what, "linuxcnc", tmp_path)
    table = play(tmp_path / "kinematics")
    joints = table[table[:, 0] > 1.0]
    moving = np.flatnonzero(joints[:, 5] > 0)
    legs = joints[moving[0] :, :5] / MM
    machine = what.machine
    p, i = machine.robot.pose(legs, what.program.component)
    tips, axes = p + machine.tool_length * i, -i
    # As far as six decimals of halsampler go.
    assert np.abs(tips[-1] - what.toolpath.tips[-1]).max() < 5e-9
    assert np.abs(axes[-1] - what.toolpath.axes[-1]).max() < 2e-8
    # From the first waypoint on: before it LinuxCNC comes from machine zero.
    start = int(np.linalg.norm(tips - what.toolpath.tips[0], axis=1).argmin())
    s = np.linspace(0.0, 40.0, 40_001)
    dense = np.column_stack([np.interp(s, np.arange(41), column) for column in what.toolpath.tips.T])
    away, _ = cKDTree(dense).query(tips[start:])
    # G64 P0.01: so much for merging blocks, and as much again for blending them.
    assert away.max() < 0.02e-3


@real
def test_the_interpreter_takes_all_g_code(tmp_path):
    what = given(duration=1.0)
    post(what, "linuxcnc", tmp_path)
    run = subprocess.run(
        ["rs274", "-g", str(tmp_path / "kinematics/toolpath.ngc")],
        cwd=tmp_path, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert run.stdout.count("STRAIGHT_FEED") == 30
    assert run.stdout.count("STRAIGHT_TRAVERSE") == 11
    # rs274 by itself has no U and V; the interpreter's own module has.
    moves = interpreted(tmp_path / "trivkins/program.ngc", tmp_path)
    plan = MM * lengths_at(what.program, np.linspace(0.0, 1.0, len(moves)))
    assert len(moves) == 101
    # In inches inside.
    assert np.abs(25.4 * moves[:, [0, 1, 2, 6, 7]] - plan).max() < 1e-8


INTERPRETER = """
import gcode, json, sys

class Canon:
    parameter_file = sys.argv[2]
    def __init__(self): self.moves = []
    def straight_feed(self, *p): self.moves.append(p)
    def check_abort(self): return 0
    def get_tool(self, n): return (-1,) + (0.0,) * 12 + (0,)
    def get_external_angular_units(self): return 1.0
    def get_external_length_units(self): return 1.0
    def get_axis_mask(self): return 0x1ff
    def get_block_delete(self): return 0
    def __getattr__(self, name):
        if name.startswith("_"): raise AttributeError(name)
        return lambda *a, **k: None

canon = Canon()
code, line = gcode.parse(sys.argv[1], canon, "", "")
assert code <= gcode.MIN_ERROR, (line, gcode.strerror(code))
json.dump(canon.moves, sys.stdout)
"""


def interpreted(file, folder):
    """What LinuxCNC's interpreter makes of G-code: the feed moves, all nine axes."""
    (folder / "parameters").write_text("")
    run = subprocess.run(
        ["/usr/bin/python3", "-E", "-c", INTERPRETER, str(file), str(folder / "parameters")],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    return np.array(json.loads(run.stdout[run.stdout.index("[[") :]))


def test_g_code_of_the_legs_reads_back(tmp_path):
    what = given(duration=0.505)
    post(what, "linuxcnc", tmp_path)
    times, legs = read_gcode(tmp_path / "trivkins/program.ngc")
    assert len(times) == 51
    assert times[-1] == pytest.approx(0.505, abs=1e-9)
    assert np.abs(legs - lengths_at(what.program, times)).max() < 1e-11
    file = tmp_path / "trivkins/program.ngc"
    text = file.read_text()
    for broken, words in ((text[:-3], "M2"), (text.replace(" U", " W", 1), "all legs"), ("M2\n", "no moves")):
        file.write_text(broken)
        with pytest.raises(ProgramError, match=words):
            read_gcode(file)


@pytest.mark.parametrize("period_ms", [0.5, 1.0, 4.0])
def test_the_planner_has_the_headroom_that_it_needs(period_ms, tmp_path):
    program, machine = motion(0.6)
    controller = dataclasses.replace(machine.controller, period=1e-3 * period_ms)
    machine = dataclasses.replace(machine, controller=controller)
    source = dataclasses.replace(program.provenance, machine_digest=machine.digest)
    legs = lengths_at(program, np.arange(0.0, 0.6 + 1e-9, 1e-3 * period_ms))
    again = Program(1e-3 * period_ms, legs, "cubic", program.component, program.placement, source)
    post(PostInput(again, machine), "linuxcnc", tmp_path)
    assert b"no toolpath was given" in (tmp_path / "kinematics/toolpath.ngc").read_bytes()
    ini = ini_of(tmp_path / "trivkins/pentapod.ini")
    feed = float(re.search(r"F([0-9.]+)", (tmp_path / "trivkins/program.ngc").read_text())[1])
    dt = 60.0 / feed
    assert dt >= 10e-3 * max(1.0, period_ms) * (1 - 1e-9)
    assert int(ini["EMCMOT"]["SERVO_PERIOD"]) == round(1e6 * period_ms)
    for k, letter in enumerate("XYZUV"):
        axis, joint = ini[f"AXIS_{letter}"], ini[f"JOINT_{k}"]
        assert float(axis["MAX_ACCELERATION"]) >= 2.0 * float(axis["MAX_VELOCITY"]) / dt
        assert float(joint["MAX_ACCELERATION"]) >= float(axis["MAX_ACCELERATION"])
        assert float(joint["MIN_LIMIT"]) <= float(axis["MIN_LIMIT"]) < float(axis["MAX_LIMIT"])
        assert float(axis["MAX_LIMIT"]) <= float(joint["MAX_LIMIT"])


def test_axes_of_the_kinematics_module_reach_all_that_the_strokes_allow(tmp_path):
    what = given(duration=0.2)
    post(what, "linuxcnc", tmp_path)
    ini, machine = ini_of(tmp_path / "kinematics/pentapod.ini"), what.machine
    assert ini["KINS"]["KINEMATICS"] == "pentapod_kins"
    rng = np.random.default_rng(0)
    tips = machine.work.centre + rng.uniform(-0.6, 0.6, (20_000, 3))
    axes = rng.normal(size=tips.shape) - [0.0, 0.0, 2.0]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    legs = machine.robot.leg_lengths(tips + machine.tool_length * axes, -axes)
    reached = ((legs > machine.legs.min_length) & (legs < machine.legs.max_length)).all(axis=1)
    there = MM * (tips[reached] - machine.work.centre) * [1.0, -1.0, -1.0]
    assert reached.sum() > 300
    for k, letter in enumerate("XYZ"):
        limits = ini[f"AXIS_{letter}"]
        assert float(limits["MIN_LIMIT"]) <= there[:, k].min() < there[:, k].max() <= float(limits["MAX_LIMIT"])
    home = machine.work.centre - [0.0, 0.0, machine.tool_length]
    homes = [float(ini[f"JOINT_{k}"]["HOME"]) for k in range(5)]
    assert np.abs(MM * machine.robot.leg_lengths(home, np.array([0.0, 0.0, 1.0])) - homes).max() < 1e-9


def test_readme_says_where_the_module_would_refuse_the_toolpath(tmp_path):
    what = given(duration=0.2)
    post(what, "linuxcnc", tmp_path / "far")
    assert "refuses blocks" not in (tmp_path / "far/README.md").read_text(encoding="utf-8")
    down = RigidTransform(np.eye(3), np.array([0.0, 0.0, -0.265]))  # towards the base, and S = 0
    post(dataclasses.replace(what, toolpath=what.toolpath.transformed(down)), "linuxcnc", tmp_path / "near")
    told = (tmp_path / "near/README.md").read_text(encoding="utf-8")
    assert re.search(r"refuses blocks .* until you lower `pentapod\.least\.surface` \(it has [0-9.]+, 20 is", told)


def test_the_machine_must_be_the_programs(tmp_path):
    program, machine = motion(0.2)
    with pytest.raises(InputError, match="needs the machine"):
        post(PostInput(program), "linuxcnc", tmp_path)
    with pytest.raises(InputError, match="not the machine"):
        post(PostInput(program, machine.with_tool(0.25)), "linuxcnc", tmp_path)
    assert not list(tmp_path.iterdir())
