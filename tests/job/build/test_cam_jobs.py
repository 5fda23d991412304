"""Jobs that take their toolpath from a file of a CAM system: keys of the machine, and errors as a list."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from pentapod.base.errors import JobError
from pentapod.cli.main import run as run_cli
from pentapod.job import Job, run
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_mesh
from pentapod.toolpath import write_stl

CAM = Path(__file__).parents[2] / "toolpath" / "formats" / "cam"
STRATEGY = "stepover_mm = 15\nspacing_mm = 4"


def cam_job(make_job, folder, name, *more, keys=""):
    """A job whose toolpath is a file of the corpus."""
    shutil.copy(CAM / name, folder / name)
    return make_job((STRATEGY, f'strategy = "file"\nfile = "{name}"\n{keys}'), *more)


def test_machine_and_tolerance_of_the_job_are_used(make_job, tmp_path):
    keys = 'rotary_axes = ["table C", "table A"]\nrotary_centre_mm = [12, -7, -55]'
    job = Job.load(cam_job(make_job, tmp_path, "table_table_no_tcp.nc", keys=keys))
    path, report = job_toolpath(job, job_mesh(job))
    at_40 = np.linalg.norm(path.tips, axis=1) < 0.0401
    assert at_40.sum() > 50
    np.testing.assert_allclose(path.axes[at_40], path.tips[at_40] / 0.04, atol=2e-3)
    assert "note: moves to the home position are left out" in str(report)
    assert "note: spindle, coolant and tool are kept as words: T7, M6, S8000" in str(report)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('rotary_axes = ["table C", "stool A"]', r"toolpath\.rotary_axes: unknown rotary axis"),
        ("pivot_mm = 100", r"toolpath\.pivot_mm: pivot_mm without rotary_axes"),
        ("rotary_centre_mm = [0, 0, 0]", r"toolpath\.rotary_centre_mm: rotary_centre_mm without rotary_axes"),
        ('unit = "foot"', r"toolpath\.unit: wrong value"),
    ],
)
def test_wrong_keys_are_named(make_job, tmp_path, keys, message):
    with pytest.raises(JobError, match=message):
        Job.load(cam_job(make_job, tmp_path, "router.gcode", keys=keys))


def test_all_problems_of_a_file_are_listed(make_job, tmp_path, capsys):
    job = cam_job(make_job, tmp_path, "refused_compensation.nc")
    assert run_cli(["toolpath", str(job), "-o", str(tmp_path / "a.csv"), "-q"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(": ")[2] for line in lines] == ["G41", "G84", "M98"]
    assert all(line.startswith("error: ") for line in lines)


def ball_cap(radius=40.0, most=55.0, rings=40, around=120):
    """Facets (N, 3, 3), mm, of a ball's cap."""
    polar, turn = np.meshgrid(np.radians(np.linspace(0.0, most, rings)), np.linspace(0, 2 * np.pi, around + 1))
    grid = radius * np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    first, second = np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)
    return np.concatenate([first.reshape(-1, 3, 3), second[:, 1:].reshape(-1, 3, 3)])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fusion_ac_table.nc", "sinumerik_fusion_bc.mpf", "ball_three_axes.nc"])
def test_files_of_cam_systems_go_through_the_whole_of_plan(tmp_path, name):
    """Its blocks are 10 degrees apart: 0.06 mm within the ball."""
    (tmp_path / "ball.stl").write_bytes(write_stl(ball_cap(), "ball"))
    shutil.copy(CAM / name, tmp_path / name)
    (tmp_path / "job.toml").write_text(f"""
[part]
mesh = "ball.stl"
unit = "mm"
[machine]
name = "desk"
[tool]
type = "ball"
diameter_mm = 6
[toolpath]
strategy = "file"
file = "{name}"
[axis]
tilt_deg = 15
[feed]
cut_mm_min = 1500
[tolerance]
chordal_mm = 0.1
path_mm = 0.02
axis_deg = 0.5
[placement]
mode = "free"
""")
    outcome = run(Job.load(tmp_path / "job.toml"), tmp_path / "out")
    assert outcome.passed
