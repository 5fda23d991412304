"""Threads: independent pieces of work on all cores, and linear algebra on one thread.

Kernels and operations on large arrays leave the interpreter to other threads.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence, Sized
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextvars import copy_context
from functools import cache, wraps
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy.typing as npt

from pentapod.numerics.blocks import blocks

if TYPE_CHECKING:
    from scipy.spatial import KDTree

Array = npt.NDArray[Any]
_Item = TypeVar("_Item")
_Result = TypeVar("_Result")
_Other = TypeVar("_Other")
_P = ParamSpec("_P")
_R = TypeVar("_R")


CORES = "PENTAPOD_CORES"
"""Environment variable: how many cores a process uses, where others work beside it."""


def cores() -> int:
    """Return how many cores this process may use: as the environment variable says, else all it is allowed."""
    given = os.environ.get(CORES, "")
    if given.isdecimal() and int(given) > 0:
        return int(given)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_threads(
    function: Callable[[_Item], _Result], items: Iterable[_Item], threads: int | None = None, ahead: int | None = None
) -> Iterator[_Result]:
    """Yield function(item) for all items, in their order; the same results for any number of threads.

    threads: by default one for each core; with 1 all is done in this one. ahead: how many items are begun ahead of the
    result that is asked for; by default as many as threads, so that few results are held.
    """
    count = threads or cores()
    if isinstance(items, Sized):
        count = min(count, len(items))
    if count <= 1:
        yield from map(function, items)
        return
    with ThreadPoolExecutor(count) as pool:
        begun: deque[Future[_Result]] = deque()
        try:
            for item in items:
                begun.append(pool.submit(copy_context().run, function, item))
                if len(begun) > (count if ahead is None else ahead):
                    yield begun.popleft().result()
            while begun:
                yield begun.popleft().result()
        finally:
            for future in begun:
                future.cancel()


@cache
def _helpers() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(os.cpu_count(), "pentapod")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_helpers.cache_clear)  # threads stay with the parent


def on_all_cores(function: Callable[[_Item], _Result], items: Sequence[_Item]) -> list[_Result]:
    """Return function(item) for all items, done by this thread and by helpers beside it; for milliseconds of kernels.

    Helpers stay for later calls, and take the next item by themselves. To begin threads for each call, and to wake this
    one for each item, costs up to half of what two cores gain on 5 ms. This thread never waits for a helper that has
    not begun: so functions may call this again.
    """
    count = min(cores(), len(items))
    if count <= 1:
        return [function(item) for item in items]
    found, waiting = dict[int, _Result](), iter(range(len(items)))

    def work() -> None:
        try:
            for k in waiting:
                found[k] = function(items[k])
        except BaseException:
            deque(waiting, maxlen=0)  # nothing else is begun
            raise

    helpers = [_helpers().submit(copy_context().run, work) for _ in range(count - 1)]
    try:
        work()
    finally:
        begun = [helper for helper in helpers if not helper.cancel()]
        wait(begun)
    for helper in begun:
        helper.result()
    return [found[k] for k in range(len(items))]


def both(first: Callable[[], _Result], second: Callable[[], _Other]) -> tuple[_Result, _Other]:
    """Return what two functions return, which work beside each other where there are cores."""
    results: list[Any] = list(in_threads(lambda each: each(), (first, second)))
    return results[0], results[1]


MANY_POINTS = 5_000
"""More points than these are looked up on all cores: some milliseconds of work."""


def nearest_points(tree: KDTree, points: Array, **asked: Any) -> tuple[Any, Any]:
    """Return `tree.query(points, **asked)`, distances and indices, found on all cores where there are many points."""
    return tree.query(points, workers=cores() if len(points) > MANY_POINTS else 1, **asked)


ROWS = 2048
"""Rows that a thread takes at a time: some milliseconds of a kernel that searches a mesh for each."""

BLOCKS, LEAST_ROWS = 8, 64
"""Into how many blocks fewer rows are divided, so that all cores have some, and how many are worth a thread."""


def for_rows(
    kernel: Callable[..., object], rows: tuple[Array, ...], given: tuple[object, ...], filled: tuple[Array, ...]
) -> None:
    """Call kernel(*rows, *given, *filled) with blocks of the rows, and of the rows that it fills, on all cores.

    The blocks do not depend on the number of threads. So what is filled does not either, even where a row begins with
    what the one before it in its block has found.
    """
    count = len(filled[0])
    size = min(max(-(-count // BLOCKS), LEAST_ROWS), ROWS)

    def done(k: slice) -> None:
        kernel(*(array[k] for array in rows), *given, *(array[k] for array in filled))

    on_all_cores(done, list(blocks(count, size)))


def on_one_thread(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return the function with BLAS on one thread: on several it adds in another order, and last bits differ.

    On one kind of processor and with one set of libraries, that is: they choose the order of sums too. The matrices of
    a plan are small; more threads gain nothing on them.
    """

    @wraps(function)
    def limited(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        from threadpoolctl import threadpool_limits  # noqa: PLC0415  only when planning

        with threadpool_limits(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited
