"""Files that somebody gives: read up to a size, and numbers in them by one strict rule."""

from __future__ import annotations

import math
from pathlib import Path

from pentapod.base.errors import InputError

MOST_BYTES = 2_000_000_000
"""No file is read into memory beyond this size; programs are read in blocks and have no bound."""

_BLOCK = 1 << 20


def read_bytes(
    path: Path, wrong: type[InputError], expected: str, most: int = MOST_BYTES, start: str | None = None
) -> bytes:
    """Return the bytes of a file. Raises `wrong`: not there, not readable, or larger than `most` bytes.

    expected: what kind of file this should be; start: how one gets a file to start from, for messages. Devices and
    pipes are read up to `most` too.
    """
    try:
        with path.open("rb") as source:
            size = path.stat().st_size
            data = source.read(size) if size <= most else b""
            # Devices and pipes have no size.
            while size <= most and len(data) <= most and (more := source.read(_BLOCK)):
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
    except ValueError as error:  # a name that no file can have
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
    """Return the finite number that a text is; None for anything else.

    Only decimal numbers in ASCII: Python's own reading takes 1_0 for ten, and digits of every script.
    """
    if "_" in text or not text.isascii():
        return None
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
