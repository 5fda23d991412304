"""NumPy archive: `time_s` (N,), `legs_mm` (N, 5), and the header as text."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np

from pentapod.errors import ProgramError
from pentapod.files import packed_arrays
from pentapod.program.header import header_text
from pentapod.program.posts.registry import Post, PostInput, read_file, register
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
    }
    return {_FILE: packed_arrays(arrays)}


def _read(folder: Path) -> Program:
    file = folder / _FILE
    try:
        with np.load(io.BytesIO(read_file(file)), allow_pickle=False) as archive:
            header, legs = str(archive["header"]), np.asarray(archive["legs_mm"], dtype=np.float64)
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise ProgramError("not a NumPy archive of a program, or a broken one", file=file) from error
    return of_archive(header, legs, file)


NPZ = register(Post("npz", "NumPy archive", _write, _read))
