"""What a Dask worker does with a task: run it in a process of its own, watch that, and hand over its folder."""

from __future__ import annotations

import hashlib
import secrets
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pentapod.base.files import atomic_write
from pentapod.batch.tasks.folder import finish, finished_row, packed, write_files
from pentapod.batch.tasks.process import Child
from pentapod.batch.tasks.store import INPUTS, Input
from pentapod.batch.tasks.task import Row, Task, versions

_RUNNING = ("running", "paused")


@dataclass(frozen=True)
class Order:
    """A task for a worker. base: the folder of the batch on the driver's file system.

    mark: name of a folder in it that no other file system has. driver: process number. memory: bytes that the task's
    process may use; versions: of the driver.
    """

    task: Task
    base: str
    mark: str
    driver: int
    memory: float
    versions: Mapping[str, str]


@dataclass(frozen=True)
class Answer:
    """What became of an order: one of row, crashed, died and missing.

    crashed: why the task ended without a row, and would again. died: how its process ended. missing: inputs that are
    not on the worker's file system. packed: the finished folder, where the driver does not see it. seconds: that the
    task took. trace: where it crashed.
    """

    worker: str
    row: Row | None = None
    crashed: str = ""
    died: str = ""
    missing: tuple[Input, ...] = ()
    packed: bytes | None = None
    seconds: float = 0.0
    trace: str = ""


_child: list[Child] = []
"""The process of this worker, once it has one."""


def execute(order: Order) -> Answer:
    """Run a task on this worker, in a folder that is renamed to its name when it is whole."""
    from distributed import get_worker  # noqa: PLC0415  only on workers

    me: Any = get_worker()
    if order.versions != versions():
        return Answer(me.address, crashed=f"the worker has other versions: {_difference(order.versions)}")
    shared = (Path(order.base) / order.mark).is_dir()
    base = Path(order.base) if shared else Path(me.local_directory) / "pentapod"
    if missing := tuple(each for each in order.task.inputs if not (base / INPUTS / each.name).is_file()):
        return Answer(me.address, missing=missing)
    answer = performed(order, base, me.address, lambda: me.status.name not in _RUNNING)
    if shared or answer.row is None:
        return answer
    folder = base / order.task.name
    data = packed(folder)
    shutil.rmtree(folder, ignore_errors=True)
    return replace(answer, packed=data)


def performed(order: Order, base: Path, address: str, ending: Callable[[], bool] = lambda: False) -> Answer:
    """Run a task in a process of its own and rename its folder in `base` when it is whole, or return the row there."""
    start, final = time.perf_counter(), base / order.task.name
    if (found := finished_row(final)) is not None:  # by a worker whose answer was lost
        return Answer(address, found)
    staging = base / f".unfinished-{order.driver}-{secrets.token_hex(4)}"
    try:
        write_files(order.task, staging)
        if not _child or not _child[0].is_alive:
            _child[:] = [Child()]
        asked = {"function": order.task.function, "folder": str(staging), "arguments": dict(order.task.arguments)}
        got = _child[0].ask(asked, order.memory, ending)
        if "row" in got:
            finish(staging, final, got["row"])
    finally:
        shutil.rmtree(staging, ignore_errors=True)
    return Answer(
        address, got.get("row"), got.get("crashed", ""), got.get("died", ""), seconds=time.perf_counter() - start,
        trace=got.get("trace", ""),
    )  # fmt: skip


def receive(name: str, sha256: str, data: bytes, dask_worker: Any = None) -> bool:
    """Keep an input on this worker's file system; return whether it arrived whole."""
    if hashlib.sha256(data).hexdigest() != sha256:
        return False
    folder = Path(dask_worker.local_directory) / "pentapod" / INPUTS
    folder.mkdir(parents=True, exist_ok=True)
    with atomic_write(folder / name) as temporary:
        temporary.write_bytes(data)
    return True


def _difference(theirs: Mapping[str, str]) -> str:
    own = versions()
    other = {key: value for key, value in theirs.items() if own.get(key) != value}
    return "; ".join(f"{key} {own.get(key)}, not {value}" for key, value in other.items())
