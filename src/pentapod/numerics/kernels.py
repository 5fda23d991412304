"""Kernels compiled by numba: plain loops over up to a million poses or gridpoints.

Files named `*_kernels.py` hold them, each function marked with `kernel` or `inlined_kernel`; they are imported
where they are first used, so that `import pentapod` stays light. The machine code is cached on disk (`kernel_cache`):
only the first run of a version on a machine compiles, and says so to the log `pentapod`.

Loading numba and a kernel takes 0.4 s, as long as NumPy needs for ten million poses. So leg lengths and poses of the
quadratic family have a second form in NumPy, equal to the last bit: with kernels alone `pentapod ik` would take 1.1 s
for 0.7 s, with NumPy alone a million poses 90 ms for 14 ms. They ask `kernels_pay`, which adds up the time that kernels
would have saved so far, and loads them once that is more than loading takes. Results do not tell which form was used.
"""

from __future__ import annotations

import logging
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import Any, Literal, TypeVar, cast

from pentapod.numerics.kernel_cache import ProcessLock, kernel_cache

_log = logging.getLogger("pentapod")

_Function = TypeVar("_Function", bound=Callable[..., object])
_Policy = Literal["when they pay", "always", "never"]

_choosing = threading.Lock()
_policy: ContextVar[_Policy] = ContextVar("kernels", default="when they pay")
_saved = [0.0]  # seconds that kernels would have saved so far
_NUMBA, _CACHED = 0.5, 0.05  # seconds: loading numba, and kernels from the cache once it is there


def kernels_pay(saved: float) -> bool:
    """Return whether to use kernels for work on which they save this many seconds. See the module's docstring."""
    policy = _policy.get()
    if policy == "never":
        return False
    _saved[0] += saved
    return policy == "always" or _saved[0] > (_CACHED if "numba" in sys.modules else _NUMBA)


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

    It is compiled once for all values of its numbers, constants too, and without entries that nothing uses: a name with
    an underscore is called by kernels only.
    """
    return _compiled(function, inlined=False)


def inlined_kernel(function: _Function) -> _Function:
    """As `kernel`; where kernels call it, it becomes part of them. For short functions with arrays, in inner loops.

    A call passes seven numbers for each array, and counts references to it. Without such calls searches for the
    deepest facet take 0.6 to 0.8 of the time, with equal bits. Long functions gain nothing, and compile longer.
    """
    return _compiled(function, inlined=True)


def _compiled(function: _Function, *, inlined: bool) -> _Function:
    from numba import config, njit, types  # noqa: PLC0415  heavy: only where kernels are used

    unliteral: Any = types.unliteral
    settings: Any = config  # made from the environment as it is loaded
    options: dict[str, Any] = {"error_model": "numpy", "fastmath": False, "nogil": True, "no_cfunc_wrapper": True}
    options["forceinline"] = inlined
    options["no_cpython_wrapper"] = function.__name__.startswith("_")
    with _choosing:
        given: str = settings.CACHE_DIR
        folder = kernel_cache(given)
        _listen()
        if folder is None:
            return cast("_Function", njit(**options)(function))
        # numba asks for the folder here only; what else the process compiles goes where it went.
        settings.CACHE_DIR = str(folder)
        try:
            dispatcher: Any = njit(cache=True, **options)(function)
        finally:
            settings.CACHE_DIR = given
    if settings.DISABLE_JIT:
        return cast("_Function", dispatcher)
    lock = ProcessLock(folder / f"{function.__module__}.{function.__qualname__}.lock")
    compile_alone = dispatcher.compile

    def compile_once(signature: Any) -> Any:
        """Compile under the kernel's lock: from the look into the cache to the entry in it."""
        with lock:
            return compile_alone(tuple(unliteral(kind) for kind in signature))

    dispatcher.compile = compile_once
    return cast("_Function", dispatcher)


@cache
def _listen() -> None:
    """Write to the log once when this process begins to compile: it takes long."""
    from numba.core import event  # noqa: PLC0415

    class CompileMessage(event.Listener):
        """Writes to the log at the first compilation; loading from the cache is none."""

        said = False

        def on_start(self, event: object) -> None:
            if not self.said:
                self.said = True
                _log.info(
                    "compiling the fast kernels: once on this machine, for a minute or so; "
                    "`pentapod warm-up` does it for all of them, on all cores"
                )

        def on_end(self, event: object) -> None:
            """Nothing to say."""

    event.register("numba:compile", CompileMessage())
