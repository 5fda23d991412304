"""LinuxCNC with the legs as axes X Y Z U V (W): G-code in inverse time, with its ini and HAL.

LinuxCNC's planner looks one segment ahead, so its speed is at most √(ds·a/2) for segments of length ds. A program keeps
its own time only if a ≥ 2·v/dt and dt is at least ten servo periods. The planner uses this acceleration at the points,
between which it moves straight: it commands far more than the program's accelerations.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError, ProgramError
from pentapod.machine.machine import Machine
from pentapod.program.posts.linuxcnc.config import (
    axis_words,
    files_of,
    hal_text,
    ini_text,
    joint_words,
    number,
    servo_period_ns,
)
from pentapod.program.posts.motion import lengths_at
from pentapod.program.posts.registry import PostInput
from pentapod.program.posts.rows import read_file
from pentapod.program.program import Program
from pentapod.program.resolution import quantised
from pentapod.toolpath.process import laser_word, plain_word

LETTERS = "XYZUVW"
"""Linear axes of LinuxCNC, in the order of the legs."""
FILE = "program.ngc"


def _block(letters: str) -> re.Pattern[str]:
    return re.compile("G1" + "".join(rf" {letter}([0-9]+\.[0-9]+)" for letter in letters) + r" F([0-9]+\.[0-9]+)")


@dataclass(frozen=True)
class TrivkinsOptions:
    """Spacing of the points, and the acceleration of the planner.

    least_dt: seconds between points, and servo_periods between them, at least. headroom: factor on the acceleration
    that the planner needs.
    """

    least_dt: float = 0.01
    servo_periods: int = 10
    headroom: float = 1.25


OPTIONS = TrivkinsOptions()


def trivkins_files(given: PostInput) -> dict[str, bytes]:
    """Return the files of the folder. Raises InputError."""
    program, machine = given.program, given.the_machine()
    letters = letters_of(program)
    times = knots(program)
    legs = 1e3 * lengths_at(program, times)
    dt = float(times[1])
    low, high = 1e3 * machine.legs.min_length, 1e3 * machine.legs.max_length
    velocity = 1e3 * machine.legs.max_velocity
    acceleration = planner_acceleration(program, machine)
    # The speed of a block is that of X, Y and Z together: this high, only the axes limit it.
    fastest = len(letters) * float(velocity.max())
    limits = zip(legs[0], low, high, velocity, acceleration, strict=True)
    axes = {letter: axis_words(*values) for letter, values in zip(letters, limits, strict=True)}
    ini = ini_text(
        f"{machine.name} (trivkins)",
        f"trivkins coordinates={letters} kinstype=BOTH",
        FILE,
        axes,
        joint_words(legs[0], low, high, velocity, acceleration),
        {
            "DEFAULT_LINEAR_VELOCITY": number(velocity.min()),
            "MAX_LINEAR_VELOCITY": number(fastest),
            "MAX_LINEAR_ACCELERATION": number(len(letters) * acceleration.max()),
        },
        servo_period_ns(program.period),
    )
    said = words_at(program, times)
    return files_of(ini, hal_text(len(letters)), FILE, gcode(legs, dt, said), len(letters))


def words_at(program: Program, times: Floats) -> dict[int, list[str]]:
    """Return the words before the moves to points at these times (M,), by their index; M: after the last move.

    A switch comes before the move during which it happens. The laser's power is that at a move's beginning.
    """
    ends = times / program.period
    last = len(program.legs) - 1
    said: dict[int, list[str]] = {}
    for switch in program.switches:
        at = len(times) if switch.row == last else int(np.searchsorted(ends, switch.row, side="right"))
        said.setdefault(at if switch.row else 0, []).extend(switch.words)
    if program.laser_power is not None:
        powers = program.laser_power[np.minimum(np.rint(ends[:-1]).astype(np.intp), last)]
        changed = np.flatnonzero(np.diff(powers, prepend=-1.0))
        for k in changed.tolist():
            said.setdefault(k + 1, []).append(laser_word(float(powers[k])))
        said.setdefault(len(times), []).append(laser_word(0.0))
    return said


def tool_table(program: Program) -> bytes:
    """Return LinuxCNC's tool table, with the tools that the program calls."""
    named = [plain_word(word)[1:] for switch in program.switches for word in switch.words if word[:1] == "T"]
    numbers = sorted({1, *(int(number) for number in named if number.isdecimal())})
    return "".join(f"T{number} P{place} Z0 D0 ;\n" for place, number in enumerate(numbers, start=1)).encode()


def letters_of(program: Program) -> str:
    """Return the axes that are the legs. Raises InputError where LinuxCNC has fewer linear axes than there are legs."""
    count = program.legs.shape[1]
    if count > len(LETTERS):
        raise InputError(
            "LinuxCNC has no linear axis for each leg", key="legs", value=count, expected=f"at most {len(LETTERS)}",
            remedy="play the setpoints: post halstreamer",
        )  # fmt: skip
    return LETTERS[:count]


def planner_acceleration(program: Program, machine: Machine) -> Floats:
    """Return the accelerations (n,) in mm/s² of the planner's ini: more than those of the legs."""
    limits, dt = machine.legs, float(knots(program)[1])
    return np.maximum(1e3 * limits.max_acceleration, OPTIONS.headroom * 2.0 * 1e3 * limits.max_velocity.max() / dt)


def knots(program: Program) -> Floats:
    """Return the times (M,), equally spaced, of the G-code's points: as dense as LinuxCNC's planner allows."""
    count = max(1, math.floor(program.duration / max(OPTIONS.least_dt, OPTIONS.servo_periods * program.period) + 1e-9))
    return np.linspace(0.0, program.duration, count + 1)


def gcode(legs_mm: Floats, dt: float, said: Mapping[int, Sequence[str]] | None = None) -> bytes:
    """Return G-code through leg lengths (M, n_legs) in mm, dt seconds apart, from the current lengths.

    said: words before the moves, of `words_at`.
    """
    words = " ".join(f"{letter}%.8f" for letter in LETTERS[: legs_mm.shape[1]])
    lines = ["G21 G90 G40 G49", "G64", "G93"]
    block = f"G1 {words} F{60.0 / dt:.9f}"
    words_before = said or {}
    for k, row in enumerate(legs_mm.tolist()):
        lines += [*words_before.get(k, ()), block % tuple(row)]
    return ("\n".join([*lines, *words_before.get(len(legs_mm), ()), "G94", "M2"]) + "\n").encode()


def read_gcode(file: Path) -> tuple[Floats, Floats]:
    """Return times (M,) in seconds and leg lengths (M, n_legs) in metres of this G-code. Raises ProgramError."""
    lines = read_file(file).decode(errors="replace").splitlines()
    if not lines or lines[-1] != "M2":
        raise ProgramError("M2 is missing: the file was cut off", file=file, line=max(len(lines), 1))
    rows: list[list[float]] = []
    first = next((text for text in lines if text.startswith("G1 ")), "")
    block = _block(LETTERS[: max(len(first.split()) - 2, 1)])
    for line, text in enumerate(lines, start=1):
        if not text.startswith("G1 "):
            continue
        match = block.fullmatch(text)
        if match is None or float(match.groups()[-1]) == 0.0:
            raise ProgramError("not a move of all legs", file=file, line=line, value=text[:80])
        rows.append([float(value) for value in match.groups()])
    if len(rows) < 2:
        raise ProgramError("there are no moves", file=file, expected="at least two")
    table = np.array(rows)
    times = np.concatenate([[0.0], np.cumsum(60.0 / table[1:, -1])])
    return times, quantised(table[:, :-1] / 1e3)
