"""Long paths: the two passes block by block, from and to disk, in constant memory; several processes on request.

The backward pass needs of what lies behind a block two numbers, the controllable speeds at its end; so blocks taken one
after the other, from the last to the first, are the pass over the whole, and likewise forwards: bit for bit, on one
kind of processor and with one set of libraries. Several processes begin their blocks a lead too late and from rest.
What they found is taken where it meets what lies behind in the very same bits, and done again where it does not; so the
bits are the same however many there are. Exact stops need nothing more: a path's pieces between them are problems of
their own.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.timing.topp.core import admitted, backward, forward
from pentapod.timing.topp.stages import Failure, Stages

BLOCK = 65_536
"""Gridpoints of a block."""

_LEAD = 2_048
_NAMES = ("s", "first", "second", "ceiling", "offset")


@dataclass(frozen=True)
class StoredStages:
    """Stages in a folder: the arrays of `Stages`, each in a file of its own (s.npy, first.npy, …), read in blocks."""

    folder: Path

    @classmethod
    def write(cls, stages: Stages, folder: Path) -> StoredStages:
        """Write stages that fit into memory; longer ones are written by whoever makes them."""
        folder.mkdir(parents=True, exist_ok=True)
        for name in _NAMES:
            np.save(folder / f"{name}.npy", getattr(stages, name))
        return cls(folder)

    def __len__(self) -> int:
        return len(self._array("s"))

    def part(self, begin: int, end: int) -> Stages:
        """Return the gridpoints from begin to before end. Raises InputError as `Stages.of` does."""
        s, first, second, ceiling = (self._array(name)[begin:end] for name in _NAMES[:-1])
        offset = self._array("offset")
        return Stages.of(s, first, second, ceiling, offset if len(offset) == 1 else offset[begin:end])

    def _array(self, name: str) -> Floats:
        return np.load(self.folder / f"{name}.npy", mmap_mode="r")


def fastest_stored(
    stored: StoredStages,
    out: Path,
    *,
    x_start: float = 0.0,
    x_end: float = 0.0,
    block: int = BLOCK,
    processes: int = 1,
) -> Failure | None:
    """Write the largest x of stored stages to the file `out` (.npy), as `fastest` would find it.

    The same bits, on one kind of processor and with one set of libraries. Returns why there is none, or None. Memory
    does not grow with the path. Raises InputError: a block of less than 2 gridpoints, no process, what the stages
    raise.
    """
    if block < 2 or processes < 1:
        raise InputError("nothing can be done so", key="block, processes", value=(block, processes))
    count = len(stored)
    with tempfile.TemporaryDirectory(dir=out.parent) as scratch:
        low = np.lib.format.open_memmap(Path(scratch) / "low.npy", "w+", np.float64, (count,))
        high = np.lib.format.open_memmap(Path(scratch) / "high.npy", "w+", np.float64, (count,))
        x = np.lib.format.open_memmap(out, "w+", np.float64, (count,))
        bounds = list(range(0, count - 1, block))
        blocks = [(begin, min(begin + block, count - 1)) for begin in bounds]
        with _workers(processes) as each:
            end = (x_end, x_end)
            for (begin, last), guess in zip(
                reversed(blocks), each(_backward, stored, blocks[::-1], count), strict=True
            ):
                found = guess if guess is not None and guess[2] == end else _exact(stored, begin, last, end)
                if isinstance(found, Failure):
                    return Failure(begin + found.gridpoint, found.reason, found.conflict)
                low[begin : last + 1], high[begin : last + 1] = found[0], found[1]
                end = (float(low[begin]), float(high[begin]))
        start = admitted(x_start, *end)
        if isinstance(start, Failure):
            return start
        x[0] = start
        for begin, last in blocks:
            part = stored.part(begin, last + 1)
            x[begin : last + 1] = forward(
                part, np.array(low[begin : last + 1]), np.array(high[begin : last + 1]), x[begin]
            )
            still = (x[begin:last] + x[begin + 1 : last + 1] <= 0.0) & (np.diff(part.s) > 0.0)
            if still.any():
                return Failure(begin + int(np.argmax(still)), "the motion comes to a standstill")
        x.flush()
    return None


def _exact(
    stored: StoredStages, begin: int, last: int, end: tuple[float, float]
) -> tuple[Floats, Floats, tuple[float, float]] | Failure:
    part = stored.part(begin, last + 1)
    speeds = part.fault() or backward(part, end)
    return speeds if isinstance(speeds, Failure) else (*speeds, end)


def _backward(
    stored: StoredStages, begin: int, last: int, count: int
) -> tuple[Floats, Floats, tuple[float, float]] | None:
    """Return a block's controllable speeds as found from rest a lead behind it, and those at its end."""
    until = min(last + _LEAD, count - 1)
    part = stored.part(begin, until + 1)
    speeds = part.fault() or backward(part, (0.0, 0.0))
    if isinstance(speeds, Failure):
        return None
    low, high = (y[: last - begin + 1] for y in speeds)
    return low, high, (float(low[-1]), float(high[-1]))


Guess = tuple[Floats, Floats, tuple[float, float]] | None


@contextmanager
def _workers(processes: int) -> Generator[Callable[..., Iterator[Guess]]]:
    """Yield what maps blocks to guesses: none by one process, which needs none."""
    if processes == 1:
        yield lambda _work, _stored, blocks, _count: iter([None] * len(blocks))
        return
    with ProcessPoolExecutor(min(processes, os.cpu_count() or 1), mp_context=get_context("spawn")) as pool:

        def each(
            work: Callable[..., Guess], stored: StoredStages, blocks: list[tuple[int, int]], count: int
        ) -> Iterator[Guess]:
            futures = [pool.submit(work, stored, begin, last, count) for begin, last in blocks]
            return (future.result() for future in futures)

        yield each
