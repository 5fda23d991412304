"""Kernels compiled by numba: where plain loops over a million poses or gridpoints are the clearest and fastest form.

Files named `*_kernels.py` hold them, each function marked with `kernel`; they are imported where they are first used,
so that `import pentapod` stays light. The machine code is cached on disk, beside the file or in the user's
cache folder: only the first run on a machine compiles.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from typing import TypeVar, cast

_Function = TypeVar("_Function", bound=Callable[..., object])


@cache
def kernels_available() -> bool:
    """Return whether numba can be had; PENTAPOD_NUMPY_ONLY=1 in the environment says no."""
    return os.environ.get("PENTAPOD_NUMPY_ONLY", "") != "1" and find_spec("numba") is not None


def kernel(function: _Function) -> _Function:
    """Compile a function on its first call; division by zero gives infinity, as in NumPy, and sums keep their order."""
    from numba import njit  # noqa: PLC0415  heavy: only where kernels are used

    return cast("_Function", njit(cache=True, error_model="numpy", fastmath=False)(function))
