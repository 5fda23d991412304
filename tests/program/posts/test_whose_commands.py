"""Whose commands a post writes: those of the machine for which the program was made, or none."""

from dataclasses import replace
from hashlib import sha256

import numpy as np
import pytest

from pentapod.base.errors import InputError
from pentapod.geometry import RigidTransform
from pentapod.kinematics import Component
from pentapod.machine import LegModel, Machine, Stiffness
from pentapod.program import Program, Provenance
from pentapod.program.commands import commanded, springs_digest
from pentapod.program.csv import csv_bytes
from pentapod.program.posts import PostInput, read_post, write_post

DESK = Machine.load("desk")
SOFT = replace(DESK, stiffness=Stiffness(leg_stiffness=np.full(5, 20e6)))
TURNS = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
SCREWS = replace(DESK, leg_model=LegModel(5e-3, TURNS, 0.0))
QUANTUM = 1e-11


def program_for(machine, compensation):
    tips = machine.work.centre + np.linspace(0.0, 0.02, 60)[:, None] * [1.0, -1.0, 0.5]
    up = np.tile([0.0, 0.0, 1.0], (60, 1))
    legs = np.round(machine.robot.leg_lengths(tips - machine.tool_length * up, up), 11)
    source = Provenance(machine.name, machine.digest, "", "1", compensation=compensation)
    return Program(1e-3, legs, "cubic", Component(1, 1), RigidTransform.identity(), source)


@pytest.mark.parametrize("post", ["csv", "pvt", "npz", "ros2-yaml"])
def test_rows_of_a_compensated_program_need_its_machine(post, tmp_path) -> None:
    """Without it the lengths would be written as if they were commands."""
    with pytest.raises(InputError, match="this post needs the machine"):
        write_post(PostInput(program_for(SOFT, "gravity")), post, tmp_path, unverified=True)
    assert not list(tmp_path.iterdir())
    assert write_post(PostInput(program_for(SOFT, "")), post, tmp_path, unverified=True)


@pytest.mark.parametrize(("machine", "compensation"), [(SOFT, "gravity"), (SCREWS, "")], ids=["springs", "screws"])
def test_another_machine_makes_no_commands(machine, compensation, tmp_path) -> None:
    """A tool of another length changes the forces in the legs, and where screws count as not turned."""
    program = program_for(machine, compensation)
    other = machine.with_tool(machine.tool_length + 0.02)
    with pytest.raises(InputError, match="this is not the machine that the program was made for"):
        write_post(PostInput(program, other), "csv", tmp_path, unverified=True)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("machine", "compensation"), [(SOFT, "gravity"), (SCREWS, "")], ids=["springs", "screws"])
def test_a_simulator_gets_lengths_of_a_file_with_commands_too(machine, compensation, tmp_path) -> None:
    program = program_for(machine, compensation)
    told = commanded(program, machine)
    assert np.abs(told.legs - program.legs).max() > 1e-7
    write_post(PostInput(told, machine), "mjcf", tmp_path, unverified=True)
    assert np.abs(read_post(tmp_path, "mjcf").legs - program.legs).max() <= 3.0 * QUANTUM


HEAVIER = replace(SOFT, masses=replace(SOFT.masses, platform=SOFT.masses.platform + 1.0))
SOFTER = replace(SOFT, stiffness=Stiffness(leg_stiffness=np.full(5, 19e6)))
WARMER = replace(SOFT, leg_model=SCREWS.leg_model)


@pytest.mark.parametrize(("now", "same"), [(SOFT, True), (WARMER, True), (HEAVIER, False), (SOFTER, False)])
def test_commands_are_made_by_the_springs_that_were_judged(now, same, tmp_path) -> None:
    """A machine's leg model may be measured again every day; its stiffness is part of what the verdict judged."""
    program = program_for(SOFT, "gravity")
    digest = sha256(csv_bytes(program)).hexdigest()
    verdict = {"passed": True, "sha256": {"program": digest}, "springs": springs_digest(program, SOFT)}
    if same:
        assert write_post(PostInput(program, now), "pvt", tmp_path, verdict=verdict)
        return
    with pytest.raises(InputError, match="stiffness or masses were changed after the verdict"):
        write_post(PostInput(program, now), "pvt", tmp_path, verdict=verdict)
    assert not list(tmp_path.iterdir())
