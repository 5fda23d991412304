"""The player of the LinuxCNC post, compiled by the C compiler that is installed and called through ctypes."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import numpy as np

from compiled_kinematics import COMPILER, STRICT
from pentapod.machine import Machine
from pentapod.program import Program
from pentapod.program.posts import PostInput
from pentapod.program.posts.linuxcnc.player import COEFFICIENTS, player_files

CALLS = """
#include "pentapod_player.h"

static pentapod_player player;

static long feed(long next, long count, const double *pairs)
{
    if (next < count) {
        pentapod_take(&player, 2 * next + 2, pairs + 2 * PENTAPOD_LEGS * next);
        next += player.have > 2 * next;
    }
    return next;
}

/* wanted: the override in each tick; rows come until tick `fed`. Returns the ticks that were played. */
long play(long count, const double *pairs, long most, long fed, const double *wanted, double *legs, double *out)
{
    long n, next = 0;
    pentapod_begin(&player, PENTAPOD_ROWS);
    while (!player.started) {
        next = feed(next, count, pairs);
        pentapod_play(&player, 0.0, legs);
    }
    for (n = 0; n < most && !player.done; n++) {
        if (n < fed)
            next = feed(next, count, pairs);
        pentapod_play(&player, wanted[n], legs + PENTAPOD_LEGS * n);
        out[3 * n] = player.place;
        out[3 * n + 1] = player.pace;
        out[3 * n + 2] = (double)(player.starved + 2 * player.underrun);
    }
    return n;
}
"""


class CompiledPlayer:
    """A program's player: what it makes of overrides. Metres, and periods of the program."""

    def __init__(self, program: Program, machine: Machine, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in player_files(PostInput(program, machine)).items():
            (folder / name).write_bytes(content)
        (folder / "calls.c").write_text(CALLS, encoding="utf-8")
        made = [COMPILER, *STRICT, "-O2", "-fPIC", "-shared", "calls.c", "-o", "calls.so"]
        subprocess.run(made, cwd=folder, check=True, timeout=60)
        self.library = ctypes.CDLL(str(folder / "calls.so"))
        self.library.play.restype = ctypes.c_long
        self.pairs = np.ascontiguousarray(np.loadtxt(folder / COEFFICIENTS)[:, 1:])
        self.legs = program.legs.shape[1]

    def play(self, wanted: np.ndarray, fed: int = 1 << 40) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Legs (n, legs), rows of the program, paces and states (n,): 1 starved, 2 out of rows."""
        legs, out = np.empty((len(wanted), self.legs)), np.empty((len(wanted), 3))
        wanted = np.ascontiguousarray(wanted, dtype=np.float64)
        numbers = [ctypes.c_long(k) for k in (len(self.pairs), len(wanted), fed)]
        at = [array.ctypes.data_as(ctypes.c_void_p) for array in (self.pairs, wanted, legs, out)]
        count = self.library.play(numbers[0], at[0], numbers[1], numbers[2], *at[1:])
        return legs[:count] * 1e-3, out[:count, 0], out[:count, 1], out[:count, 2]
