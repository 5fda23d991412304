"""Structured Text of a machine, translated to C: equal to the robot and to the planner's margins."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from compiled_kinematics import calibrated, compiled, poses, random_machine, world_of
from pentapod.base.errors import MachineError
from pentapod.cli.main import run
from pentapod.kinematics.component import COMPONENTS
from pentapod.machine import Machine
from pentapod.machine.parts import Guard
from pentapod.planning.limits.margins import Margins
from pentapod.program.posts.codesys.structured_text import structured_text
from structured_text import Translated, translated

MM = 1e3
MACHINES = {
    "desk": lambda: Machine.load("desk"),
    "random": lambda: random_machine(1),
    "calibrated": lambda: calibrated(3),
    "calibrated with rings": lambda: calibrated(4, 0.012),
}


def compared(machine: Machine, block: Translated, count: int, seed: int) -> None:
    p, i = poses(machine, count, seed)
    world, legs = world_of(machine, p, i), MM * machine.robot.leg_lengths(p, i)
    ours, _, _ = block.inverses(world)
    assert np.abs(ours - legs).max() < 1e-9
    found, good = block.worlds(legs)
    # With rings the design may have no pose of these readings: then nothing says which pose is meant.
    started = np.isfinite(machine.robot.pose(1e-3 * legs, COMPONENTS[0])[0][:, 0])
    assert good[started].mean() > 0.995
    assert started.mean() > 0.9
    assert np.abs(found - world)[good].max() < 1e-8
    assert np.isnan(found[~good]).all(), "without a pose nothing is written"


@compiled
@pytest.mark.parametrize("name", MACHINES)
def test_structured_text_computes_what_the_robot_does(name, tmp_path):
    machine = MACHINES[name]()
    compared(machine, Translated(structured_text(machine), tmp_path), 3000, 0)


@compiled
@pytest.mark.slow
@pytest.mark.parametrize("name", MACHINES)
def test_structured_text_equals_the_robot_on_a_million_poses(name, tmp_path):
    machine = MACHINES[name]()
    block = Translated(structured_text(machine), tmp_path)
    for seed in range(5):
        compared(machine, block, 200_000, seed + 1)


@compiled
def test_structured_text_refuses_what_is_beyond_the_margins_of_the_planner(tmp_path):
    guard = Guard(w=0.2, surface=0.05, stroke=0.01, leg_gap=0.003, shaft_gap=0.002)
    machine = dataclasses.replace(calibrated(4, 0.012), guard=guard)
    p, i = poses(machine, 2000)
    _, margins, good = Translated(structured_text(machine), tmp_path).inverses(world_of(machine, p, i))
    planner = Margins.of(machine, COMPONENTS[0])
    own = planner.own(p + machine.tool_length * i, -i) * [limit.comfort for limit in planner.own_limits]
    kinds = (
        ("w = 0", 1.0), ("S = 0", MM), ("too ", MM), ("base joint", 1.0), ("platform joint", 1.0), ("legs ", MM),
        ("spindle", MM),
    )  # fmt: skip
    for k, (words, unit) in enumerate(kinds):
        columns = [c for c, limit in enumerate(planner.own_limits) if words in limit.name]
        assert np.abs(unit * own[:, columns].min(axis=1) - margins[:, k]).max() < 1e-8, words
    least = [0.2, 50.0, 10.0, 0.0, 0.0, 3.0, 2.0]
    assert (good == (margins >= least).all(axis=1)).all()
    assert 0.05 < good.mean() < 0.95


@compiled
def test_impossible_legs_have_no_pose_in_structured_text(tmp_path):
    beyond = np.array([[900.0, 490, 900, 490, 900], [np.nan] * 5, [1.0] * 5, [-700.0] * 5])
    for name, machine in (("desk", Machine.load("desk")), ("calibrated", calibrated(3, 0.03))):
        assert not Translated(structured_text(machine), tmp_path / name).worlds(beyond)[1].any()


def test_the_translation_notices_names_that_differ_in_case_only():
    text = structured_text(Machine.load("desk"))
    with pytest.raises(AssertionError):
        translated(re.sub(r"\bwSquared\b", "Step", text))
    with pytest.raises(AssertionError):
        translated(re.sub(r"\bgap\b", "SHAFT", text))


def test_the_command_writes_structured_text_or_says_why_not(tmp_path, capsys):
    file = tmp_path / "desk.st"
    assert run(["machine", "structured-text", "desk", "-o", str(file)]) == 0
    assert "function block PentapodKinematics of desk" in capsys.readouterr().out
    text = file.read_text(encoding="utf-8")
    assert Machine.load("desk").digest in text
    assert "@" not in text
    assert run(["machine", "structured-text", "hexa", "-o", str(tmp_path / "hexa.st")]) == 2
    assert "family" in capsys.readouterr().err
    assert not (tmp_path / "hexa.st").exists()
    with pytest.raises(MachineError, match="there is no kinematics module for such a machine"):
        structured_text(Machine.load("hexa"))
