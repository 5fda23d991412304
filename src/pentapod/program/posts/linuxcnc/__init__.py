"""LinuxCNC: a folder with four configurations that run in simulation as they are; see its README."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pentapod.base.errors import MachineError
from pentapod.program.commands import commanded
from pentapod.program.posts.drives import HALSTREAMER
from pentapod.program.posts.linuxcnc import kinematics, player, stream, trivkins
from pentapod.program.posts.linuxcnc.config import packaged
from pentapod.program.posts.registry import Post, PostInput, register
from pentapod.program.program import Program
from pentapod.toolpath.toolpath import Toolpath

__all__ = ["LINUXCNC", "kinematics", "player", "stream", "trivkins"]

NOT_COMPENSATED = (
    "The other three folders compensate for what the legs yield to their loads. This one does not: the tip moves by "
    "that.\n"
)
"""What is said of the module where the program is compensated."""


def _write(given: PostInput) -> dict[str, bytes]:
    machine, program = given.the_machine(), given.program
    told = replace(given, program=commanded(program, machine))  # the module below computes legs by itself
    folders = {"stream": stream.stream_files(told), "trivkins": trivkins.trivkins_files(told)}
    folders["player"] = player.player_files(told)
    note = NOT_COMPENSATED if program.provenance.compensation else ""
    try:
        of_machine = machine, program.component, program.period, given.toolpath
        folders["kinematics"] = kinematics.kinematics_files(*of_machine)
        if given.toolpath is not None:
            note += kinematics.nearer_than_least(machine, program.component, given.toolpath)
    except MachineError as error:
        note = f"It is not here: {error}.\n"
    tools = {"tool.tbl": trivkins.tool_table(program)}
    folders = {folder: {**files, **tools} if "tool.tbl" in files else files for folder, files in folders.items()}
    files = {f"{folder}/{name}": content for folder, files in folders.items() for name, content in files.items()}
    words = {
        "allowed": f"{trivkins.planner_acceleration(program, machine).max():.0f}",
        "limit": f"{1e3 * machine.legs.max_acceleration.min():.0f}",
        "note": note,
    }
    text = packaged("README.md").decode()
    for name, value in words.items():
        text = text.replace(f"{{{name}}}", value)
    return {"README.md": text.encode(), **files}


def _read(folder: Path) -> Program | Toolpath:
    found = HALSTREAMER.read(folder / "stream")
    if isinstance(found, Program) and found.laser_power is None:
        player.check_coefficients(folder / "player" / player.COEFFICIENTS, found)
    return found


LINUXCNC = register(
    Post(
        "linuxcnc",
        "LinuxCNC: setpoints with HAL, G-code of the legs, a kinematics module with the tool path",
        _write,
        _read,
        takes_toolpath=True,
    )
)
