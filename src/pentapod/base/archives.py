"""NumPy archives (.npz): read arrays by name; every size is checked before memory is allocated.

Readers that may not end, or end the interpreter, run in a process of their own, which writes such an archive.
"""

from __future__ import annotations

import io
import subprocess
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pentapod.base.errors import InputError
from pentapod.base.files import read_bytes

if TYPE_CHECKING:
    from numpy.typing import NDArray

MOST_UNPACKED, MOST_TEXT = 1_000_000_000, 50_000_000
"""Bytes, unpacked, of the arrays of one archive, and of an array of text."""

MOST_ENTRIES = 1_000
"""Files in one archive."""

REFUSED = 4
"""Exit code of a process of `arrays_of_process` that says what is wrong."""

_PROCESS = """
import runpy, sys
try:
    import resource
    resource.setrlimit(resource.RLIMIT_CPU, (int(sys.argv[2]), int(sys.argv[2])))
    resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[3]), int(sys.argv[3])))
except (ImportError, OSError, ValueError):  # Windows has no limits, macOS not all, and lower ones may be set
    pass
script, sys.argv = sys.argv[1], sys.argv[1:2] + sys.argv[4:]
runpy.run_path(script, run_name="__main__")
"""
_VERSIONS = ((1, 0), (2, 0))
_ENTRY = b"PK\x01\x02"
_PLAIN = frozenset("biufU")
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def read_arrays(
    path: Path, names: Iterable[str], wrong: type[InputError], optional: Iterable[str] = ()
) -> dict[str, NDArray[Any]]:
    """Return arrays of an .npz by name, numbers, truth values or text; `optional` ones only if present.

    Raises `wrong`: no such file, no NumPy archive, broken, an array missing or of another kind, or larger than
    `MOST_UNPACKED`. No more memory is allocated than the archive needs.
    """
    data = read_bytes(path, wrong, "an .npz file")
    if not data.startswith(b"PK"):
        raise wrong("not a NumPy archive", file=path, expected="an .npz file")
    # zipfile makes an object for each entry, however small.
    if data.count(_ENTRY) > MOST_ENTRIES:
        raise wrong("an archive of too many files", file=path, expected=f"at most {MOST_ENTRIES:,}")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return _arrays(archive, path, tuple(names), tuple(optional), wrong)
    except InputError:
        raise
    except (zipfile.BadZipFile, zlib.error, OSError, EOFError, RuntimeError, NotImplementedError, MemoryError) as error:
        raise _broken(path, wrong) from error
    except (ValueError, KeyError, TypeError, SyntaxError, IndexError, OverflowError) as error:
        raise _broken(path, wrong) from error


def arrays_of_process(
    script: Path,
    source: Path,
    arguments: Iterable[object],
    names: Iterable[str],
    wrong: type[InputError],
    seconds: int,
    memory: int,
) -> dict[str, NDArray[Any]] | str:
    """Return the arrays that a script writes, or what it says is wrong with `source`; "" where it ends otherwise.

    It gets `source`, the .npz to write, and `arguments`; seconds: of computing; memory: bytes. With the exit code
    `REFUSED` the last line of its stderr is the message.
    """
    with tempfile.TemporaryDirectory() as place:
        target = Path(place) / "arrays.npz"
        limits = (script, seconds, memory)
        command = [sys.executable, "-P", "-c", _PROCESS, *map(str, (*limits, source, target, *arguments))]
        try:
            done = subprocess.run(command, capture_output=True, check=False, timeout=4 * seconds)
        except subprocess.TimeoutExpired:
            return ""
        said = done.stderr.decode("utf-8", "replace").strip().splitlines()
        if done.returncode == REFUSED and said:
            return said[-1]
        if done.returncode or not target.exists():
            return ""
        return read_arrays(target, names, wrong)


def check_array(
    values: NDArray[Any], name: str, path: Path, wrong: type[InputError], kinds: str, shape: tuple[int | None, ...]
) -> None:
    """Raise `wrong` for an array of another kind. kinds: NumPy's `dtype.kind`; shape: None for any length."""
    fits = values.ndim == len(shape) and all(b in (None, a) for a, b in zip(values.shape, shape, strict=True))
    if values.dtype.kind not in kinds or not fits:
        wanted = ", ".join("n" if length is None else str(length) for length in shape)
        raise wrong(
            "an array of another kind", file=path, key=name, value=f"{values.dtype} {values.shape}",
            expected=f"{'text' if kinds == 'U' else 'numbers'} of shape ({wanted})",
        )  # fmt: skip


def _arrays(
    archive: zipfile.ZipFile, path: Path, names: tuple[str, ...], optional: tuple[str, ...], wrong: type[InputError]
) -> dict[str, NDArray[Any]]:
    held = {entry.filename.removesuffix(".npy"): entry for entry in archive.infolist()}
    if len(held) < len(archive.infolist()):
        raise wrong("an array is in the archive twice", file=path, remedy="write it anew")
    for name in names:
        if name not in held:
            raise wrong("an array is missing", file=path, key=name)
    wanted = [name for name in dict.fromkeys((*names, *optional)) if name in held]
    unpacked = sum(held[name].file_size for name in wanted)
    if unpacked > MOST_UNPACKED:
        raise wrong(
            "the arrays are too large", file=path, value=f"{unpacked / 1e6:,.0f} MB unpacked",
            expected=f"at most {MOST_UNPACKED / 1e6:,.0f} MB",
        )  # fmt: skip
    return {name: _array(archive, held[name], name, path, wrong) for name in wanted}


def _array(
    archive: zipfile.ZipFile, entry: zipfile.ZipInfo, name: str, path: Path, wrong: type[InputError]
) -> NDArray[Any]:
    """Return one array. The size in its header must be that of its entry."""
    import numpy as np  # noqa: PLC0415 - the command line reads files without it

    if entry.compress_type not in _METHODS or entry.flag_bits & 1:
        raise wrong("an array is packed in a way that NumPy does not use", file=path, key=name, remedy="write it anew")
    # With a number of bytes the decompression stops there, whatever the archive holds.
    with archive.open(entry) as source:
        content = source.read(entry.file_size)
    head = io.BytesIO(content)
    version = np.lib.format.read_magic(head)
    if version not in _VERSIONS:
        raise _broken(path, wrong, name)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = read(head)
    if dtype.kind not in _PLAIN or dtype.hasobject:
        raise wrong("not an array of numbers or text", file=path, key=name, value=str(dtype))
    count = 1
    for length in shape:
        count *= length
    if min(shape, default=0) < 0 or head.tell() + count * dtype.itemsize != len(content):
        raise _broken(path, wrong, name)
    if dtype.kind == "U" and len(content) > MOST_TEXT:
        raise wrong("a text of too many characters", file=path, key=name, expected=f"at most {MOST_TEXT:,} bytes")
    values = np.frombuffer(content, dtype, count, head.tell()) if count * dtype.itemsize else np.empty(count, dtype)
    if dtype.kind == "U":
        "".join(values.tolist()).encode()  # raises ValueError for an invalid code point
    return values.reshape(shape, order="F" if fortran else "C")


def _broken(path: Path, wrong: type[InputError], name: str | None = None) -> InputError:
    return wrong("a broken NumPy archive: it may have been cut off", file=path, key=name, remedy="write it anew")
