"""The header of the kinematics module, compiled by the C compiler that is installed and called through ctypes."""

from __future__ import annotations

import ctypes
import dataclasses
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from pentapod.kinematics import AsBuiltPentapod, LinearPentapod
from pentapod.kinematics.component import COMPONENTS
from pentapod.machine import Machine
from pentapod.program.posts.linuxcnc.kinematics import kinematics_files

COMPILER = shutil.which("cc") or shutil.which("gcc") or ""
compiled = pytest.mark.skipif(not COMPILER, reason="there is no C compiler")
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wdouble-promotion", "-Werror")
MARGINS = ("w", "surface", "stroke", "base cone", "platform joint", "leg gap", "shaft gap")
CALLS = """
#include "pentapod_kinematics.h"
#include <string.h>

long lines(long n, const double *legs, double *out)
{
    long bad = 0, k;
    for (k = 0; k < n; k++) {
        pentapod_line line;
        if (pentapod_line_of_legs(legs + 5 * k, &line)) {
            bad++;
            memset(&line, 0xff, sizeof(line)); /* NaN */
        }
        memcpy(out + 6 * k, &line, sizeof(line));
    }
    return bad;
}

long worlds(long n, const double *legs, double *out)
{
    long bad = 0, k;
    for (k = 0; k < n; k++)
        bad += pentapod_forward(legs + 5 * k, PENTAPOD_TOOL_LENGTH, out + 5 * k) != 0;
    return bad;
}

void inverses(long n, const double *world, double *legs, double *margins)
{
    long k;
    for (k = 0; k < n; k++)
        pentapod_inverse(world + 5 * k, PENTAPOD_TOOL_LENGTH, legs + 5 * k, margins + PENTAPOD_MARGINS * k);
}

void others(long n, const double *legs, double slack, int *out)
{
    long k;
    for (k = 0; k < n; k++)
        out[k] = pentapod_other_modes(legs + 5 * k, slack);
}

/* Rows of legs one after the other: known, stop and hold of each period; and by what the feed must be multiplied. */
void guards(
    long n, const double *legs, double period, int moving, double pace, const double *least, const double *fast,
    int *out, double *feed)
{
    pentapod_settings settings = {PENTAPOD_TOOL_LENGTH, {0}, {0}, 0.9, 0.45, 4.0};
    pentapod_memory memory = {{0}, {0}, 0.0, 0, 0};
    pentapod_report report;
    long k;
    memcpy(settings.least, least, sizeof(settings.least));
    memcpy(settings.acceleration, fast, sizeof(settings.acceleration));
    for (k = 0; k < n; k++) {
        pentapod_guard(legs + 5 * k, period, moving, pace, &settings, &memory, &report);
        feed[k] = report.feed;
        out[3 * k] = report.known;
        out[3 * k + 1] = report.stop;
        out[3 * k + 2] = report.hold;
    }
}
"""


class Compiled:
    """A machine's header, and what it computes: millimetres and degrees, XYZAB in the controller's frame."""

    def __init__(self, machine: Machine, folder: Path, flags: tuple[str, ...] = ("-O2",)) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in kinematics_files(machine, COMPONENTS[0], 1e-3).items():
            (folder / name).write_bytes(content)
        (folder / "calls.c").write_text(CALLS, encoding="utf-8")
        made = [COMPILER, *STRICT, *flags, "-fPIC", "-shared", "calls.c", "-o", "calls.so", "-lm"]
        subprocess.run(made, cwd=folder, check=True, timeout=60)
        self.library = ctypes.CDLL(str(folder / "calls.so"))
        self.library.lines.restype = self.library.worlds.restype = ctypes.c_long

    def lines(self, legs: np.ndarray) -> np.ndarray:
        """Points (mm) and directions (N, 6), machine frame; NaN where there is no pose."""
        out = np.empty((len(legs), 6))
        self.library.lines(len(legs), _at(legs := np.ascontiguousarray(legs)), _at(out))
        return out

    def worlds(self, legs: np.ndarray) -> np.ndarray:
        """XYZAB (N, 5)."""
        out = np.empty((len(legs), 5))
        self.library.worlds(len(legs), _at(legs := np.ascontiguousarray(legs)), _at(out))
        return out

    def inverses(self, worlds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Legs (N, 5), mm, and margins (N, 7)."""
        legs, margins = np.empty((len(worlds), 5)), np.empty((len(worlds), len(MARGINS)))
        self.library.inverses(len(worlds), _at(worlds := np.ascontiguousarray(worlds)), _at(legs), _at(margins))
        return legs, margins

    def others(self, legs: np.ndarray, slack: float) -> np.ndarray:
        """How many poses of other components are possible (N,)."""
        out = np.empty(len(legs), dtype=np.intc)
        self.library.others(len(legs), _at(legs := np.ascontiguousarray(legs)), ctypes.c_double(slack), _at(out))
        return out

    def guards(self, legs: np.ndarray, moving: bool, least: np.ndarray, fast: np.ndarray) -> np.ndarray:
        """Known, stop, hold (N, 3) of rows of legs, a millisecond apart."""
        return self.guarded(legs, moving, 1.0, least, fast)[0]

    def guarded(
        self, legs: np.ndarray, moving: bool, pace: float, least: np.ndarray, fast: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The same, and by what the feed must be multiplied (N,). pace: share of the speed that is asked for."""
        out, feed = np.empty((len(legs), 3), dtype=np.intc), np.empty(len(legs))
        arrays = (
            _at(least := np.ascontiguousarray(least)), _at(fast := np.ascontiguousarray(fast)), _at(out), _at(feed)
        )  # fmt: skip
        legs = np.ascontiguousarray(legs)
        self.library.guards(len(legs), _at(legs), ctypes.c_double(1e-3), int(moving), ctypes.c_double(pace), *arrays)
        return out, feed


def _at(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


def random_machine(seed: int) -> Machine:
    """A machine near `desk`: base joints moved by up to 60 mm, another slope, platform joints shifted."""
    desk, rng = Machine.load("desk"), np.random.default_rng(seed)
    base = desk.robot.base + rng.uniform(-0.06, 0.06, (5, 2))
    delta, third = rng.uniform(0.12, 0.22), rng.uniform(-0.02, 0.02)
    offsets = third + delta * (base[:, 0] - base[2, 0]) + float(desk.robot.offsets[2])
    return dataclasses.replace(desk, robot=LinearPentapod.from_offsets(base, offsets, delta))


def calibrated(seed: int, ring: float = 0.0) -> Machine:
    """`desk` as built: joints off by up to 0.2 mm, zeros of 0.5 mm, rings of up to `ring` metres."""
    desk, rng = Machine.load("desk"), np.random.default_rng(seed)
    robot = AsBuiltPentapod.of(
        desk.robot,
        base_errors=rng.uniform(-2e-4, 2e-4, (5, 3)), offset_errors=rng.uniform(-2e-4, 2e-4, 5),
        zeros=rng.uniform(-5e-4, 5e-4, 5), radii=rng.uniform(0.0, ring, 5),
    )  # fmt: skip
    return dataclasses.replace(desk, robot=robot)


def poses(machine: Machine, count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Points and directions (N, 3) in the component within strokes, 20 mm from S = 0, w at least 0.1; metres."""
    rng, found = np.random.default_rng(seed), []
    while sum(len(p) for p, _ in found) < count:
        size = min(4 * count, 200_000) + 100
        tips = machine.work.centre + rng.uniform(-0.45, 0.45, (size, 3))
        i = rng.normal(size=(size, 3)) * [0.6, 0.6, 0.2] + [0.0, 0.0, 1.0]
        i /= np.linalg.norm(i, axis=1, keepdims=True)
        p = tips - machine.tool_length * i
        legs = machine.robot.leg_lengths(p, i)
        w, s = machine.robot.singularity_margins(list(p.T), list(i.T), COMPONENTS[0], numpy_arithmetic())
        good = (w > 0.1) & (s > 0.02)
        good &= ((legs > machine.legs.min_length) & (legs < machine.legs.max_length)).all(axis=1)
        found.append((p[good], i[good]))
    return tuple(np.concatenate(part)[:count] for part in zip(*found, strict=True))


def numpy_arithmetic():
    from pentapod.kinematics.arithmetic import NUMPY

    return NUMPY


def world_of(machine: Machine, p: np.ndarray, i: np.ndarray) -> np.ndarray:
    """XYZAB (N, 5) of poses, by formulas of the tests: mm and degrees."""
    turned = np.array([1.0, -1.0, -1.0])
    tips = 1e3 * (p + machine.tool_length * i - machine.work.centre) * turned
    axes = -i * turned
    a, b = np.arcsin(-axes[:, 1]), np.arctan2(axes[:, 0], axes[:, 2])
    return np.column_stack([tips, np.degrees(a), np.degrees(b)])
