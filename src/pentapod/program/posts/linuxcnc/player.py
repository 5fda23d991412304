"""LinuxCNC's HAL: setpoints through a player that obeys a feed override, hold and abort, and keeps the legs' limits."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import MachineError, ProgramError
from pentapod.geometry.interpolant import Interpolant
from pentapod.machine.machine import Machine
from pentapod.program.header import header_text
from pentapod.program.posts.linuxcnc.config import packaged, servo_period_ns
from pentapod.program.posts.linuxcnc.contour import HEADER, contour_files, player_lines
from pentapod.program.posts.linuxcnc.kinematics import controller_frame
from pentapod.program.posts.linuxcnc.module import Module, module_files
from pentapod.program.posts.linuxcnc.stream import limit_lines
from pentapod.program.posts.registry import PostInput
from pentapod.program.posts.rows import read_file
from pentapod.program.program import Program

COEFFICIENTS = "coefficients.halstream"
DECIMALS, SAME_MM = 10, 1e-9
"""Decimals of coefficients in mm, and the difference up to which they are the same."""


def player_files(given: PostInput) -> dict[str, bytes]:
    """Return the program as B-spline coefficients, the player's source, and HAL and script that play them.

    No files for a program with a laser's power, which the player does not know. Raises InputError.
    """
    if given.program.laser_power is not None:
        return {}
    machine = given.the_machine()
    correction = _correction(machine, given.program)
    sources = {f"pentapod_player.{kind}": packaged(f"player/pentapod_player.{kind}") for kind in ("h", "c")}
    shared = {name: packaged(f"kinematics/{name}") for name in ("pins_2.9.h", "pins_dev.h", "install.sh")}
    return {
        **sources,
        **shared,
        "player_numbers.h": numbers_text(machine, given.program).encode(),
        COEFFICIENTS: _stream(given.program),
        **correction,
        "player.hal": _hal(machine, servo_period_ns(given.program.period), corrected=bool(correction)).encode(),
        "play.sh": packaged("play_player.sh"),
    }


def _correction(machine: Machine, program: Program) -> dict[str, bytes]:
    """Return the sources of the contour correction; none for a machine or drives that can have none."""
    try:
        module = Module(machine, program.component, controller_frame(machine, program.component), ())
        found = contour_files(module, program.period)
        return {**module_files(module, (HEADER,)), **found} if found else {}
    except MachineError:
        return {}


def spline_coefficients(program: Program) -> Floats:
    """Return B-spline coefficients (N + 2, n_legs), metres, of the C2 cubic spline through a program's rows at rest.

    Between rows k and k + 1 the spline is that of the coefficients k to k + 3.
    """
    rows = program.legs
    inner = rows - Interpolant.through(rows, program.period, "cubic").second * (program.period**2 / 6.0)
    return np.concatenate([inner[1:2], inner, inner[-2:-1]])


def numbers_text(machine: Machine, program: Program) -> str:
    """Return player_numbers.h: the number of rows, and the limits of the legs in millimetres and periods."""
    period, legs = program.period, machine.legs
    limits = {
        "RATE": 1e3 * legs.max_velocity * period,
        "ACCELERATION": 1e3 * legs.max_acceleration * period**2,
        "JERK": 1e3 * legs.max_jerk * period**3,
    }
    lines = [
        "/* Numbers of one program and its machine, written by pentapod. SPDX-License-Identifier: MIT */",
        f"#define PENTAPOD_ROWS {len(program.legs)}",
        f"#define PENTAPOD_LEGS {program.legs.shape[1]}",
    ]
    for name, values in limits.items():
        lines.append(f"#define PENTAPOD_{name} {{{', '.join(float(value).hex() for value in values)}}}")
    return "\n".join(lines) + "\n"


def coefficient_table(program: Program) -> Floats:
    """Return rows for the player: how many coefficients have come, then the last two, mm."""
    coefficients = spline_coefficients(program)
    even = np.concatenate([coefficients, coefficients[-1:]])[: len(coefficients) + len(coefficients) % 2]
    pairs = 1e3 * even.reshape(len(even) // 2, -1)
    counts = 2.0 * np.arange(1, len(pairs) + 1, dtype=np.float64)
    return np.concatenate([counts[:, None], pairs], axis=1)


def _stream(program: Program) -> bytes:
    """Return the file for halstreamer."""
    text, table = io.StringIO(), coefficient_table(program)
    np.savetxt(text, table, ["%d", *[f"%.{DECIMALS}f"] * (table.shape[1] - 1)])
    return (header_text(program) + text.getvalue()).encode()


def check_coefficients(file: Path, program: Program) -> None:
    """Raise ProgramError unless the coefficients in a file are those of the program."""
    lines = read_file(file).decode(errors="replace").splitlines()
    try:
        found = np.loadtxt([line for line in lines if not line.startswith("#")], comments=None, ndmin=2)
    except ValueError:
        found = np.empty((0, 0))
    wanted = coefficient_table(program)
    if found.shape != wanted.shape or not np.abs(found - wanted).max() < SAME_MM:
        raise ProgramError(
            "the player's coefficients are not those of the program", file=file, remedy="write the post again"
        )


def _hal(machine: Machine, period_ns: int, *, corrected: bool) -> str:
    count = machine.robot.n_legs
    lines = [
        f"loadrt threads name1=servo-thread period1={period_ns}",
        f"loadrt streamer depth=4000 cfg={'f' * (1 + 2 * count)}",
        "loadrt pentapod_player",
        *(["loadrt pentapod_contour"] if corrected else []),
        f"loadrt limit3 names={','.join(f'leg{k + 1}' for k in range(count))}",
        f"loadrt sampler depth=16000 cfg={'f' * (2 * count + 2)}",
        "setp sampler.0.enable 0",
        "addf streamer.0 servo-thread",
        "addf pentapod-player servo-thread",
        *(f"addf leg{leg} servo-thread" for leg in range(1, count + 1)),
        *(["addf pentapod-contour servo-thread"] if corrected else []),
        "addf sampler.0 servo-thread",
        "net number streamer.0.pin.0 => pentapod-player.number",
        *(f"net c{k} streamer.0.pin.{k + 1} => pentapod-player.coefficient.{k}" for k in range(2 * count)),
        "net more pentapod-player.more => streamer.0.enable",
        *(f"net played{k + 1} pentapod-player.leg.{k} => leg{k + 1}.in sampler.0.pin.{k}" for k in range(count)),
        *(f"net limited{k + 1} leg{k + 1}.out => sampler.0.pin.{k + count}" for k in range(count)),
        f"net row pentapod-player.row => sampler.0.pin.{2 * count}",
        f"net pace pentapod-player.pace => sampler.0.pin.{2 * count + 1}",
        *(player_lines(count) if corrected else []),
        *limit_lines(machine),
    ]
    return "\n".join(lines) + "\n"
