"""Programs posted from the park pose and back, and restarts in the middle: joined rows, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from linuxcnc_runs import play, real
from pentapod.base.errors import InputError, ProgramError
from pentapod.base.refusal import Refusal
from pentapod.cli.main import run
from pentapod.geometry.interpolant import Interpolant
from pentapod.job.build.values import job_machine
from pentapod.job.restart import restart as middle
from pentapod.job.restart.restart import restart
from pentapod.job.ways.ways import park_row
from pentapod.machine import Machine
from pentapod.machine.parts import Park
from pentapod.program import read_csv, write_csv
from pentapod.program.joined import REST_ROWS, joined
from pentapod.toolpath.formats import read_toolpath
from short_motion import motion

HAIR = 1e-10
"""Metres."""


def posted(*words, code=0):
    assert run(["post", *map(str, words)]) == code


def within_limits(program, machine):
    """The largest shares of the legs' limits that a controller's spline through the rows takes."""
    rows, limits = Interpolant.through(program.legs, program.period, "cubic"), machine.legs
    return [
        float((rows.rates / limits.max_velocity).max()),
        float((rows.accelerations / limits.max_acceleration).max()),
    ]


def test_a_post_begins_and_ends_at_the_park_pose(parked, tmp_path):
    job, out = parked
    posted(out / "program.csv", "--to", "csv", "-o", tmp_path, "--quiet")
    machine, program, whole = job_machine(job), read_csv(out / "program.csv"), read_csv(tmp_path / "program.csv")
    assert np.abs(whole.legs[[0, -1]] - park_row(machine)).max() < HAIR
    start = len(read_csv(out / "way_in.csv").legs) - 1 + REST_ROWS
    assert whole.legs[start : start + len(program.legs)].tobytes() == program.legs.tobytes()
    assert max(within_limits(whole, machine)) <= 1.001
    assert np.abs(np.diff(whole.legs, axis=0)).max() <= 1.001 * machine.legs.max_velocity.max() * whole.period


def test_a_post_without_ways_is_the_program_alone(parked, tmp_path):
    _, out = parked
    posted(out / "program.csv", "--to", "csv", "-o", tmp_path, "--no-ways", "--quiet")
    assert (tmp_path / "program.csv").read_bytes() == (out / "program.csv").read_bytes()


def test_ways_that_were_not_judged_are_not_posted(copied, tmp_path, capsys):
    _, out = copied
    (out / "way_in.csv").write_bytes((out / "way_out.csv").read_bytes())
    posted(out / "program.csv", "--to", "csv", "-o", tmp_path / "post", "--quiet", code=2)
    assert "this is not the way in that the verdict judged" in capsys.readouterr().err
    (out / "way_in.csv").unlink()
    posted(out / "program.csv", "--to", "csv", "-o", tmp_path / "post", "--quiet", code=2)
    said = capsys.readouterr().err
    assert "the way in is missing" in said
    assert "--no-ways" in said
    assert not (tmp_path / "post").exists()


def test_programs_that_do_not_meet_are_not_joined():
    program, _ = motion(duration=0.2)
    with pytest.raises(ProgramError, match="do not meet"):
        joined(program, program)


@pytest.mark.parametrize(("compensation", "tried"), [("", [1.0]), ("gravity", [1.0, 0.97])])
def test_a_restart_of_a_compensated_program_is_tried_with_gentler_legs(parked, monkeypatch, compensation, tried):
    """The run may have been mended so: drives are told more than the legs' own motion."""
    job, out = parked
    whole, shares = read_csv(out / "program.csv"), []
    source = replace(whole.provenance, compensation=compensation)
    monkeypatch.setattr(middle, "read_csv", lambda _: replace(whole, provenance=source))

    def planned(task, *_):
        shares.append(task.gentler)
        return Refusal("restart", "a leg is too fast")

    monkeypatch.setattr(middle, "_planned", planned)
    assert isinstance(restart(job, out / "program.csv", 3.2), Refusal)
    assert shares == tried


def test_a_restart_makes_what_is_left_with_the_same_tool(parked, tmp_path, capsys):
    job, out = parked
    posted(out / "program.csv", "--to", "csv", "-o", tmp_path, "--from", "3.2s", "--quiet")
    assert "it begins where the program was at 3.1" in capsys.readouterr().err
    machine, left, whole = job_machine(job), read_csv(tmp_path / "program.csv"), read_csv(out / "program.csv")
    assert np.abs(left.legs[[0, -1]] - park_row(machine)).max() < HAIR
    assert max(within_limits(left, machine)) <= 1.001
    assert left.placement == whole.placement
    found = restart(job, out / "program.csv", 3.2)
    assert not isinstance(found, Refusal)
    assert found.verdict.passed
    assert {"way in", "way out"} <= {each.claim for each in found.verdict.certificates}
    toolpath = read_toolpath(out / "plan.npz", "npz")
    position, direction = machine.robot.pose(left.legs, left.component)
    tips = left.placement.inverse().apply(position + machine.tool_length * direction)
    rest = toolpath.tips[found.waypoint :]
    apart = np.array([np.linalg.norm(tips - tip, axis=1).min() for tip in rest])
    assert apart.max() < 0.1e-3  # a row is up to 0.05 mm from the next, and corners are blended by as much
    old = machine.robot.pose(whole.legs[round(found.begins / whole.period)][None], whole.component)
    stands = whole.placement.inverse().apply(old[0][0] + machine.tool_length * old[1][0])
    assert np.linalg.norm(stands - rest[0]) < 0.2e-3
    assert found.begins <= 3.2


def test_restarts_that_cannot_be_are_told(copied):
    job, out = copied
    for seconds in (0.0, -1.0, 99.0, np.nan):
        with pytest.raises(InputError, match="no such time"):
            restart(job, out / "program.csv", seconds)
    with pytest.raises(InputError, match="the program of a run"):
        restart(job, out / "way_in.csv", 1.0)
    (out / "program.csv").unlink()
    with pytest.raises(InputError):
        restart(job, out / "program.csv", 1.0)


def test_a_restart_without_a_clear_way_in_is_refused(parked, tmp_path, capsys, monkeypatch):
    job, out = parked
    machine = job_machine(job)
    words = (out / "program.csv", "--to", "csv", "-o", tmp_path / "post", "--from", "3.2", "--quiet")
    in_the_part = replace(machine, park=Park(np.array([0.085, -0.017, 0.48])))
    monkeypatch.setattr(middle, "job_machine", lambda _: in_the_part)
    posted(*words, code=1)
    assert "refused: way in: the park pose is not within the limits" in capsys.readouterr().err
    posted(*words[:7], "--json", code=1)
    assert json.loads(capsys.readouterr().out)["refusal"].startswith("way in: the park pose")
    monkeypatch.setattr(middle, "job_machine", lambda _: replace(machine, park=Park()))
    posted(*words, code=2)
    assert "park.tip_mm" in capsys.readouterr().err
    for option in ("--no-ways", "--unverified", "--machine=desk"):
        posted(*words, option, code=2)
        assert f"{option.split('=')[0]} does not go with it" in capsys.readouterr().err
    posted(*words[:5], "--from", "soon", code=2)
    assert "not a time" in capsys.readouterr().err
    assert not (tmp_path / "post").exists()


@pytest.mark.slow  # in the fast lane: a post begins and ends there
@real
def test_linuxcnc_starts_at_the_park_pose_and_does_not_jump(parked, tmp_path):
    """After homing, which tells LinuxCNC where the joints stand, no joint jumps."""
    job, out = parked
    posted(out / "program.csv", "--to", "linuxcnc", "-o", tmp_path, "--quiet")
    machine = job_machine(job)
    table = play(Path(tmp_path) / "trivkins")
    joints = table[table[:, 0] > 1.0][:, :5]  # homing comes before
    assert np.abs(joints[[0, -1]] - 1e3 * park_row(machine)).max() < 1e-3
    fastest = 1e3 * machine.legs.max_velocity.max() * machine.controller.period
    assert np.abs(np.diff(joints, axis=0)).max() < 1.05 * fastest


def test_forgotten_files_do_not_matter_without_a_park_pose(tmp_path):
    assert Machine.load("desk").park.pose is None
    program, machine = motion(duration=0.2)
    write_csv(program, tmp_path / "program.csv")
    posted(
        tmp_path / "program.csv", "--to", "csv", "-o", tmp_path / "post", "--machine", "desk", "--unverified", "--quiet"
    )
    assert read_csv(tmp_path / "post" / "program.csv").legs.tobytes() == program.legs.tobytes()
    assert machine.name == "desk"
