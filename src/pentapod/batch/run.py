"""batch: many jobs, planned and verified by the workers of Dask, in one folder with tables and a page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from pentapod.batch.jobs import RESULTS, job_task
from pentapod.batch.page import write_batch_page
from pentapod.batch.sweep import Sweep
from pentapod.batch.table import parquet_library, write_tables
from pentapod.batch.tasks.engine import OPTIONS, Done, Engine, EngineOptions
from pentapod.batch.tasks.task import Row, Task
from pentapod.job.schema.job import Job


class Batch(Iterator[Done]):
    """Jobs that are planned and verified, one after the other as they are done; `len` is how many there are.

    What `batch` returns. Tables and page are written when the last is done, or when it is closed.
    """

    def __init__(
        self,
        jobs: Iterable[Job | str | Path] | Sweep,
        out: str | Path,
        workers: int | None,
        scheduler: str | None,
        parquet: bool,
        options: EngineOptions,
    ) -> None:
        if parquet:
            parquet_library()
        self._given: Sweep | list[Job] = jobs if isinstance(jobs, Sweep) else [_loaded(job) for job in jobs]
        self.folder, self._parquet = Path(out), parquet
        self._engine = Engine(out, workers=workers, scheduler=scheduler, options=options)
        self._done = self._run()

    def __len__(self) -> int:
        given = self._given
        return len(given.jobs) * len(given.changes) if isinstance(given, Sweep) else len(given)

    def __next__(self) -> Done:
        return next(self._done)

    def close(self) -> None:
        """End the workers, and write tables and page of what is done."""
        self._done.close()

    def _run(self) -> Generator[Done]:
        given = self._given
        keys, title = (given.keys, given.path.stem) if isinstance(given, Sweep) else ((), self.folder.resolve().name)
        with self._engine as engine:
            store = engine.store
            tasks = given.tasks(store) if isinstance(given, Sweep) else [job_task(job, store) for job in given]
            rows: dict[str, Row] = {}
            times = Counter(task.name for task in tasks)
            try:
                for done in engine.run(tasks):
                    rows[done.task.name] = done.columns
                    yield done
                    for _ in range(1, times[done.task.name]):
                        yield replace(done, new=False, seconds=0.0)
            finally:
                if rows:
                    write_results(tasks, rows, keys, title, engine.folder, parquet=self._parquet)


def batch(
    jobs: Iterable[Job | str | Path] | Sweep,
    out: str | Path = "runs",
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    parquet: bool = False,
    options: EngineOptions = OPTIONS,
) -> Batch:
    """Plan and verify jobs on many workers, and yield each with its row when it is done.

    Those that were done before come first. A job that is given twice is planned once, and yielded twice. jobs: as
    values or files, or a `Sweep`. out: folder; each job has one in it, by its name and the hash of all that it depends
    on, and is not run again if that is there. workers: processes on this machine, one for each core if None; scheduler:
    address of a Dask scheduler, "tcp://host:8786", instead.
    parquet: a third table, in Parquet. In a script of your own, call it below `if __name__ == "__main__":`, since
    workers import the script. Raises InputError for a bad job, before any is run, where Dask is not installed, and
    where another batch is writing into the folder.
    """
    return Batch(jobs, out, workers, scheduler, parquet, options)


def write_results(
    tasks: Sequence[Task], rows: dict[str, Row], changed: Sequence[str], title: str, folder: Path, *, parquet: bool
) -> None:
    """Write the tables and the page of the tasks that are done, in the order of the tasks."""
    ordered = [rows[name] for name in dict.fromkeys(task.name for task in tasks) if name in rows]
    write_tables(ordered, RESULTS, folder, parquet=parquet)
    write_batch_page(ordered, changed, title, folder)


def _loaded(job: Job | str | Path) -> Job:
    return job if isinstance(job, Job) else Job.load(job)
