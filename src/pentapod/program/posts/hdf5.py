"""HDF5: datasets `time_s` (N,) and `legs_mm` (N, 5) with units, the header as an attribute. Needs h5py."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.errors import InputError, ProgramError
from pentapod.program.header import header_text
from pentapod.program.posts.registry import Post, PostInput, read_file, register
from pentapod.program.posts.rows import of_archive
from pentapod.program.program import Program
from pentapod.program.resolution import to_millimetres

_FILE = "program.h5"


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
    try:
        with h5py.File(io.BytesIO(read_file(file)), "r") as archive:
            header, legs = str(archive.attrs["header"]), np.asarray(archive["legs_mm"], dtype=np.float64)
    except (OSError, KeyError, ValueError) as error:
        raise ProgramError("not an HDF5 file of a program, or a broken one", file=file) from error
    return of_archive(header, legs, file)


HDF5 = register(Post("hdf5", "HDF5 archive (extra hdf5)", _write, _read))
