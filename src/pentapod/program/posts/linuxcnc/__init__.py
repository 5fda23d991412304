"""LinuxCNC: a folder with four configurations that run in simulation as they are; see its README."""

from __future__ import annotations

from pathlib import Path

from pentapod.base.errors import MachineError
from pentapod.program.posts.drives import HALSTREAMER
from pentapod.program.posts.linuxcnc import kinematics, player, stream, trivkins
from pentapod.program.posts.linuxcnc.config import packaged
from pentapod.program.posts.registry import Post, PostInput, register
from pentapod.program.program import Program
from pentapod.toolpath.toolpath import Toolpath

__all__ = ["LINUXCNC", "kinematics", "player", "stream", "trivkins"]


def _write(given: PostInput) -> dict[str, bytes]:
    folders = {"stream": stream.stream_files(given), "trivkins": trivkins.trivkins_files(given)}
    folders["player"] = player.player_files(given)
    program, note = given.program, ""
    try:
        of_machine = given.the_machine(), program.component, program.period, given.toolpath
        folders["kinematics"] = kinematics.kinematics_files(*of_machine)
        if given.toolpath is not None:
            note = kinematics.nearer_than_least(given.the_machine(), program.component, given.toolpath)
    except MachineError as error:
        note = f"It is not here: {error}.\n"
    tools = {"tool.tbl": trivkins.tool_table(program)}
    folders = {folder: {**files, **tools} if "tool.tbl" in files else files for folder, files in folders.items()}
    files = {f"{folder}/{name}": content for folder, files in folders.items() for name, content in files.items()}
    machine = given.the_machine()
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
