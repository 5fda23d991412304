"""Troubleshooting: each cause of a refusal, each limit and each claim has its row, under the text that is printed."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from pentapod import BallCutter, CollisionWorld, Cone, Machine, load_mesh
from pentapod.cli.commands.new import dome_stl
from pentapod.machine import shipped_machines
from pentapod.planning.limits.margins import Margins
from pentapod.verify.judge import CLAIM_NAMES

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "pentapod"
PAGE = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
REFUSALS = ("Refusal", "NotRegistered", "UnplacedPath", "Failure")
"""What makes a refusal, or its reason; the second argument is the cause."""


def assigned(tree: ast.Module) -> dict[str, list[ast.expr]]:
    """Every value that a name gets in a module."""
    found: dict[str, list[ast.expr]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            found.setdefault(node.targets[0].id, []).append(node.value)
    return found


def texts(cause: ast.expr, known: dict[str, list[ast.expr]], deep: int = 3) -> list[str]:
    """The first long literal part of each text that an expression may be."""
    match cause:
        case ast.Constant(value=str(text)):
            found = [max(re.split(r"\{[^}]*\}", text), key=len)]
        case ast.JoinedStr(values=parts):
            inner = (part.value if isinstance(part, ast.FormattedValue) else part for part in parts)
            said = (texts(part, known, deep) for part in inner)
            found = next((each for each in said if any(len(text) > 8 for text in each)), [])
        case ast.Name(id=name) if deep:
            found = [text for value in known.get(name, ()) for text in texts(value, known, deep - 1)]
        case ast.BinOp(left=left):
            found = texts(left, known, deep)
        case ast.Starred():  # *cause_and_more(...)
            found = texts(ast.Name("cause"), known, deep)
        case ast.Call(func=ast.Attribute(value=text)):  # TEXT.format(...)
            found = texts(text, known, deep)
        case _:
            found = []
    return found


def causes() -> dict[str, str]:
    """Literal parts of the causes of all refusals, and where they are written."""
    modules = {path: ast.parse(path.read_text(encoding="utf-8")) for path in sorted(SOURCE.rglob("*.py"))}
    shared = assigned(modules[SOURCE / "timing" / "topp" / "stages.py"])
    found = {}
    for path, tree in modules.items():
        known = {**shared, **assigned(tree)}
        for call in ast.walk(tree):
            if not isinstance(call, ast.Call):
                continue
            made = call.args[1:2] if getattr(call.func, "id", "") in REFUSALS else []
            for cause in (*made, *(word.value for word in call.keywords if word.arg == "cause")):
                said, place = texts(cause, known), f"{path.relative_to(ROOT)}:{call.lineno}"
                passed_on = ast.unparse(cause).split(".")[-1] in ("cause", "reason")
                assert said or passed_on, f"{place}: what does this refusal say?"
                found.update(dict.fromkeys(said, place))
    return found


def test_each_cause_of_a_refusal_has_a_row():
    found, rows = causes(), [row for row in re.findall(r"`([^`]+)`", PAGE) if len(row) > 12]
    assert len(found) > 30, "the search for causes finds those that there are"
    for text, place in found.items():
        sought = text.strip(" :;,")
        assert any(sought in row or row in sought for row in rows), f"{place}: {sought}"


def general(name: str) -> str:
    """A limit's name with one leg for all."""
    return re.sub(r"\d+", "N", name)


@pytest.mark.parametrize("name", shipped_machines())
def test_each_limit_of_a_machine_has_a_row(name, tmp_path):
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=4))
    part, machine = load_mesh(tmp_path / "part.stl", "mm"), Machine.load(name)
    tool = BallCutter(3e-3, shank=(Cone(0.02, 3e-3, 3e-3),))
    world = CollisionWorld.of(machine, tool, part, fixture=part)
    rows = {general(row) for row in re.findall(r"`([^`]+)`", PAGE.partition("## Limits that")[2])}
    limits = Margins.of(machine, next(iter(machine.robot.branches)), world).limits
    assert {general(limit.name) for limit in limits} <= rows


@pytest.mark.parametrize("name", CLAIM_NAMES)
def test_each_claim_has_a_row(name):
    assert f"`{name}`" in PAGE.partition("## Claims that fail")[2]
