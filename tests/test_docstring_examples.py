"""The examples in the docstrings of public names: each name has one, and it prints what the docstring says."""

from __future__ import annotations

import doctest
import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pentapod
from pentapod import (
    BallCutter,
    Machine,
    PlacementConstraints,
    RasterOptions,
    RigidTransform,
    explain,
    leg_path,
    load_mesh,
    make_toolpath,
    plan,
    retime,
    sample,
    verify,
)
from pentapod.cli.commands.new import dome_stl, job_text

NAMES = [name for name in pentapod.__all__ if name != "__version__"]
PLANS = ("run", "judge", "Outcome")
"""Examples that plan a whole job."""

WITHOUT = ("write_report",)
"""Needs a run, and writes a page."""

FILES = {
    "line.svg": '<svg xmlns="http://www.w3.org/2000/svg" width="10mm" height="10mm" viewBox="0 0 10 10">'
    '<path d="M0 0 L10 0"/></svg>',
    "line.csv": "x_mm,y_mm,z_mm\n0,0,0\n10,0,0\n",
    "sweep.toml": 'job = "job.toml"\n[sweep]\n"axis.tilt_deg" = [8, 15]\n',
}


@pytest.fixture(scope="module")
def values(tmp_path_factory) -> dict[str, Any]:
    """What the examples use without saying so: a folder with files, and the values of each stage."""
    folder = tmp_path_factory.mktemp("examples")
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    (folder / "dot.pgm").write_bytes(b"P5 1 1 255 \x00")
    for name, text in {**FILES, "job.toml": job_text()}.items():
        (folder / name).write_text(text, encoding="utf-8")
    part, tool, machine = load_mesh(folder / "part.stl", "mm"), BallCutter(3e-3), Machine.load("desk")
    toolpath = make_toolpath(part, tool, RasterOptions(stepover=30e-3, spacing=5e-3))
    here = RigidTransform(np.diag([1.0, -1.0, -1.0]), machine.work.centre)
    placed = plan(toolpath, machine, constraints=PlacementConstraints.fixture([here])).unwrap()
    limits = {"path_tolerance": 20e-6, "axis_tolerance": np.radians(0.5)}
    path = leg_path(placed, machine, **limits).unwrap()
    trajectory = retime(path, machine).unwrap()
    story = explain(trajectory, machine)
    program = sample(trajectory, machine, placed)
    verdict = verify(program, machine, toolpath, tilt=0.0, **limits)
    made = {
        name: value for name, value in locals().items() if name not in ("folder", "tmp_path_factory", "name", "text")
    }
    return {
        **{name: getattr(pentapod, name) for name in pentapod.__all__},
        "np": np,
        "Path": Path,
        **made,
        "in": folder,
    }


def examples_of(name: str) -> list[doctest.DocTest]:
    thing = getattr(pentapod, name)
    text = inspect.getdoc(inspect.unwrap(thing)) or ""
    found = doctest.DocTestParser().get_doctest(text, {}, name, None, None)
    return [found] if found.examples else []


def failures(names: list[str], values: dict[str, Any]) -> list[str]:
    found: list[str] = []
    runner = doctest.DocTestRunner(verbose=False)
    globs = dict(values)
    for name in names:
        for test in examples_of(name):
            test.globs = {**values, **{key: globs[key] for key in ("outcome", "played") if key in globs}}
            runner.run(test, out=found.append, clear_globs=False)
            globs.update(test.globs)
    return found


def test_each_public_name_has_an_example():
    assert [name for name in NAMES if not examples_of(name)] == list(WITHOUT)


def test_examples_print_what_they_say(values, monkeypatch):
    monkeypatch.chdir(values["in"])
    assert not failures([name for name in NAMES if name not in PLANS], values)


@pytest.mark.slow
def test_examples_that_plan_print_what_they_say(values, monkeypatch):
    monkeypatch.chdir(values["in"])
    assert not failures(list(PLANS), values)
