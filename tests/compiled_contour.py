"""The header of the contour correction, compiled and called through ctypes: by itself, and around drives that lag."""

from __future__ import annotations

import ctypes
import dataclasses
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compiled_kinematics import COMPILER, STRICT
from pentapod.kinematics.component import COMPONENTS
from pentapod.machine import Drives, Machine
from pentapod.program.posts.linuxcnc.kinematics import kinematics_files
from pentapod.simulate import Reference, contour_errors
from short_motion import motion

CALLS = """
#include "pentapod_contour.h"
#include <string.h>

/* Rows of commands as the path, then each pose's error: changes of the legs and the distance of the tip. */
void errors(long n, long window, const double *path, const double *legs, double *out)
{
    long k, j;
    for (k = 0; k < n; k++) {
        pentapod_contour c;
        memset(&c, 0, sizeof(c));
        for (j = 0; j < window; j++) {
            pentapod_contour_take(&c, path + 5 * (window * k + j));
            memcpy(c.command[0], path + 5 * (window * k + j), sizeof(c.command[0]));
        }
        if (pentapod_contour_error(&c, legs + 5 * k, PENTAPOD_TOOL_LENGTH, out + 6 * k, out + 6 * k + 5))
            memset(out + 6 * k, 0xff, 6 * sizeof(double));
    }
}

/* Errors of the legs in each period, to what is asked of the drives without a bound. */
void filtered(long n, const double *error, double *out)
{
    pentapod_contour c;
    long row;
    int k;
    memset(&c, 0, sizeof(c));
    for (row = 0; row < n; row++)
        for (k = 0; k < PENTAPOD_LEGS; k++) {
            c.shift[k] = out[5 * row + k] = pentapod_contour_wanted(&c, k, error[5 * row + k], PENTAPOD_MEMORY);
            pentapod_contour_move_model(&c, k);
        }
}

/* Drives with a first-order lag: share of the way to the command that a leg goes in a period. The scale of leg `stuck`
 * stands still from row `since` on. out: corrected commands, legs, error and size (mm), active, bounded. */
void loops(long n, const double *command, const int *enable, const double *pushed, const double *share, int stuck,
           long since, double bound, double range, double ramp, double *out)
{
    pentapod_contour_settings settings = {PENTAPOD_TOOL_LENGTH, 1.0, PENTAPOD_MEMORY, 0.0, 0.0, 0.0, 0};
    pentapod_contour_report report;
    pentapod_contour c;
    double legs[PENTAPOD_LEGS], read[PENTAPOD_LEGS];
    long row;
    int k;
    memset(&c, 0, sizeof(c));
    memcpy(legs, command, sizeof(legs));
    settings.bound = bound;
    settings.range = range;
    settings.share = ramp;
    for (row = 0; row < n; row++, out += 14) {
        settings.enable = enable[row];
        for (k = 0; k < PENTAPOD_LEGS; k++)
            if (k != stuck || row < since)
                read[k] = legs[k] + pushed[5 * row + k];
        pentapod_contour_correction(command + 5 * row, read, &settings, &c, &report);
        for (k = 0; k < PENTAPOD_LEGS; k++) {
            out[k] = command[5 * row + k] + c.shift[k];
            out[5 + k] = legs[k] + pushed[5 * row + k];
            legs[k] += share[k] * (out[k] - legs[k]);
        }
        out[10] = report.error;
        out[11] = report.size;
        out[12] = report.active;
        out[13] = report.bounded;
    }
}
"""
MM = 1e3
LAGS = 1.0 / np.array([80.0, 70.0, 80.0, 90.0, 75.0])
REST = 300
CHANGE_MM = 0.1 * 5000e-6
"""Largest change of a correction's rate in a period: a tenth of the legs' acceleration."""


@dataclass(frozen=True)
class Run:
    """What the legs did, mm: corrected commands and legs (N, 5), error and size (N,), active and bounded (N,)."""

    commands: np.ndarray
    legs: np.ndarray
    errors: np.ndarray
    sizes: np.ndarray
    active: np.ndarray
    bounded: np.ndarray


class Contour:
    """A machine's correction."""

    def __init__(self, machine: Machine, folder: Path, flags: tuple[str, ...] = ("-O2",)) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in kinematics_files(machine, COMPONENTS[0], 1e-3).items():
            (folder / name).write_bytes(content)
        (folder / "contour_calls.c").write_text(CALLS, encoding="utf-8")
        made = [COMPILER, *STRICT, *flags, "-fPIC", "-shared", "contour_calls.c", "-o", "contour.so", "-lm"]
        subprocess.run(made, cwd=folder, check=True, timeout=60)
        self.library = ctypes.CDLL(str(folder / "contour.so"))

    def errors(self, paths: np.ndarray, legs: np.ndarray) -> np.ndarray:
        """Changes of the legs that lead back to the path, and the tip's way to it (N, 6), mm; paths (N, K, 5)."""
        out, paths, legs = np.empty((len(legs), 6)), np.ascontiguousarray(paths), np.ascontiguousarray(legs)
        self.library.errors(*map(ctypes.c_long, paths.shape[:2]), _at(paths), _at(legs), _at(out))
        return out

    def filtered(self, errors: np.ndarray) -> np.ndarray:
        """What is asked of the drives for errors of the legs (N, 5) of one period after the other, mm."""
        out, errors = np.empty_like(errors), np.ascontiguousarray(errors)
        self.library.filtered(ctypes.c_long(len(errors)), _at(errors), _at(out))
        return out

    def run(
        self, commands: np.ndarray, lags: np.ndarray, enable: np.ndarray | bool = True,
        pushed: np.ndarray | float = 0.0, stuck: tuple[int, int] = (-1, 0), bound: float = 0.05,
        range_mm: float = 1.0, share: float = 0.1,
    ) -> Run:  # fmt: skip
        """Play commands (N, 5), mm, with drives that lag by `lags` (5,) seconds, a millisecond apart."""
        n, legs = len(commands), np.ascontiguousarray(commands)
        on = np.ascontiguousarray(np.broadcast_to(enable, n), dtype=np.intc)
        off = np.ascontiguousarray(np.broadcast_to(pushed, legs.shape))
        per_period, out = 1.0 - np.exp(-1e-3 / np.asarray(lags)), np.empty((n, 14))
        self.library.loops(
            ctypes.c_long(n), _at(legs), _at(on), _at(off), _at(per_period), stuck[0], ctypes.c_long(stuck[1]),
            *map(ctypes.c_double, (bound, range_mm, share)), _at(out),
        )  # fmt: skip
        return Run(out[:, :5], out[:, 5:10], out[:, 10], out[:, 11], out[:, 12] > 0.0, out[:, 13] > 0.0)


def _at(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


def lagging(machine: Machine) -> Machine:
    """Drives that do little but lag, each as long as LAGS says."""
    drives = Drives(
        position_gain=1.0 / LAGS, velocity_gain=2000.0, velocity_integral=0.0, velocity_feedforward=0.0,
        acceleration_feedforward=0.0, dead_time=0.0, ripple_force=0.0, encoder_step=0.0,
    )  # fmt: skip
    return dataclasses.replace(machine, drives=drives)


def commanded(duration: float) -> np.ndarray:
    """The short motion's legs, mm, with rest before and after."""
    legs = MM * motion(duration)[0].legs
    return np.concatenate([np.repeat(legs[:1], REST, axis=0), legs, np.repeat(legs[-1:], REST, axis=0)])


def accelerations(legs: np.ndarray) -> np.ndarray:
    """Sizes of the second differences, mm in a period squared."""
    return np.abs(np.diff(legs, 2, axis=0))


def contour_um(machine: Machine, reference: Reference, legs: np.ndarray) -> np.ndarray:
    """Contour errors (N,) of legs (N, 5), metres, at the program's rows."""
    p, i = machine.robot.pose(legs, COMPONENTS[0])
    tips, rows = p + machine.tool_length * i, 2 * np.arange(len(legs))
    return 1e6 * contour_errors(tips, i, reference.tips, reference.directions, rows, 60)[0]
