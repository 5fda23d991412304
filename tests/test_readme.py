"""What the README shows works."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

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


def test_readme_python_runs(tmp_path, monkeypatch):
    code = block("python")
    for old, new in (
        ('"toolpaths/dome.stl"', repr(str(ROOT / "toolpaths" / "dome.stl"))),
        ("stepover=3e-3", "stepover=25e-3"),  # the same, sooner
        ('limits["path_tolerance"])\n', 'limits["path_tolerance"], share=1.0)\n'),  # passes that far apart cover little
    ):
        assert old in code
        code = code.replace(old, new)
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(compile(code, "README.md", "exec"), names)
    assert names["verdict"].passed, [c for c in names["verdict"].certificates if not c.passed]
    assert (tmp_path / "program.csv").is_file()


def test_files_and_verbs_that_are_named_exist():
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / target).exists(), target
    for verb in VERBS:
        assert f"`{verb}" in README or f"pentapod {verb}" in README, verb
