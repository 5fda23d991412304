"""The LinuxCNC player without LinuxCNC: its C source, compiled here, plays a program with changes of the override."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.base.values import Value
from pentapod.machine.machine import Machine
from pentapod.program.posts.linuxcnc.config import packaged
from pentapod.program.posts.linuxcnc.player import coefficient_table, numbers_text
from pentapod.program.posts.motion import lengths_at
from pentapod.program.program import Program

FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared")
COMPILERS = ("cc", "gcc", "clang")
SECONDS_TO_COMPILE = 120.0
NO_END = 1 << 62
_LIMITS = (("velocity", "max_velocity"), ("acceleration", "max_acceleration"), ("jerk", "max_jerk"))


@dataclass(frozen=True, eq=False)
class PacedRun(Value):
    """What was played: legs (n, n_legs), metres, at each period; row of the program (n,), pace (n,).

    states (n,): 1 where rows came too slowly, 2 where they were missing.
    """

    program: Program
    machine: Machine
    legs: Floats
    rows: Floats
    paces: Floats
    states: Floats

    @property
    def shares(self) -> dict[str, float]:
        """The largest share of each limit that differences of the legs use, at rest before and after."""
        legs, period = np.concatenate([self.legs[:1].repeat(3, 0), self.legs, self.legs[-1:].repeat(3, 0)]), 1.0
        found = dict[str, float]()
        for name, limit in _LIMITS:
            legs, period = np.diff(legs, axis=0), period * self.program.period
            found[name] = float(np.abs(legs / (period * getattr(self.machine.legs, limit))).max())
        return found

    @property
    def off_path(self) -> float:
        """Largest difference of a leg from the program at the row that is played, metres."""
        return float(np.abs(self.legs - lengths_at(self.program, self.rows * self.program.period)).max())


class Player:
    """A program's player, compiled. Raises InputError: there is no C compiler."""

    def __init__(self, program: Program, machine: Machine) -> None:
        """machine: that of the program."""
        compiler = next((found for name in COMPILERS if (found := shutil.which(name))), None)
        if compiler is None:
            remedy = "install one, such as the package gcc; or play the post's player/ in LinuxCNC"
            raise InputError("the player is C, and there is no compiler", key="cc", remedy=remedy)
        self._program, self._machine = program, machine
        self._pairs = np.ascontiguousarray(coefficient_table(program)[:, 1:])
        with tempfile.TemporaryDirectory() as folder:
            at = Path(folder)
            for name in ("pentapod_player.h", "calls.c"):
                (at / name).write_bytes(packaged(f"player/{name}"))
            (at / "player_numbers.h").write_text(numbers_text(machine, program), encoding="utf-8")
            words = [compiler, *FLAGS, "calls.c", "-o", "calls.so"]
            made = subprocess.run(
                words, cwd=at, check=False, timeout=SECONDS_TO_COMPILE, capture_output=True, text=True
            )
            if made.returncode != 0:
                raise InputError("the compiler cannot build the player", key=compiler, value=made.stderr[-150:])
            self._library = ctypes.CDLL(str(at / "calls.so"))
        self._library.play.restype = ctypes.c_long

    def play(self, wanted: Floats, fed: int = NO_END) -> PacedRun:
        """Return what is played to the end, or for as many periods as there are overrides, `wanted` (n,).

        fed: period from which no more rows come.
        """
        given = np.ascontiguousarray(wanted, dtype=np.float64)
        legs, out = np.empty((len(given), self._program.legs.shape[1])), np.empty((len(given), 3))
        counts = [ctypes.c_long(k) for k in (len(self._pairs), len(given), fed)]
        at = [array.ctypes.data_as(ctypes.c_void_p) for array in (self._pairs, given, legs, out)]
        n = int(self._library.play(counts[0], at[0], counts[1], counts[2], *at[1:]))
        return PacedRun(self._program, self._machine, 1e-3 * legs[:n], out[:n, 0], out[:n, 1], out[:n, 2])
