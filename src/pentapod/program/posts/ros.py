"""ROS 2: a trajectory_msgs/JointTrajectory as JSON or YAML, in metres and seconds.

With cubic interpolation each point has velocity and acceleration too: then the quintics with which ROS controllers
interpolate are the program's own cubics. With linear interpolation it has positions only. The YAML begins with the
header as comments, then flow style; the header of the JSON is a file of its own.
"""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ProgramError
from pentapod.program.header import UNVERIFIED, Header, header_text
from pentapod.program.posts.motion import accelerations, velocities
from pentapod.program.posts.registry import LASER_POWER, Post, PostInput, register
from pentapod.program.posts.rows import check_legs, check_rows, header_of, read_file
from pentapod.program.posts.tables import SIDECAR
from pentapod.program.program import Program

Style = Literal["json", "yaml"]
_STEM = "joint_trajectory"


def _joints(legs: int) -> list[str]:
    return [f"leg{leg + 1}" for leg in range(legs)]


NANOSECONDS = 1_000_000_000  # in a second


def _write(given: PostInput, style: Style) -> dict[str, bytes]:
    program = given.program
    if style == "yaml":
        return {f"{_STEM}.yaml": trajectory_yaml(program)}
    return {f"{_STEM}.json": _message(program).encode(), SIDECAR: header_text(program).encode()}


def trajectory_yaml(program: Program, zeros: Floats | float = 0.0) -> bytes:
    """Return the message as YAML, below the header. zeros (n_legs,): what legs read where their joints are at zero."""
    return (header_text(program) + _message(program, zeros)).encode()


def _message(program: Program, zeros: Floats | float = 0.0) -> str:
    """Return the message as JSON, one point a line."""
    columns = {"positions": (program.legs - zeros, 11)}
    if program.interpolation == "cubic":
        columns |= {"velocities": (velocities(program), 12), "accelerations": (accelerations(program), 9)}
    texts = {name: _lists(values, digits) for name, (values, digits) in columns.items()}
    points: list[str] = []
    for k in range(len(program.legs)):
        seconds, nanoseconds = divmod(round(k * program.period * NANOSECONDS), NANOSECONDS)
        fields = "".join(f'"{name}": {rows[k]}, ' for name, rows in texts.items())
        points.append(f'{{{fields}"time_from_start": {{"sec": {seconds}, "nanosec": {nanoseconds}}}}}')
    frame = json.dumps(UNVERIFIED if program.provenance.unverified else "")
    head = f'"header": {{"stamp": {{"sec": 0, "nanosec": 0}}, "frame_id": {frame}}}'
    return (
        "{"
        + head
        + ',\n"joint_names": '
        + json.dumps(_joints(program.legs.shape[1]))
        + ',\n"points": [\n'
        + ",\n".join(points)
        + "\n]}\n"
    )


def _lists(values: Floats, digits: int) -> list[str]:
    row = "[" + ", ".join([f"%.{digits}f"] * values.shape[1]) + "]"
    return [row % tuple(numbers) for numbers in (np.round(values, digits) + 0.0).tolist()]


def _read(folder: Path, style: Style) -> Program:
    file = folder / f"{_STEM}.{style}"
    text = read_file(file).decode(errors="replace")
    if style == "yaml":
        lines = text.splitlines()
        header = header_of([line for line in lines if line.startswith("#")], file)
        text = "\n".join("" if line.startswith("#") else line for line in lines)
    else:
        sidecar = folder / SIDECAR
        header = header_of(read_file(sidecar).decode(errors="replace").splitlines(), sidecar)
    try:
        return _program(json.loads(text), header, file)
    except json.JSONDecodeError as error:
        raise ProgramError("this is not JSON", file=file, line=error.lineno, column=error.colno) from error
    except (KeyError, IndexError, TypeError, ValueError, ArithmeticError, RecursionError) as error:
        if isinstance(error, ProgramError):
            raise
        remedy = "write it again: pentapod post"
        raise ProgramError("not a JointTrajectory", file=file, value=str(error)[:80], remedy=remedy) from error


def _program(message: Any, header: Header, file: Path) -> Program:
    if message["joint_names"] != (joints := _joints(header.legs)):
        raise ProgramError("wrong joints", file=file, key="joint_names", expected=", ".join(joints))
    points = message["points"]
    check_rows(len(points), header, file)
    stamps = [point["time_from_start"] for point in points]
    parts = [stamp[part] for stamp in stamps for part in ("sec", "nanosec")]
    if not all(type(part) is int and 0 <= part < NANOSECONDS for part in parts):
        raise ProgramError("a time is not in whole seconds and nanoseconds", file=file, key="time_from_start")
    times = np.array([stamp["sec"] * NANOSECONDS + stamp["nanosec"] for stamp in stamps])
    wrong = np.abs(times - np.arange(len(points)) * header.period * NANOSECONDS) > 0.51
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ProgramError(
            f"the time is not a multiple of the period (point {row + 1})", file=file, key="time_from_start",
            value=times[row] / NANOSECONDS, expected=f"{row * header.period:.9g} s",
        )  # fmt: skip
    legs = np.array([point["positions"] for point in points], dtype=np.float64)
    if legs.shape != (shape := (len(points), header.legs)):
        what = "not a position for each leg"
        raise ProgramError(what, file=file, key="positions", value=legs.shape, expected=str(shape))
    return header.program(check_legs(legs, file))


def _post(style: Style) -> Post:
    write, read = partial(_write, style=style), partial(_read, style=style)
    about = f"ROS 2 JointTrajectory as {style.upper()}"
    return register(Post(f"ros2-{style}", about, write, read, frozenset({LASER_POWER})))


JSON, YAML = _post("json"), _post("yaml")
