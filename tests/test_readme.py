"""What the README shows works."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from pentapod.cli.verbs import VERBS
from pentapod.job import Job

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", README, re.S)
    assert found is not None
    return found[1]


def test_readme_job_loads(tmp_path):
    (tmp_path / "dome.stl").write_bytes((ROOT / "toolpaths" / "dome.stl").read_bytes())
    (tmp_path / "job.toml").write_text(block("toml"), encoding="utf-8")
    assert Job.load(tmp_path / "job.toml").tool.diameter_mm == 6


def changed(code: str, *changes: tuple[str, str]) -> str:
    for old, new in changes:
        assert old in code
        code = code.replace(old, new)
    return code


def test_readme_python_runs(tmp_path, monkeypatch, make_job):
    """With a job that is planned sooner."""
    code = changed(block("python"), ('"toolpaths/dome.toml"', repr(str(make_job()))))
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(compile(code, "README.md", "exec"), names)
    assert names["outcome"].passed
    assert names["job"].feed.cut_mm_min == 1200
    assert (tmp_path / "out" / "program.csv").is_file()


@pytest.mark.slow  # in the fast lane: the same chain in test_public_names.py
def test_stage_by_stage_runs(tmp_path, monkeypatch):
    """The last block of the page on scripts."""
    page = (ROOT / "docs" / "howto" / "script.md").read_text(encoding="utf-8")
    code = changed(
        re.findall(r"```python\n(.*?)```", page, re.S)[-1],
        ('"toolpaths/dome.stl"', repr(str(ROOT / "toolpaths" / "dome.stl"))),
        ("stepover=3e-3", "stepover=25e-3"),  # the same, sooner
        ('limits["path_tolerance"])\n', 'limits["path_tolerance"], share=1.0)\n'),  # passes that far apart cover little
    )
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(compile(code, "script.md", "exec"), names)
    assert names["verdict"].passed, [c for c in names["verdict"].certificates if not c.passed]
    assert (tmp_path / "program.csv").is_file()


def test_files_and_verbs_that_are_named_exist():
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / target).exists(), target
    for verb in re.findall(r"(?:`|^)pentapod ([a-z][a-z-]*)", README, re.M):
        assert verb in {*VERBS, "plans"}, verb


def test_read_this_first_is_first_and_short():
    assert README.index("## Read this first") == README.index("\n## ") + 1
    assert len(README.split()) < 700
