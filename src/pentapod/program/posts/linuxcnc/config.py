"""Common parts of the ini and HAL files of both LinuxCNC configurations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError

Words = Mapping[str, object]


def servo_period_ns(period: float) -> int:
    """Return a period in nanoseconds. Raises InputError where LinuxCNC has no such period."""
    nanoseconds = round(period * 1e9)
    if not 25_000 <= nanoseconds <= 1_000_000_000:
        raise InputError(
            "LinuxCNC has no such servo period", key="period_s", value=period, expected="25 µs to 1 s",
            remedy="set period_ms of the machine or the job",
        )  # fmt: skip
    return nanoseconds


def ini_text(
    name: str,
    kinematics: str,
    program: str,
    axes: Mapping[str, Words],
    joints: Sequence[Words],
    traj: Words,
    period_ns: int,
) -> str:
    """Return the ini of a simulation. axes: tables by letter, of `axis_words`; joints: tables of `joint_words`."""
    tables: dict[str, Words] = {
        "EMC": {"VERSION": "1.1", "MACHINE": name, "DEBUG": 0},
        "DISPLAY": {"DISPLAY": "axis", "OPEN_FILE": program, "PROGRAM_PREFIX": ".", "MAX_FEED_OVERRIDE": 1.0},
        "TASK": {"TASK": "milltask", "CYCLE_TIME": 0.001},
        "RS274NGC": {"PARAMETER_FILE": "linuxcnc.var"},
        "EMCMOT": {"EMCMOT": "motmod", "COMM_TIMEOUT": 4.0, "BASE_PERIOD": 0, "SERVO_PERIOD": period_ns},
        "EMCIO": {"EMCIO": "io", "CYCLE_TIME": 0.1, "TOOL_TABLE": "tool.tbl"},
        "HAL": {"HALFILE": "pentapod.hal", "# HALFILE": "record.hal"},
        "TRAJ": {"COORDINATES": " ".join(axes), "LINEAR_UNITS": "mm", "ANGULAR_UNITS": "degree", "NO_FORCE_HOMING": 1,
                 "ARC_BLEND_ENABLE": 1, **traj},
        "KINS": {"KINEMATICS": kinematics, "JOINTS": len(joints)},
    }  # fmt: skip
    tables |= {f"AXIS_{letter}": words for letter, words in axes.items()}
    tables |= {f"JOINT_{k}": words for k, words in enumerate(joints)}
    lines: list[str] = []
    for title, words in tables.items():
        lines += [f"[{title}]", *(f"{key} = {value}" for key, value in words.items()), ""]
    return "\n".join(lines)


def axis_words(home: float, low: float, high: float, velocity: float, acceleration: float) -> dict[str, object]:
    """Return an [AXIS_…] table: millimetres or degrees, per second and per second²."""
    return {
        "HOME": number(home),
        "MIN_LIMIT": number(low),
        "MAX_LIMIT": number(high),
        "MAX_VELOCITY": number(velocity),
        "MAX_ACCELERATION": number(acceleration),
    }


def joint_words(home: Floats, low: Floats, high: Floats, velocity: Floats, acceleration: Floats) -> list[Words]:
    """Return the [JOINT_…] tables of the legs, arrays (n,) in mm, mm/s and mm/s²; homing leaves them where they are."""
    joints: list[Words] = []
    for values in zip(home, low, high, velocity, acceleration, strict=True):
        words = axis_words(*values)
        homing = {"HOME_OFFSET": words["HOME"], "HOME_SEARCH_VEL": 0, "HOME_LATCH_VEL": 0, "HOME_SEQUENCE": 0}
        joints.append({"TYPE": "LINEAR", "HOME": words["HOME"], **homing, **words, "FERROR": 1000, "MIN_FERROR": 1000})
    return joints


def hal_text(legs: int, *, driven: bool = True) -> str:
    """Return the HAL of a simulation of so many legs. driven: commands are their own feedback; else none has any."""
    lines = [
        "loadrt [KINS]KINEMATICS",
        "loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS",
        "addf motion-command-handler servo-thread",
        "addf motion-controller servo-thread",
        "net estop-loop iocontrol.0.user-enable-out iocontrol.0.emc-enable-in",
        "net tool-prep-loop iocontrol.0.tool-prepare iocontrol.0.tool-prepared",
        "net tool-change-loop iocontrol.0.tool-change iocontrol.0.tool-changed",
    ]
    if driven:
        lines += [f"net leg{k + 1} joint.{k}.motor-pos-cmd => joint.{k}.motor-pos-fb" for k in range(legs)]
    return "\n".join(lines) + "\n"


def record_text(legs: int) -> str:
    """Return the HAL that records each joint's command, and the kind of motion."""
    lines = [
        f"loadrt sampler depth=16000 cfg={'f' * legs}s",
        "addf sampler.0 servo-thread",
        *(f"net command{k + 1} joint.{k}.pos-cmd => sampler.0.pin.{k}" for k in range(legs)),
        f"net kind-of-motion motion.motion-type => sampler.0.pin.{legs}",
    ]
    return "\n".join(lines) + "\n"


def files_of(ini: str, hal: str, program: str, code: bytes, legs: int) -> dict[str, bytes]:
    """Return the files of a configuration's folder; program: the name of the G-code file."""
    return {
        program: code,
        "pentapod.ini": ini.encode(),
        "pentapod.hal": hal.encode(),
        "record.hal": record_text(legs).encode(),
        "tool.tbl": b"T1 P1 Z0 D0 ;\n",
        "linuxcnc.var": b"",
        "headless": packaged("headless"),
        "play.sh": packaged("play_config.sh"),
    }


def packaged(name: str) -> bytes:
    """Return a file that comes with pentapod as it is."""
    return resources.files("pentapod.program.posts.linuxcnc").joinpath("files", name).read_bytes()


def number(value: float | np.floating[Any]) -> str:
    """Return a number without exponent, to nine decimals."""
    return f"{float(value):.9f}".rstrip("0").rstrip(".")
