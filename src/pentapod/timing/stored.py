"""Out-of-core TOPP-RA and jerk limits: long paths from disk to disk, block by block, in constant memory.

The backward pass needs of what lies behind a block two numbers, the controllable speeds at its end; so blocks taken one
after the other, from the last to the first, are the pass over the whole, and likewise forwards. Several processes begin
their blocks a lead too late and from rest. What they found is taken where it meets what lies behind in the very same
bits, and done again where it does not. The blocks of the jerk limits are those of `jerk_limited`, and what a block
finds depends on its own gridpoints alone. So the law is the same, bit for bit, in memory, from disk, or by several
processes, on one kind of processor and with one set of libraries. Exact stops need nothing more: a path's pieces
between them are problems of their own.
"""

from __future__ import annotations

import os
import tempfile
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TypeVar

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.timing.jerk.limited import APART, Block, Solved, blocks, leads, runs_of, solved
from pentapod.timing.jerk.options import USUAL, JerkOptions
from pentapod.timing.jerk.rows import RowsAt, Run
from pentapod.timing.topp.core import admitted, backward, forward
from pentapod.timing.topp.stages import Failure, Stages

BLOCK = 65_536
"""Gridpoints of a block."""

_LEAD = 2_048
_NAMES = ("s", "first", "second", "ceiling", "offset")
_COPIED = 1 << 16  # rows at once

Task = TypeVar("Task")
Answer = TypeVar("Answer")
Speeds = tuple[Floats, Floats, tuple[float, float]]
"""A block's least and largest controllable x, and those at its end."""


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
        return len(_array(self.folder, "s"))

    def part(self, begin: int, end: int) -> Stages:
        """Return the gridpoints from begin to before end. Raises InputError as `Stages.of` does."""
        s, first, second, ceiling = (_array(self.folder, name)[begin:end] for name in _NAMES[:-1])
        offset = _array(self.folder, "offset")
        return Stages.of(s, first, second, ceiling, offset if len(offset) == 1 else offset[begin:end])


@dataclass(frozen=True)
class StoredProfile:
    """A profile in a folder: stations in s.npy and squared speeds in x.npy, as `fastest_stored` writes them."""

    folder: Path

    @property
    def s(self) -> Floats:
        """Stations (N + 1,), read where they are looked at."""
        return _array(self.folder, "s")

    @property
    def x(self) -> Floats:
        """Squared speeds (N + 1,), likewise."""
        return _array(self.folder, "x")


def fastest_stored(
    stored: StoredStages,
    out: Path,
    *,
    x_start: float = 0.0,
    x_end: float = 0.0,
    block: int = BLOCK,
    processes: int = 1,
) -> Failure | None:
    """Write the largest x of stored stages to the file `out` (.npy), as `fastest` would find it, in the same bits.

    Returns why there is none, or None. Memory does not grow with the path. Raises InputError: a block of less than 2
    gridpoints, no process, what the stages raise.
    """
    if block < 2 or processes < 1:
        raise InputError("nothing can be done so", key="block, processes", value=(block, processes))
    count = len(stored)
    with tempfile.TemporaryDirectory(dir=out.parent) as scratch:
        low, high, x = (
            np.lib.format.open_memmap(file, "w+", np.float64, (count,))
            for file in (Path(scratch) / "low.npy", Path(scratch) / "high.npy", out)
        )
        parts = [(begin, min(begin + block, count - 1)) for begin in range(0, count - 1, block)]
        end = (x_end, x_end)
        with closing(_in_order(partial(_guessed, stored, count), parts[::-1], processes)) as guesses:
            for begin, last in reversed(parts):
                guess = None if processes == 1 else next(guesses)
                found = guess if guess is not None and guess[2] == end else _exact(stored, begin, last, end)
                if isinstance(found, Failure):
                    return Failure(begin + found.gridpoint, found.reason, found.conflict)
                low[begin : last + 1], high[begin : last + 1] = found[0], found[1]
                end = (float(low[begin]), float(high[begin]))
        start = admitted(x_start, *end)
        if isinstance(start, Failure):
            return start
        x[0] = start
        for begin, last in parts:
            part, here = stored.part(begin, last + 1), slice(begin, last + 1)
            x[here] = forward(part, np.array(low[here]), np.array(high[here]), x[begin])
            still = (x[begin:last] + x[begin + 1 : last + 1] <= 0.0) & (np.diff(part.s) > 0.0)
            if still.any():
                return Failure(begin + int(np.argmax(still)), "the motion comes to a standstill")
        x.flush()
    return None


def limit_stored(
    stored: StoredProfile,
    rows_at: RowsAt,
    marks: Floats,
    out: Path,
    *,
    options: JerkOptions = USUAL,
    least_step: float = 0.0,
    processes: int = 1,
) -> Failure | None:
    """Write the law that `jerk_limited` finds to the file `out` (.npy): columns station, ṡ² and its slope (n, 3).

    rows_at gives the rows of stations that it is asked for, block by block; several processes need one that can be
    pickled. Returns why there is no law, or None. Memory does not grow with the path. Raises InputError: no process.
    """
    if processes < 1:
        raise InputError("nothing can be done so", key="processes", value=processes, expected="1 or more")
    count, reason = len(stored.s), None
    for lead in leads(count):
        with tempfile.TemporaryDirectory(dir=out.parent) as scratch:
            raw = Path(scratch) / "runs"
            work = partial(_limited, stored, rows_at, marks, options, least_step)
            with closing(_in_order(work, blocks(count, lead), processes)) as found:
                reason = _write(raw, runs_of(stored.s, count, lead, map(_law, found)))
            if reason is None:
                whole = Path(scratch) / "law.npy"
                _as_table(raw, whole)
                whole.replace(out)  # at once: whatever stops this leaves no part of a law
                return None
    return reason


def _array(folder: Path, name: str) -> Floats:
    return np.load(folder / f"{name}.npy", mmap_mode="r")


def _in_order(work: Callable[[Task], Answer], todo: Sequence[Task], processes: int) -> Generator[Answer]:
    """Yield the answers in order, by several processes a few ahead."""
    if processes == 1:
        yield from map(work, todo)
        return
    with ProcessPoolExecutor(min(processes, os.cpu_count() or 1), mp_context=get_context("spawn")) as pool:
        ahead: deque[Future[Answer]] = deque()
        for task in todo:
            ahead.append(pool.submit(work, task))
            if len(ahead) > processes:
                yield ahead.popleft().result()
        yield from (future.result() for future in ahead)


def _exact(stored: StoredStages, begin: int, last: int, end: tuple[float, float]) -> Speeds | Failure:
    part = stored.part(begin, last + 1)
    speeds = part.fault() or backward(part, end)
    return speeds if isinstance(speeds, Failure) else (*speeds, end)


def _guessed(stored: StoredStages, count: int, block: tuple[int, int]) -> Speeds | None:
    """Return a block's controllable speeds as found from rest a lead behind it, and those at its end."""
    begin, last = block
    found = _exact(stored, begin, min(last + _LEAD, count - 1), (0.0, 0.0))
    if isinstance(found, Failure):
        return None
    low, high = (y[: last - begin + 1] for y in found[:2])
    return low, high, (float(low[-1]), float(high[-1]))


class _NoLawError(Exception):
    """A block has no law."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(failure.reason)
        self.failure = failure


def _limited(
    stored: StoredProfile, rows_at: RowsAt, marks: Floats, options: JerkOptions, least_step: float, block: Block
) -> Solved | Failure:
    return solved(stored.s, stored.x, rows_at, marks, options, least_step, None, block)


def _law(found: Solved | Failure) -> Solved:
    if isinstance(found, Failure):
        raise _NoLawError(found)
    return found


def _write(raw: Path, runs: Iterator[Run | None]) -> Failure | None:
    """Write runs one after the other; return why not, where there is no law."""
    with raw.open("wb") as file:
        try:
            for run in runs:
                if run is None:
                    return Failure(-1, APART)
                file.write(np.column_stack(run).tobytes())
        except _NoLawError as none:
            return none.failure
    return None


def _as_table(raw: Path, out: Path) -> None:
    rows = np.memmap(raw, np.float64, "r").reshape(-1, 3)
    table = np.lib.format.open_memmap(out, "w+", np.float64, rows.shape)
    for k in range(0, len(rows), _COPIED):
        table[k : k + _COPIED] = rows[k : k + _COPIED]
    table.flush()
