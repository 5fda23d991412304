"""Jerk limits on long profiles from disk to disk: block by block in constant memory; several processes on request.

The blocks are those of `jerk_limited`, and what a block finds depends on its own gridpoints alone. So the law is the
same, bit for bit, whether it is made in memory, from disk, or by several processes, on one
kind of processor and with one set of libraries.
"""

from __future__ import annotations

import os
import tempfile
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.timing.jerk.limited import APART, Block, Solved, blocks, leads, runs_of, solved
from pentapod.timing.jerk.over import Run
from pentapod.timing.jerk.passes import PASSES
from pentapod.timing.jerk.rows import RowsAt
from pentapod.timing.topp.stages import Failure

_COPIED = 1 << 16  # rows at once


@dataclass(frozen=True)
class StoredProfile:
    """A profile in a folder: stations in s.npy and squared speeds in x.npy, as `fastest_stored` writes them."""

    folder: Path

    @property
    def s(self) -> Floats:
        """Stations (N + 1,), read where they are looked at."""
        return np.load(self.folder / "s.npy", mmap_mode="r")

    @property
    def x(self) -> Floats:
        """Squared speeds (N + 1,), likewise."""
        return np.load(self.folder / "x.npy", mmap_mode="r")


def limit_stored(
    stored: StoredProfile,
    rows_at: RowsAt,
    marks: Floats,
    out: Path,
    *,
    passes: int = PASSES,
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
            work = partial(_solved, stored, rows_at, marks, passes, least_step)
            reason = _write(raw, runs_of(stored.s, count, lead, _each(work, blocks(count, lead), processes)))
            if reason is None:
                whole = Path(scratch) / "law.npy"
                _as_table(raw, whole)
                whole.replace(out)  # at once: whatever stops this leaves no part of a law
                return None
    return reason


class _NoLawError(Exception):
    """A block has no law."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(failure.reason)
        self.failure = failure


def _solved(
    stored: StoredProfile, rows_at: RowsAt, marks: Floats, passes: int, least_step: float, block: Block
) -> Solved | Failure:
    return solved(stored.s, stored.x, rows_at, marks, passes, least_step, None, block)


def _each(work: partial[Solved | Failure], todo: list[Block], processes: int) -> Iterator[Solved]:
    """Yield the blocks' answers in order, a few ahead by several processes. Raises _NoLawError."""

    def told(found: Solved | Failure) -> Solved:
        if isinstance(found, Failure):
            raise _NoLawError(found)
        return found

    if processes == 1:
        yield from (told(work(block)) for block in todo)
        return
    with ProcessPoolExecutor(min(processes, os.cpu_count() or 1), mp_context=get_context("spawn")) as pool:
        ahead: deque[Future[Solved | Failure]] = deque()
        for block in todo:
            ahead.append(pool.submit(work, block))
            if len(ahead) > processes:
                yield told(ahead.popleft().result())
        yield from (told(future.result()) for future in ahead)


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
