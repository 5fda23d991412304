"""Many jobs killed at random, against a serial run; overhead; workers of another file system: ``make bench-batch``.

`python benchmarks/batch.py [JOBS]`: the number of jobs that are killed, 100 if left out.
"""

from __future__ import annotations

import dataclasses
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

TESTS = Path(__file__).resolve().parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "batch")]

import killed_batch  # noqa: E402
import stub_tasks  # noqa: E402
from test_task_engine import elsewhere  # noqa: E402

from pentapod.batch import Engine, Store, Task  # noqa: E402
from pentapod.batch.jobs import RESULTS, job_task  # noqa: E402
from pentapod.batch.table import csv_text, lines_text  # noqa: E402
from pentapod.batch.tasks.folder import finish, write_files  # noqa: E402
from pentapod.cli.commands.new import dome_stl  # noqa: E402
from pentapod.job import Job  # noqa: E402
from usual_job import job_text  # noqa: E402

WORKERS, SECONDS, ROUNDS = 2, 20.0, 10
BETWEEN_KILLS = 8
PATIENCE_S = 7200.0


def small_tasks(count: int, folder: Path, out: Path) -> list[Task]:
    """Return tasks of a small job at different feeds; each notes in folder/log when it begins."""
    part = folder / "part.stl"
    if not part.exists():
        part.write_bytes(dome_stl(size_mm=24.0, height_mm=2.0, cells=6))
        (folder / "job.toml").write_text(job_text().replace("spacing_mm = 4", "spacing_mm = 8"), encoding="utf-8")
    job, store, made = Job.load(folder / "job.toml"), Store(out), list[Task]()
    for number in range(count):
        change = {"feed.cut_mm_min": 2000 + 10 * number}
        task = job_task(job.with_(**change), store, change)
        arguments = {**task.arguments, "number": number, "log": str(folder / "log")}
        made.append(dataclasses.replace(task, function="stub_tasks:planned", arguments=arguments))
    return made


def tables(tasks: Sequence[Task], rows: dict[str, dict[str, Any]]) -> str:
    """Return the tables of tasks."""
    ordered = [rows[task.name] for task in tasks]
    return csv_text(ordered, RESULTS) + lines_text(ordered, RESULTS)


def serial(tasks: Sequence[Task], out: Path) -> str:
    """Return the tables of tasks that are run here, one after the other."""
    rows: dict[str, dict[str, Any]] = {}
    for task in tasks:
        staging = out / f".{task.name}"
        write_files(task, staging)
        row = stub_tasks.planned(staging, **{**task.arguments, "log": str(out / "log")})
        finish(staging, out / task.name, row)
        rows[task.name] = {**task.known, **dict(sorted(row.items())), "task": task.name}
    return tables(tasks, rows)


def said(what: str, asked: str, reached: str) -> None:
    """Print a line of the table."""
    print(f"{what:<64} {asked:>10} {reached:>14}", flush=True)


def killed(count: int, folder: Path) -> None:
    """Kill drivers and workers at random till all is done; compare with a serial run."""
    out = folder / "runs"
    start = time.perf_counter()
    command = [sys.executable, __file__, "--drive", str(folder), str(count)]
    times = killed_batch.run_and_kill(command, folder / "log", 7, BETWEEN_KILLS, PATIENCE_S)
    seconds = time.perf_counter() - start
    made = small_tasks(count, folder, out)
    begun = stub_tasks.begun(folder / "log")
    twice = stub_tasks.done_twice(made, out, folder / "log")
    missing = [task.name for task in made if not (out / task.name / "row.json").is_file()]
    rows = killed_batch.rows_of(made, out, WORKERS)
    print(
        f"{count} jobs in {seconds:.0f} s: drivers killed {times['drivers']} times, workers {times['workers']} times;"
    )
    print(f"{len(begun)} times a job was begun, {len(begun) - count} of them cut off by a kill")
    said("jobs lost", "0", str(len(missing)))
    said("jobs begun again after they were done", "0", str(len(twice)))
    (folder / "serial").mkdir()
    same = tables(made, rows) == serial(small_tasks(count, folder, folder / "serial"), folder / "serial")
    said("tables equal those of a serial run, bit for bit", "yes", "yes" if same else "NO")


def overhead(folder: Path) -> None:
    """Run tasks of 20 s that sleep, so that only what the engine does between them counts."""
    made = stub_tasks.tasks(WORKERS * ROUNDS, folder / "slept", SECONDS)
    start = time.perf_counter()
    began = time.time()
    with Engine(folder / "sleepers", workers=WORKERS) as engine:
        found = list(engine.run(made))
        seconds = time.perf_counter() - start
    first = min(when for _, when in stub_tasks.begun(folder / "slept"))
    ideal = SECONDS * ROUNDS
    steady = seconds - (first - began) - ideal
    said(f"overhead of {len(found)} tasks of {SECONDS:.0f} s on {WORKERS} workers", "2 %", f"{steady / ideal:.2%}")
    said(f"  with the start of the workers, once ({first - began:.1f} s)", "", f"{seconds / ideal - 1.0:.2%}")


def far(folder: Path) -> None:
    """Run jobs on workers that do not see the folder; compare with a serial run."""
    out = folder / "far"
    made = small_tasks(4, folder, out)
    with elsewhere(folder) as address, Engine(out, scheduler=address) as engine:
        rows = {done.task.name: done.columns for done in engine.run(made)}
    there = sorted((folder / "far-0").rglob("part-*.stl")) + sorted((folder / "far-1").rglob("part-*.stl"))
    (folder / "near").mkdir()
    same = tables(made, rows) == serial(small_tasks(4, folder, folder / "near"), folder / "near")
    said("workers on another file system: tables equal, bit for bit", "yes", "yes" if same else "NO")
    whole = all((out / task.name / "report.html").is_file() for task in made)
    said(f"  folders sent back whole; the mesh was sent {len(there)} times for {len(made)} jobs", "yes", str(whole))


def main() -> None:
    """Print asked and reached."""
    if sys.argv[1:2] == ["--drive"]:
        folder, count = Path(sys.argv[2]), int(sys.argv[3])
        rows = killed_batch.rows_of(small_tasks(count, folder, folder / "runs"), folder / "runs", WORKERS)
        print(json.dumps({name: row["status"] for name, row in rows.items()}))
        return
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    with tempfile.TemporaryDirectory(prefix="bench-batch-") as name:
        said("", "asked", "reached")
        far(Path(name))
        (Path(name) / "log").unlink()
        overhead(Path(name))
        killed(count, Path(name))


if __name__ == "__main__":
    main()
