"""CONTRIBUTING: ten recipes, whose files, lists and entry points exist; and the measures of the tree."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pentapod.base import Registry
from pentapod.cutters import CUTTERS
from pentapod.machine.families import FAMILIES
from pentapod.mesh.io.registry import MESH_FORMATS
from pentapod.planning.limits import margins
from pentapod.program.posts import POSTS
from pentapod.timing.limits import limits
from pentapod.toolpath import STRATEGIES

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
RECIPES = re.split(r"^\d+\. ", TEXT[TEXT.index("## Ten recipes") : TEXT.index("## What a change")], flags=re.M)[1:]
TITLES = [
    "post",
    "strategy",
    "cutter",
    "mesh format",
    "limit",
    "claim",
    "robot family",
    "machine file",
    "job key",
    "controller",
]


def test_there_are_ten_recipes_in_their_order():
    titles = [re.match(r"\*\*(?:An? )?([\w ]+)", recipe)[1] for recipe in RECIPES]
    assert titles == TITLES


def test_files_and_lists_that_recipes_name_exist():
    for recipe in RECIPES:
        folder = ROOT / "src" / "pentapod"
        named = re.findall(r"`([\w/]+/|[\w/]*\w+\.py)`", recipe)
        assert named, recipe
        rooms = [ROOT / "src" / "pentapod" / name for name in named if name.endswith("/")]
        for name in named:
            places = [folder / name, ROOT / name, *(room / name for room in rooms)]
            assert any(place.exists() for place in places), name
    source = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "src").rglob("*.py"))
    for name in (
        "_NAMES",
        "STRATEGY",
        "FAMILY",
        "CUTTER",
        "_HOMES",
        "FORMAT",
        "homes",
        "LIMITS",
        "CLAIMS",
        "Interpolation",
    ):
        assert f"`{name}" in TEXT
        assert re.search(rf"^\s*{name}\b.*=", source, re.M), name


def test_entry_points_that_are_named_are_read():
    registries = (POSTS, STRATEGIES, CUTTERS, MESH_FORMATS, FAMILIES, margins.LIMITS, limits.PLUGGED)
    groups = {registry.group for registry in registries if isinstance(registry, Registry)}
    assert set(re.findall(r"`(pentapod\.[a-z_]+)`", TEXT)) == groups
    plugin = (ROOT / "examples" / "plugin" / "pyproject.toml").read_text(encoding="utf-8")
    assert set(re.findall(r'entry-points\."([\w.]+)"', plugin)) | {"pentapod.mesh_formats"} == groups


KEY = """    offset: Annotated[float, Key("deg", "of a probe, for the test", ge=0.0, le=2.0)] = 0.0
"""
USES_THE_KEY = """
import sys
sys.path.insert(0, {docs!r})
from make_reference import pages
from pentapod.base import JobError
from pentapod.cli.commands.new import job_text
from pentapod.job import Job
assert "# offset_deg = 0.0" in job_text() and "# of a probe, for the test" in job_text()
assert "| `offset_deg` | number, ≥ 0, ≤ 2 | `0.0` | of a probe, for the test |" in pages()["job.md"]
assert abs(Job.load({job!r}).tolerance.si.offset - 0.0261799) < 1e-6
try:
    Job.load({job!r}).with_(**{{"tolerance.offset_deg": 3.0}})
except JobError as error:
    print(error)
"""


def test_a_job_key_is_added_by_one_field(tmp_path, make_job):
    """The recipe, done in a copy of the source: one field with a `Key`; the rest follows."""
    shutil.copytree(ROOT / "src", tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    tables = tmp_path / "src" / "pentapod" / "job" / "schema" / "tables.py"
    text = tables.read_text(encoding="utf-8")
    place = text.index("    chordal: ", text.index("class ToleranceKeys"))
    tables.write_text(text[:place] + KEY + text[place:], encoding="utf-8")
    job = make_job(("path_mm = 0.05", "path_mm = 0.05\noffset_deg = 1.5"))
    code = USES_THE_KEY.format(docs=str(ROOT / "docs"), job=str(job))
    environment = {"PYTHONPATH": str(tmp_path / "src")}
    made = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert made.returncode == 0, made.stderr
    assert made.stdout == (
        "tolerance.offset_deg: out of range (got 3.0); expected less than or equal to 2 (of a probe, for the test)\n"
    )


@pytest.mark.slow
def test_the_measures_of_the_tree_are_printed():
    made = subprocess.run(
        [sys.executable, ROOT / "benchmarks" / "structure.py"], capture_output=True, text=True, check=True
    )
    assert re.search(r"^folders above 15 files +0 +0$", made.stdout, re.M)
    assert re.search(r"^lines without theory/ +<= 34,500 +\d\d,\d{3}$", made.stdout, re.M)


def test_architecture_names_every_folder_and_is_two_pages():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 80
    tree = text.split("```")[1]
    source = ROOT / "src" / "pentapod"
    for folder in {path.parent.relative_to(source) for path in source.rglob("*.py")} - {Path()}:
        assert f"{folder.name}/" in tree or folder.parts[0] == "cli" or len(folder.parts) > 2, folder
    for name in re.findall(r"`([\w/]+(?:/|\.py))`", text):
        assert (source / name).exists() or (ROOT / name).exists(), name
    for recipe in TITLES:
        assert f"({recipe})" in tree, recipe
