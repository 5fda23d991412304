"""The example package `examples/plugin`: what it adds by entry points is known and works."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import pentapod
from pentapod import Job, LegPath, PlacedPath, Program, read_post, retime, run, write_post
from pentapod.cli.main import run as command
from pentapod.cutters import CUTTERS
from pentapod.program.posts import POSTS, PostInput
from pentapod.timing import Explanation
from pentapod.toolpath import STRATEGIES
from plugins import install

PLUGIN = Path(__file__).parents[2] / "examples" / "plugin"
CHANGES = (
    ('type = "ball"', 'type = "engraver"\nheight_mm = 12'),
    ("[toolpath]", '[toolpath]\nstrategy = "diagonal"\nturn_deg = 10'),
)


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    """The package as it is when it is installed, for this test."""
    groups = tomllib.loads((PLUGIN / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]
    install(tmp_path / "site", monkeypatch, groups)
    monkeypatch.syspath_prepend(PLUGIN)


@pytest.fixture
def planned(plugin, make_job, tmp_path):
    return run(Job.load(make_job(*CHANGES)), tmp_path / "out")


def test_nothing_of_it_is_known_before_it_is_installed(make_job):
    assert "drives-ms" not in POSTS
    assert "diagonal" not in STRATEGIES
    assert "engraver" not in CUTTERS
    with pytest.raises(pentapod.InputError, match="unknown strategy"):
        Job.load(make_job(*CHANGES[1:]))


def test_a_job_is_planned_with_strategy_cutter_and_limits_of_the_package(planned, tmp_path):
    assert planned.unwrap().passed, planned.verdict.answer
    assert "tool tip in the table" in planned.find(PlacedPath).margin_names
    names = {use.name for use in planned.find(Explanation).uses}
    assert "leg velocity while running in" in names, names
    folder = tmp_path / "post"
    (file,) = write_post(PostInput(planned.find(Program)), "drives-ms", folder, verdict=planned.to_dict())
    assert file.read_text(encoding="utf-8").startswith("% pentapod_program")
    assert (read_post(folder, "drives-ms").legs == planned.find(Program).legs).all()


def test_the_limit_of_the_package_holds_in_the_time_law(planned, monkeypatch):
    path, machine = planned.find(LegPath), planned.machine
    slow = planned.find(Program).duration
    monkeypatch.undo()  # the package is gone
    assert retime(path, machine).unwrap().duration < slow


def test_the_command_line_lists_what_the_package_adds(plugin, capsys):
    assert command(["post", "--formats"]) == 0
    assert "the workshop's drives" in capsys.readouterr().out


@pytest.mark.slow
def test_pip_installs_the_package(tmp_path):
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation", "--target", tmp_path]
    subprocess.run([*pip, PLUGIN], check=True)
    code = "from pentapod.program.posts import find_post; print(find_post('drives-ms').about)"
    path = {"PYTHONPATH": f"{tmp_path}:{Path(pentapod.__file__).parents[1]}"}
    made = subprocess.run([sys.executable, "-c", code], env=path, capture_output=True, text=True, check=True)
    assert made.stdout == "the workshop's drives\n"
