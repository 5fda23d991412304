"""HDF5: datasets `time_s` (N,) and `legs_mm` (N, 5) with units, the header as an attribute. Needs h5py."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.archives import MOST_UNPACKED
from pentapod.errors import InputError, ProgramError
from pentapod.input_files import read_bytes
from pentapod.program.header import header_text
from pentapod.program.posts.registry import Post, PostInput, register
from pentapod.program.posts.rows import of_archive
from pentapod.program.program import Program
from pentapod.program.resolution import to_millimetres

_FILE = "program.h5"
_WIDEST = 8  # bytes of a number


def _h5py() -> Any:
    """Return h5py. Raises InputError where it is not installed."""
    try:
        import h5py  # noqa: PLC0415 - an extra
    except ModuleNotFoundError as error:
        raise InputError("this post needs h5py", key="hdf5", remedy='pip install "pentapod[hdf5]"') from error
    return h5py


def _write(given: PostInput) -> dict[str, bytes]:
    packed, program = io.BytesIO(), given.program
    with _h5py().File(packed, "w") as archive:
        archive.attrs["header"] = header_text(program)
        for name, values, unit in (("time_s", program.times, "s"), ("legs_mm", to_millimetres(program.legs), "mm")):
            archive.create_dataset(name, data=values).attrs["unit"] = unit
    return {_FILE: packed.getvalue()}


def _read(folder: Path) -> Program:
    file, h5py = folder / _FILE, _h5py()
    data = read_bytes(file, ProgramError, "an HDF5 file")
    try:
        with h5py.File(io.BytesIO(data), "r") as archive:
            header, legs = np.array(archive.attrs["header"]), archive["legs_mm"]
            if legs.is_virtual or legs.external or legs.dtype.kind not in "fiu" or legs.dtype.itemsize > _WIDEST:
                raise ProgramError("not numbers that the file holds itself", file=file, key="legs_mm")
            rows = math.prod(legs.shape) // 5
            if rows * 5 * legs.dtype.itemsize > MOST_UNPACKED:
                expected = f"at most {MOST_UNPACKED / 1e6:,.0f} MB unpacked"
                raise ProgramError("the array is too large", file=file, key="legs_mm", value=rows, expected=expected)
            legs_mm = np.asarray(legs, dtype=np.float64)
    except InputError:
        raise
    except Exception as error:  # of whatever kind: what is in the file decides how the library stumbles
        raise ProgramError("not an HDF5 file of a program, or a broken one", file=file) from error
    return of_archive(np.array(str(header)), legs_mm, file)


HDF5 = register(Post("hdf5", "HDF5 archive (extra hdf5)", _write, _read))
