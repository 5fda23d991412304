"""Posts of a machine with a leg model: rows are commands, marked so, undone to a nanometre; no verdict takes them."""

from dataclasses import replace

import numpy as np
import pytest

from pentapod.base.errors import InputError
from pentapod.geometry import RigidTransform
from pentapod.kinematics import Component
from pentapod.machine import LegModel, Machine
from pentapod.program import Program, Provenance, read_csv
from pentapod.program.posts import PostInput, read_post, write_post
from pentapod.verify.claims.provenance import machine as judge_machine

AXES = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])


@pytest.fixture(scope="module")
def machine() -> Machine:
    desk = Machine.load("desk")
    return replace(desk, leg_model=LegModel(lead=5e-3, first_axes=AXES, backlash=10e-6, expansion=1e-5, temperature=27))


@pytest.fixture(scope="module")
def program(machine) -> Program:
    share = np.linspace(0.0, 1.0, 50)[:, None]
    tips = machine.work.centre + 0.02 * np.hstack([share, -share, 0.5 * share])
    axes = np.tile([0.0, 0.0, -1.0], (50, 1))
    legs = machine.robot.leg_lengths(tips + machine.tool_length * axes, -axes)
    source = Provenance(machine.name, machine.digest, "", "1")
    return Program(1e-3, np.round(legs, 11), "cubic", Component(1, 1), RigidTransform.identity(), source)


@pytest.mark.parametrize("name", ["csv", "npz"])
def test_rows_are_commands_and_come_back(machine, program, name, tmp_path):
    write_post(PostInput(program, machine), name, tmp_path, unverified=True)
    raw = read_post(tmp_path, name)
    assert np.abs(raw.legs - program.legs).max() > 10e-6
    assert raw.provenance.commands == machine.leg_model.digest
    back = read_post(tmp_path, name, machine)
    assert np.abs(back.legs - program.legs).max() < 1e-9
    assert back.provenance.commands == ""
    other = replace(machine, leg_model=LegModel(backlash=1e-6))
    with pytest.raises(InputError, match="commands of another leg model"):
        read_post(tmp_path, name, other)


def test_a_machine_without_a_leg_model_is_told_the_readings(program, tmp_path):
    write_post(PostInput(program, Machine.load("desk")), "csv", tmp_path, unverified=True)
    (file,) = tmp_path.glob("*.csv")
    assert np.array_equal(read_csv(file).legs, program.legs)
    assert "# commands" not in file.read_text()


def test_a_verdict_is_about_readings(machine, program):
    class Replayed:
        """What the claim asks of a replay."""

        def __init__(self) -> None:
            self.program = replace(program, provenance=replace(program.provenance, commands="0" * 16))
            self.machine = machine

    found = judge_machine(Replayed())
    assert not found.passed
    assert "commands of another leg model" in found.method
