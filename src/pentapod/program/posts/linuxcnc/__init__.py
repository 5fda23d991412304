"""LinuxCNC: a folder with three configurations that run in simulation as they are; see its README."""

from __future__ import annotations

from pathlib import Path

from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.legs_on_rings import LegsOnRings
from pentapod.program.posts.drives import HALSTREAMER
from pentapod.program.posts.linuxcnc import pentakins, stream, trivkins
from pentapod.program.posts.linuxcnc.config import packaged
from pentapod.program.posts.registry import Post, PostInput, register
from pentapod.program.program import Program
from pentapod.toolpath.toolpath import Toolpath

__all__ = ["LINUXCNC", "pentakins", "stream", "trivkins"]


def _write(given: PostInput) -> dict[str, bytes]:
    folders = {"stream": stream.stream_files(given), "trivkins": trivkins.trivkins_files(given)}
    if given.toolpath is not None and isinstance(given.the_machine().robot, FiveLegs | LegsOnRings):
        folders["pentakins"] = pentakins.pentakins_files(given)
    tools = {"tool.tbl": trivkins.tool_table(given.program)}
    folders = {folder: {**files, **tools} if "tool.tbl" in files else files for folder, files in folders.items()}
    files = {f"{folder}/{name}": content for folder, files in folders.items() for name, content in files.items()}
    machine = given.the_machine()
    words = {
        "allowed": trivkins.planner_acceleration(given.program, machine).max(),
        "limit": 1e3 * machine.legs.max_acceleration.min(),
    }
    text = packaged("README.md").decode()
    for name, value in words.items():
        text = text.replace(f"{{{name}}}", f"{value:.0f}")
    return {"README.md": text.encode(), **files}


def _read(folder: Path) -> Program | Toolpath:
    return HALSTREAMER.read(folder / "stream")


LINUXCNC = register(
    Post(
        "linuxcnc",
        "LinuxCNC: setpoints with HAL, G-code of the legs, tool path for pentakins",
        _write,
        _read,
        takes_toolpath=True,
    )
)
