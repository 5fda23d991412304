"""House rules that a linter does not know."""

import ast
import re
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest

import pentapod

SOURCE = Path(pentapod.__file__).parent
ROOT = SOURCE.parents[1]
FILES = sorted(SOURCE.rglob("*.py"))
LONGEST = 320
MOST_FILES = 15


def test_one_concept_to_a_file() -> None:
    for path in FILES:
        text, name = path.read_text(encoding="utf-8"), path.relative_to(SOURCE)
        assert len(text.splitlines()) <= LONGEST, f"{name}: two rooms with the wall missing"
        assert not re.search(r"\b(TODO|FIXME|XXX)\b", text), name
        assert not re.search(r"^\s*assert ", text, re.M), f"{name}: inputs are checked by errors, not by assert"


def test_a_folder_holds_at_most_fifteen_files() -> None:
    for folder in {path.parent for path in FILES}:
        assert len(list(folder.glob("*.py"))) <= MOST_FILES, folder


def test_every_dependency_is_justified() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = {re.split(r"[<>=~!\[ ]", d)[0] for d in project["dependencies"]}
    wanted |= {re.split(r"[<>=~!\[ ]", d)[0] for d in project["optional-dependencies"]["dev"]}
    text = (ROOT / "docs" / "dependencies.md").read_text(encoding="utf-8")
    assert wanted == set(re.findall(r"^\| `([\w-]+)` \|", text, re.M))


def test_no_literal_number_of_legs_above_kinematics() -> None:
    """Arrays have an entry for each leg of the robot: 5 stands in named constants and fields only, for other things."""
    found: list[str] = []
    for path in sorted((ROOT / "src" / "pentapod").rglob("*.py")):
        if path.relative_to(ROOT / "src" / "pentapod").parts[0] in ("kinematics", "theory"):
            continue
        text = path.read_text(encoding="utf-8")
        if not re.search(r"\b5\b", text):
            continue
        tree = ast.parse(text)
        bodies = [tree.body, *(node.body for node in ast.walk(tree) if isinstance(node, ast.ClassDef))]
        assigned = [node for body in bodies for node in body if isinstance(node, ast.Assign | ast.AnnAssign)]
        constants = {id(inner) for node in assigned for inner in ast.walk(node)}
        for node in ast.walk(tree):
            if (
                isinstance(node, ast.Constant)
                and type(node.value) is int
                and node.value == 5
                and id(node) not in constants
            ):
                found.append(f"{path.relative_to(ROOT)}:{node.lineno}")
    assert found == []


def test_no_folder_of_tests_is_passed_over(pytestconfig: pytest.Config) -> None:
    """By itself pytest does not look into folders with names such as `build`."""
    patterns = pytestconfig.getini("norecursedirs")
    folders = {file.parent for file in (ROOT / "tests").rglob("test_*.py")}
    assert len(folders) > 50
    assert not [folder for folder in folders if any(fnmatch(folder.name, pattern) for pattern in patterns)]
