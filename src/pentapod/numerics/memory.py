"""Memory: what was freed goes back to the system."""

from __future__ import annotations

import ctypes
import sys
from contextlib import suppress


def give_back() -> None:
    """Return freed memory to the system, where the C library can (glibc); else do nothing.

    It keeps freed arrays of less than 32 MiB for later ones of their kind. Large arrays do not fit in there, so that
    the process would grow by them.
    """
    if sys.platform.startswith("linux"):
        with suppress(OSError, AttributeError):  # another C library
            ctypes.CDLL(None).malloc_trim(0)
