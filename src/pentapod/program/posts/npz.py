"""NumPy archive: `time_s` (N,), `legs_mm` (N, n_legs), the header as text; `laser_power` (N,) where there is one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pentapod.base.archives import read_arrays
from pentapod.base.errors import ProgramError
from pentapod.base.files import packed_arrays
from pentapod.program.csv_rows import POWER
from pentapod.program.header import header_text
from pentapod.program.posts.registry import Post, PostInput, register
from pentapod.program.posts.rows import of_archive
from pentapod.program.program import Program
from pentapod.program.resolution import to_millimetres

_FILE = "program.npz"


def _write(given: PostInput) -> dict[str, bytes]:
    program = given.program
    arrays = {
        "header": np.array(header_text(program)),
        "time_s": program.times,
        "legs_mm": to_millimetres(program.legs),
        **({} if program.laser_power is None else {POWER: program.laser_power}),
    }
    return {_FILE: packed_arrays(arrays)}


def _read(folder: Path) -> Program:
    file = folder / _FILE
    arrays = read_arrays(file, ("header", "legs_mm"), ProgramError, optional=(POWER,))
    return of_archive(arrays["header"], arrays["legs_mm"], arrays.get(POWER), file)


NPZ = register(Post("npz", "NumPy archive", _write, _read))
