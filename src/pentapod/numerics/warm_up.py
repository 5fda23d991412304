"""Warm-up: compile all kernels at once, in several processes, before the first job needs them.

`kernel_signatures.json` names the kernels that Python calls, with the types that they are called with; kernels that
only kernels call are compiled with them. `tests/list_kernels.py` writes it from the cache that the tests have filled. A
kernel that is missing there, or is called with other types, is compiled when it is used.
"""

from __future__ import annotations

import json
import signal
from collections import defaultdict
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any, cast

from pentapod.base.errors import InputError
from pentapod.base.progress import Progress, silent
from pentapod.numerics.kernel_cache import kernel_cache

SIGNATURES = Path(__file__).with_name("kernel_signatures.json")

Signature = tuple[str, list[Any]]
"""A kernel, `module:name`, and the types of its arguments as `types_of` reads them."""


def signatures() -> list[Signature]:
    """Return the kernels and types of the list."""
    content: dict[str, list[list[Any]]] = json.loads(SIGNATURES.read_text(encoding="utf-8"))
    return [(name, arguments) for name, calls in content.items() for arguments in calls]


def warm_up(processes: int | None = None, progress: Progress = silent) -> tuple[int, int]:
    """Compile the kernels of the list, in so many processes; return how many there are, and how many were compiled.

    processes: by default one for each core. Raises InputError where what is compiled cannot be kept.
    """
    from numba import config  # noqa: PLC0415  heavy

    given: str = cast("Any", config).CACHE_DIR
    if kernel_cache(given) is None:
        raise InputError("what is compiled cannot be kept", key="NUMBA_CACHE_DIR", value=given or None,
                         expected="a folder that can be written to")  # fmt: skip
    folders: dict[str, list[Signature]] = defaultdict(list)
    for name, arguments in signatures():
        folders[name.partition(":")[0].rpartition(".")[0]].append((name, arguments))
    work = sorted(folders.values(), key=len, reverse=True)  # what shares kernels in one process, the longest first
    count, done, compiled = sum(map(len, work)), 0, 0
    progress("compile", 0.0, f"0 of {count} forms of kernels")
    with get_context("spawn").Pool(processes, initializer=_leave_interrupts) as pool:
        for found, misses in pool.imap_unordered(compile_all, work):
            done, compiled = done + found, compiled + misses
            progress("compile", done / count, f"{done} of {count} forms of kernels")
    return count, compiled


def _leave_interrupts() -> None:
    """Leave Ctrl-C to the process that started this one; it ends all of them."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def compile_all(calls: list[Signature]) -> tuple[int, int]:
    """Compile kernels for their types, or load them from the cache; return how many, and how many were not there."""
    misses = 0
    for name, arguments in calls:
        module, _, function = name.partition(":")
        dispatcher = getattr(import_module(f"pentapod.{module}"), function)
        signature = tuple(types_of(argument) for argument in arguments)
        dispatcher.compile(signature)
        misses += dispatcher.stats.cache_misses.get(signature, 0)
    return len(calls), misses


def types_of(written: Any) -> Any:
    """Return numba's type: "float64", ["array", dtype, ndim, layout, mutable], ["tuple", *types], [class, *types]."""
    from numba import types  # noqa: PLC0415  heavy

    if isinstance(written, str):
        return getattr(types, written)
    kind, *parts = written
    if kind == "array":
        dtype, ndim, layout, mutable = parts
        return types.Array(types_of(dtype), ndim, layout, readonly=not mutable)
    if kind == "tuple":
        return types.Tuple(tuple(types_of(part) for part in parts))
    module, _, name = kind.partition(":")
    return types.NamedTuple([types_of(part) for part in parts], getattr(import_module(f"pentapod.{module}"), name))
