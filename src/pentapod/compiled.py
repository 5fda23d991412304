"""Kernels compiled by numba: where plain loops over a million poses or gridpoints are the clearest and fastest form.

Files named `*_kernels.py` hold them, each function marked with `kernel`; they are imported where they are first used,
so that `import pentapod` stays light. The machine code is cached on disk, beside the file or in the user's
cache folder: only the first run of a version on a machine compiles, and says so to the log `pentapod`.

Loading numba takes about as long as NumPy needs for ten million poses. So work that NumPy can do as well, to the
last bit, asks `kernels_pay` before it loads kernels: like a skier who rents until the rents add up to a pair of skis,
it stays with NumPy until the time lost so far would have paid for loading. Which of the two did the work cannot be
told from the result.
"""

from __future__ import annotations

import hashlib
import logging
import os
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal, TypeVar, cast

_log = logging.getLogger("pentapod")

_Function = TypeVar("_Function", bound=Callable[..., object])
_Policy = Literal["when they pay", "always", "never"]

_policy: ContextVar[_Policy] = ContextVar("kernels", default="when they pay")
_lost = [0.0]  # seconds that kernels would have saved so far
_NUMBA, _CACHED = 0.5, 0.05  # seconds: loading numba, and kernels from the cache once it is there


@cache
def kernels_available() -> bool:
    """Return whether numba can be had; PENTAPOD_NUMPY_ONLY=1 in the environment says no."""
    return os.environ.get("PENTAPOD_NUMPY_ONLY", "") != "1" and find_spec("numba") is not None


def kernels_pay(saved: float) -> bool:
    """Return whether to use kernels for work on which they save this many seconds. See the module's docstring."""
    policy = _policy.get()
    if policy == "never" or not kernels_available():
        return False
    _lost[0] += saved
    return policy == "always" or _lost[0] > (_CACHED if "numba" in sys.modules else _NUMBA)


@contextmanager
def kernels_used(policy: _Policy) -> Generator[None]:
    """Use kernels always, never or when they pay, within a `with` block."""
    token = _policy.set(policy)
    try:
        yield
    finally:
        _policy.reset(token)


def kernel(function: _Function) -> _Function:
    """Compile a function on its first call; division by zero gives infinity, as in NumPy, and sums keep their order.

    Where numba cannot be had the function stays as it is: right, and slow.
    """
    if not kernels_available():
        return function
    from numba import njit  # noqa: PLC0415  heavy: only where kernels are used

    _announce_compiling()
    compiled: Any = njit(cache=True, error_model="numpy", fastmath=False)(function)
    # A kernel holds the machine code of those it calls, but numba looks for changes in the kernel's own file only. With
    # the others in its stamp, what was compiled for an older version is never taken for that of a newer one.
    stored = compiled._cache._cache_file
    stored._source_stamp = (stored._source_stamp, _digest())
    return cast("_Function", compiled)


@cache
def _digest() -> str:
    """Return a digest of all files with kernels."""
    files = sorted(Path(__file__).parent.rglob("*_kernels.py"))
    return hashlib.sha256(b"\0".join(file.read_bytes() for file in files)).hexdigest()


@cache
def _announce_compiling() -> None:
    """See to it that the log says once when this process begins to compile: it takes long and shows nothing else."""
    from numba.core import event  # noqa: PLC0415

    class Told(event.Listener):
        """Says it at the first compilation; what comes from the cache is none."""

        said = False

        def on_start(self, event: object) -> None:
            if not self.said:
                self.said = True
                _log.info("compiling the fast kernels: once on this machine, for half a minute or so")

        def on_end(self, event: object) -> None:
            """Nothing to say."""

    event.register("numba:compile", Told())
