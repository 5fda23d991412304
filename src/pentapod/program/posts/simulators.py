"""Simulators: the machine as a model, standing at the program's first row, and the legs' readings at every row.

`legs.csv` has a row for each setpoint: seconds, then what each leg reads in metres. For MuJoCo these are the controls
of the model's drives. The joints of SDF are at zero where the model stands, so Gazebo and ROS 2 get a message too,
whose positions are readings less those of the first row. No leg model: a simulated leg reads what it is told.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import cast

from pentapod.base.errors import ProgramError
from pentapod.machine.rigid_bodies.mjcf import mjcf
from pentapod.machine.rigid_bodies.sdf import sdf
from pentapod.program.posts.registry import LASER_POWER, Post, PostInput, register
from pentapod.program.posts.ros import trajectory_yaml
from pentapod.program.posts.rows import read_file
from pentapod.program.posts.tables import LEGS, Column, Files, Table, leg_columns, table_post
from pentapod.program.program import Program

MODELS = {"mjcf": mjcf, "sdf": sdf}
_MESSAGE = "joint_trajectory.yaml"


def _files(legs: int = LEGS) -> Files:
    return {"legs.csv": (Column("time_s", "time", "s", 9), *leg_columns("leg{leg}_m", "length", "m", 11, legs))}


_ROWS = table_post("legs", "", Table(_files))


def _write(given: PostInput, form: str) -> dict[str, bytes]:
    machine, program = given.the_machine(), given.program
    position, direction = machine.robot.pose(program.legs[0], program.component)
    model = MODELS[form](machine, machine.robot, position, direction, period=program.period)
    files = {f"machine.{'xml' if form == 'mjcf' else form}": model.encode(), **_ROWS.write(given)}
    if form == "sdf":
        files[_MESSAGE] = trajectory_yaml(program, program.legs[0])
    return files


def _read(folder: Path, form: str) -> Program:
    program = cast("Program", _ROWS.read(folder))
    if form == "sdf" and read_file(folder / _MESSAGE) != trajectory_yaml(program, program.legs[0]):
        remedy = "write it again: pentapod post"
        raise ProgramError("the message is not that of legs.csv", file=folder / _MESSAGE, remedy=remedy)
    return program


def _post(form: str, about: str) -> Post:
    write, read = partial(_write, form=form), partial(_read, form=form)
    return register(Post(form, about, write, read, frozenset({LASER_POWER}), readings=True))


MJCF = _post("mjcf", "MuJoCo: the machine as MJCF, and its legs at every row")
SDF = _post("sdf", "Gazebo and ROS 2: the machine as SDF, and its legs at every row")
