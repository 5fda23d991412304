"""HDF5: datasets `time_s` (N,), `legs_mm` (N, n_legs) with units, the header as an attribute. Needs h5py.

`laser_power` (N,) is a dataset too, where the program has one.
"""

from __future__ import annotations

import io
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from pentapod.base.archives import MOST_UNPACKED, read_arrays
from pentapod.base.display import load_extra
from pentapod.base.errors import ProgramError
from pentapod.base.files import read_bytes
from pentapod.program.csv_rows import POWER
from pentapod.program.header import header_text
from pentapod.program.posts.registry import Post, PostInput, register
from pentapod.program.posts.rows import of_archive
from pentapod.program.program import Program
from pentapod.program.resolution import to_millimetres

_FILE = "program.h5"
MOST_SECONDS = 8  # of computing
TOO_LARGE = 4  # exit code of the process below
MOST_MEMORY = 2 * MOST_UNPACKED + 2_000_000_000  # bytes: the array, its copy as it is written, and the libraries
_CHILD = """
import sys
import h5py
import numpy as np
source, target, most, seconds, memory = sys.argv[1:]
try:
    import resource
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds)))
    resource.setrlimit(resource.RLIMIT_AS, (int(memory), int(memory)))
except (ImportError, OSError, ValueError):  # Windows has no limits, macOS not all, and lower ones may be set
    pass
with h5py.File(source, "r") as archive:
    header, arrays = str(archive.attrs["header"]), {}
    for name in ("legs_mm", "laser_power"):
        if name not in archive and name != "legs_mm":
            continue
        values = archive[name]
        if values.is_virtual or values.external or values.dtype.kind not in "fiu" or values.dtype.itemsize > 8:
            sys.exit(1)
        count = 1
        for length in values.shape:
            count *= int(length)
        if 8 * count > int(most):
            sys.exit(4)
        arrays[name] = np.asarray(values, dtype=np.float64)
    np.savez(target, header=np.array(header), **arrays)
"""


def _h5py() -> Any:
    return load_extra("h5py", "hdf5", "this post needs h5py", key="hdf5")


def _write(given: PostInput) -> dict[str, bytes]:
    packed, program = io.BytesIO(), given.program
    with _h5py().File(packed, "w") as archive:
        archive.attrs["header"] = header_text(program)
        for name, values, unit in (("time_s", program.times, "s"), ("legs_mm", to_millimetres(program.legs), "mm")):
            archive.create_dataset(name, data=values).attrs["unit"] = unit
        if program.laser_power is not None:
            archive.create_dataset(POWER, data=program.laser_power)
    return {_FILE: packed.getvalue()}


def _read(folder: Path) -> Program:
    """Return the program. h5py runs in a process of its own, because there are files for which it does not end."""
    file = folder / _FILE
    _h5py()
    read_bytes(file, ProgramError, "an HDF5 file")
    with tempfile.TemporaryDirectory() as place:
        unpacked = Path(place) / "arrays.npz"
        limits = [str(MOST_UNPACKED), str(MOST_SECONDS), str(MOST_MEMORY)]
        command = [sys.executable, "-c", _CHILD, str(file), str(unpacked), *limits]
        try:
            done = subprocess.run(command, capture_output=True, check=False, timeout=12 * MOST_SECONDS)
            code = done.returncode
        except subprocess.TimeoutExpired:
            code = None
        if code == TOO_LARGE:
            expected = f"at most {MOST_UNPACKED / 1e6:,.0f} MB unpacked"
            raise ProgramError("the array is too large", file=file, key="legs_mm", expected=expected)
        if code != 0 or not unpacked.exists():
            raise ProgramError("not an HDF5 file of a program, or a broken one", file=file)
        arrays = read_arrays(unpacked, ("header", "legs_mm"), ProgramError, optional=(POWER,))
    return of_archive(arrays["header"], arrays["legs_mm"], arrays.get(POWER), file)


HDF5 = register(Post("hdf5", "HDF5 archive (extra hdf5)", _write, _read))
