"""Engine: tasks on the workers of Dask, each done once, whatever dies meanwhile."""

from __future__ import annotations

import json
import logging
import os
import secrets
import shutil
import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Self

from pentapod.base.errors import InputError
from pentapod.base.values import Value
from pentapod.batch.tasks.cluster import client_of, lost_scheduler
from pentapod.batch.tasks.folder import ROW, finished_row, unpack
from pentapod.batch.tasks.store import INPUTS, Store
from pentapod.batch.tasks.task import Row, Task, versions
from pentapod.batch.tasks.worker import Answer, Order, execute, receive
from pentapod.job.run_folder import locked, remove_unfinished
from pentapod.numerics.threads import cores

_log = logging.getLogger("pentapod")

LOG = "log.jsonl"
"""What happened when, and where: a line for each answer of a worker. No table depends on it."""


@dataclass(frozen=True)
class EngineOptions(Value):
    """How tasks are run, and how often again.

    memory: bytes that the process of a task may use; a task that needs more counts as crashed. tries: runs beside
    others of a task whose process or worker died, before it is run alone. alone: runs alone of such a task, before it
    counts as crashed. sends: how often inputs of a task are sent to workers that miss them. tick: seconds between two
    looks whether the scheduler is there. most: largest number of tasks.
    """

    memory: float = 4e9
    tries: int = 2
    alone: int = 2
    sends: int = 20
    tick: float = 1.0
    most: int = 10_000


OPTIONS = EngineOptions()


@dataclass(frozen=True)
class Done(Value):
    """A task with its row. new: whether it was run now; seconds: that it took, 0 where it was not."""

    summary = ("status",)

    task: Task
    row: Row
    folder: Path
    new: bool = False
    seconds: float = 0.0

    @property
    def status(self) -> str:
        """The answer in a word."""
        return str(self.row["status"])

    @property
    def columns(self) -> Row:
        """The row of the table: what was known beforehand, and the result."""
        return {**self.task.known, **dict(sorted(self.row.items())), "task": self.task.name}


class Engine:
    """Runs tasks in a folder: `with Engine("runs") as engine: for done in engine.run(tasks): ...`.

    Each task has a folder of its name in it, which is there when it is whole. A task whose folder is there is not run.
    What crashed leaves no folder: it is run again the next time. Where no task was begun, a folder that it made is
    removed. While the engine is open, no other can be on this
    folder. workers: processes on this machine, one for each core if left out; scheduler: address of a running Dask
    scheduler, "tcp://host:8786", instead. Dask is imported, and workers are started, when a task is to be run.
    Raises InputError: the folder cannot be written, or another engine is on it.
    """

    def __init__(
        self,
        folder: str | Path,
        *,
        workers: int | None = None,
        scheduler: str | None = None,
        options: EngineOptions = OPTIONS,
    ) -> None:
        self.folder, self.store, self.options = Path(folder), Store(Path(folder)), options
        self._workers, self._scheduler = workers, scheduler
        self._open = ExitStack()
        self._made = self._has_begun = False
        self._client: Any = None
        self._has_waited = False
        self._mark = f".unfinished-{os.getpid()}-{secrets.token_hex(4)}"
        self._numbers = Counter[str]()
        self._sent: dict[tuple[str, str], float] = {}

    def __enter__(self) -> Self:
        self._made = not self.folder.exists()
        alone = self._open.enter_context(locked(self.folder, make=True))
        if alone:
            remove_unfinished(self.folder)
            self.store.tidy()
        (self.folder / self._mark).mkdir()
        self._open.callback(self._tidy)
        return self

    def __exit__(self, *failure: object) -> None:
        self._open.close()
        if self._made and not self._has_begun:  # a mistake in a job leaves nothing behind
            shutil.rmtree(self.folder, ignore_errors=True)

    def run(self, tasks: Sequence[Task]) -> Iterator[Done]:
        """Yield each task when it is done: those that were done before first, then as they end.

        Raises InputError: no Dask, no scheduler, or too many tasks.
        """
        if len(tasks) > self.options.most:
            raise InputError("too many tasks", value=len(tasks), expected=f"at most {self.options.most}")
        missing: list[Task] = []
        for task in {task.name: task for task in tasks}.values():
            folder = self.folder / task.name
            row = finished_row(folder)
            if row is not None:
                yield Done(task, row, folder)
            elif folder.exists():
                raise InputError(
                    "a folder has the name of a task, but is none", file=folder, expected=ROW, remedy="remove it"
                )
            else:
                missing.append(task)
        if missing:
            if self._client is None:
                count = None if self._scheduler else min(self._workers or cores(), len(missing))
                self._client = self._open.enter_context(client_of(self._scheduler, count))
            self._has_begun = True
            yield from _Rounds(self, missing).done()

    def _tidy(self) -> None:
        """Remove what is not whole of this engine."""
        for path in self.folder.glob(f".unfinished-{os.getpid()}-*"):
            shutil.rmtree(path, ignore_errors=True)

    @property
    def threads(self) -> int:
        """Tasks that its workers can run at a time now; at least one. Raises InputError where the scheduler is gone."""
        try:
            return max(1, sum(self._client.nthreads().values()))
        except OSError:
            self.check()
            return 1

    def order(self, task: Task) -> Order:
        """Return a task as workers take it."""
        base = str(self.folder.resolve())
        return Order(task, base, self._mark, os.getpid(), self.options.memory, versions())

    def submit(self, task: Task, answered: SimpleQueue[Any], worker: str | None) -> Any:
        """Send a task to the scheduler, and its future to `answered` when it has ended. worker: where it should run."""
        self._numbers[task.name] += 1
        key = f"{task.name}-{secrets.token_hex(4)}-{self._numbers[task.name]}"
        where: dict[str, Any] = {"workers": [worker], "allow_other_workers": True} if worker else {}
        future = self._client.submit(execute, self.order(task), key=key, pure=False, **where)
        future.add_done_callback(answered.put)
        return future

    def send(self, answer: Answer, since: float) -> None:
        """Send the inputs that a worker missed to it, unless they were sent `since` then. It may die meanwhile."""
        for each in answer.missing:
            if self._sent.get((answer.worker, each.name), -1.0) >= since:
                continue
            self._sent[answer.worker, each.name] = time.monotonic()
            data = (self.folder / INPUTS / each.name).read_bytes()
            self._client.run(receive, each.name, each.sha256, data, workers=[answer.worker], on_error="ignore")

    def check(self) -> None:
        """Raise InputError where the scheduler is gone; say once where it has no workers."""
        if lost_scheduler(self._client):
            raise InputError(
                "the connection to the scheduler was lost", value=self._scheduler,
                remedy="what is done is kept: the same command goes on from there",
            )  # fmt: skip
        if self._scheduler is not None and not self._has_waited and not self._client.scheduler_info()["workers"]:
            self._has_waited = True
            _log.warning('the scheduler has no workers yet; "dask worker %s --nthreads 1" starts one', self._scheduler)

    def cancel(self, futures: list[Any]) -> None:
        """Drop tasks that are not done."""
        if futures and not lost_scheduler(self._client):
            self._client.cancel(futures, force=True)

    def log(self, task: Task, answer: Answer, status: str) -> None:
        """Write a line about an answer."""
        line = {"time": round(time.time(), 3), "task": task.name, "status": status, "worker": answer.worker}
        line |= {"seconds": round(answer.seconds, 3), "died": answer.died, "trace": answer.trace}
        with (self.folder / LOG).open("a", encoding="utf-8") as file:
            file.write(json.dumps({key: value for key, value in line.items() if value != ""}) + "\n")


class _Rounds:
    """Tasks till each is done: one whose process or worker died is run again, at last alone.

    A scheduler gets as many as its workers have threads: one that waited at a worker would die with its neighbour.
    """

    def __init__(self, engine: Engine, tasks: Sequence[Task]) -> None:
        self._engine, self._options, self._waiting = engine, engine.options, deque(tasks)
        self._answered: SimpleQueue[Any] = SimpleQueue()
        self._running: dict[str, tuple[Any, Task, float]] = {}
        self._alone: deque[Task] = deque()
        self._lost, self._sends = Counter[str](), Counter[str]()

    def done(self) -> Iterator[Done]:
        """Yield the tasks as they end."""
        try:
            while self._waiting or self._running or self._alone:
                if self._waiting and len(self._running) < (threads := self._engine.threads):
                    while self._waiting and len(self._running) < threads:
                        self._start(self._waiting.popleft())
                elif not self._running:
                    self._start(self._alone.popleft())
                try:
                    future = self._answered.get(timeout=self._options.tick)
                except Empty:
                    self._engine.check()
                    continue
                _, task, since = self._running.pop(future.key)
                answer = self._answer(future)
                future.release()
                if (done := self._taken(task, answer, since)) is not None:
                    yield done
        finally:
            self._engine.cancel([future for future, _, _ in self._running.values()])

    def _start(self, task: Task, worker: str | None = None) -> None:
        future = self._engine.submit(task, self._answered, worker)
        self._running[future.key] = (future, task, time.monotonic())

    def _answer(self, future: Any) -> Answer:
        """Return the answer of a future that has ended. Raises InputError where the scheduler is gone."""
        if future.status == "finished":
            try:
                return future.result()
            except Exception as error:  # its worker died before the answer was fetched
                return Answer("", died=f"its worker died ({type(error).__name__})")
        self._engine.check()
        if future.status == "error":
            error = future.exception()
            if type(error).__name__ != "KilledWorker":
                return Answer("", crashed=f"{type(error).__name__}: {error}")
        return Answer("", died="its worker died")

    def _taken(self, task: Task, answer: Answer, since: float) -> Done | None:
        """Return a task that is done; None where it is run again."""
        engine, folder = self._engine, self._engine.folder / task.name
        if answer.missing and self._sends[task.name] < self._options.sends:
            self._sends[task.name] += 1
            engine.send(answer, since)
            self._start(task, answer.worker)
            return None
        if answer.row is not None:
            if answer.packed is not None:
                self._place(answer.packed, folder)
            engine.log(task, answer, str(answer.row["status"]))
            return Done(task, answer.row, folder, new=True, seconds=answer.seconds)
        cause = "its inputs cannot be sent to the workers" if answer.missing else answer.crashed
        if not cause:
            engine.log(task, answer, "died")
            self._lost[task.name] += 1
            if self._lost[task.name] < self._options.tries:
                self._waiting.append(task)
                return None
            if self._lost[task.name] < self._options.tries + self._options.alone:
                self._alone.append(task)
                return None
            cause = f"its process died each time, also alone: {answer.died}"
        engine.log(task, answer, "crashed")
        return Done(task, {"status": "crashed", "cause": cause}, folder, new=True, seconds=answer.seconds)

    def _place(self, data: bytes, folder: Path) -> None:
        """Write a folder that came from another file system, and rename it when it is whole."""
        staging = folder.with_name(f".unfinished-{os.getpid()}-{secrets.token_hex(4)}")
        try:
            unpack(data, staging)
            staging.rename(folder)
        finally:
            shutil.rmtree(staging, ignore_errors=True)
