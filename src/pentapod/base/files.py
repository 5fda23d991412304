"""Files: atomic writing, reading up to a size, hashes, .npz bytes, and strict decimal numbers."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import io
import math
import os
import secrets
import zipfile
from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from pentapod.base.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
ZIP_EPOCH = (1980, 1, 1, 0, 0, 0)


@contextmanager
def atomic_write(path: str | Path) -> Generator[Path]:
    """Yield the path of an empty temporary file beside `path`; rename it to `path` when the block succeeds.

    The temporary name keeps the suffix, since some writers look at it. When the block raises (also on
    KeyboardInterrupt) the temporary file is removed and the file at `path` is untouched.
    Raises InputError where the folder does not exist or cannot be written, `path` is a folder, or no space is left.

        with atomic_write("verdict.json") as temporary:
            temporary.write_text(text)
    """
    target = Path(path)
    temporary = target.with_name(f".{target.stem}.{secrets.token_hex(6)}{target.suffix}")
    try:
        if target.is_dir():
            raise IsADirectoryError(21, "Is a directory")
        # "x": never someone else's file; created with the user's usual permissions.
        with temporary.open("xb"):
            pass
    except OSError as error:
        raise unwritable(target, error) from error
    try:
        yield temporary
        # Otherwise a power failure after the rename may leave an empty file.
        with temporary.open("rb+") as written:
            os.fsync(written.fileno())
        temporary.replace(target)
    except OSError as error:
        # A full disk is reported without a file name, or with the temporary one.
        if (error.errno in DISK_ERRORS and error.filename is None) or error.filename in (str(temporary), temporary):
            raise unwritable(target, error) from error
        raise
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def unwritable(path: Path, error: OSError) -> InputError:
    """Return the error that says why a file cannot be written."""
    reason = (error.strerror or str(error)).lower()
    expected = "room for it on the disk" if error.errno in DISK_ERRORS else "a folder that exists and can be written"
    return InputError(f"cannot be written: {reason}", file=path, expected=expected)


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, as hex digits. Raises OSError."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def packed_arrays(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return the bytes of an .npz; they depend on the arrays alone."""
    packed = io.BytesIO()
    pack_arrays(arrays.items(), packed)
    return packed.getvalue()


def pack_arrays(arrays: Iterable[tuple[str, NDArray[Any]]], target: IO[bytes]) -> None:
    """Write an .npz of named arrays, one after the other, into a file; its bytes depend on the arrays alone."""
    import numpy as np  # noqa: PLC0415 - the command line writes files without it

    with zipfile.ZipFile(target, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays:
            info, form = zipfile.ZipInfo(f"{name}.npy", ZIP_EPOCH), np.asarray(array, order="C")
            info.file_size = form.nbytes  # tells whether it needs large numbers; the header gets the true size
            with archive.open(info, "w") as entry:
                np.lib.format.write_array(entry, form, allow_pickle=False)


MOST_BYTES = 2_000_000_000
"""Largest file that is read into memory; programs are read in blocks and may be larger."""

BLOCK_BYTES = 1 << 20


def read_bytes(
    path: Path, wrong: type[InputError], expected: str, most: int = MOST_BYTES, start: str | None = None
) -> bytes:
    """Return the bytes of a file. Raises `wrong`: no such file, not readable, or larger than `most` bytes.

    expected: kind of file, for messages; start: how to get a first file, for messages.
    """
    try:
        with path.open("rb") as source:
            size = path.stat().st_size
            data = source.read(size) if size <= most else b""
            # Devices and pipes have no size.
            while size <= most and len(data) <= most and (more := source.read(BLOCK_BYTES)):
                data += more
    except FileNotFoundError as error:
        if start:
            raise wrong(f"no such {expected.removeprefix('a ')}", file=path, remedy=start) from error
        raise wrong("no such file", file=path, expected=expected) from error
    except IsADirectoryError as error:
        raise wrong(
            "this is a folder", file=path, expected=expected, remedy="name the one in it" if start else None
        ) from error
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise wrong(f"cannot be read: {reason}", file=path, expected=expected) from error
    except ValueError as error:  # an impossible file name
        raise wrong("no such file", file=path, expected=expected) from error
    except MemoryError as error:
        raise wrong("there is not enough memory for this file", file=path, expected=expected) from error
    size = max(size, len(data))
    if size > most:
        raise wrong(
            "the file is too large", file=path, value=f"{size / 1e6:,.1f} MB", expected=f"at most {most / 1e6:,.0f} MB"
        )
    return data


def number_in(text: str) -> float | None:
    """Return the finite number of a text in ASCII digits; None for other texts.

    `float` alone would accept 1_0, and digits of every script.
    """
    if "_" in text or not text.isascii():
        return None
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
