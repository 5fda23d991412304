"""Tasks that need no robot: quick ones, slow ones, and such that take their process with them."""

import os
import signal
import time
from pathlib import Path

from pentapod.batch import Task
from pentapod.batch.jobs import plan_in
from pentapod.batch.tasks.folder import ROW


def work(folder, number, log, how="well", seconds=0.0):
    """Write a file and return a row; note in `log` (a file) when it began."""
    with Path(log).open("a", encoding="utf-8") as file:
        file.write(f"{number} {time.time()} {os.getpid()} {os.getppid()}\n")
    if how == "segfault":
        os.kill(os.getpid(), signal.SIGSEGV)
    if how == "kills its worker":
        os.kill(os.getppid(), signal.SIGKILL)
    if how == "large":
        filled = bytearray(b"x" * 600_000_000)
        time.sleep(3.0)
        del filled
    if how == "error":
        raise KeyError(number)
    time.sleep(seconds)
    read = sum(len(path.read_bytes()) for path in sorted((folder.parent / "inputs").glob("*")) if how == "reads")
    (folder / "result.txt").write_text(f"{number}\n", encoding="utf-8")
    return {
        "status": "passed",
        "value": float("nan") if how == "no number" else number / 7,
        "read": read,
        "list": [number, "x"],
    }


def tasks(count, log, seconds=0.0, how=None, inputs=()):
    """Tasks 0 to count − 1. how: of some, by number."""
    made = []
    for number in range(count):
        asked = {"number": number, "log": str(log), "how": (how or {}).get(number, "well"), "seconds": seconds}
        made.append(Task.of("stub", work, asked, inputs=inputs, known={"job": f"stub {number}", "number": number}))
    return made


def begun(log):
    """Number of each task that was begun, with its time."""
    lines = Path(log).read_text(encoding="utf-8").splitlines() if Path(log).exists() else []
    return [(int(line.split()[0]), float(line.split()[1])) for line in lines]


def done_twice(made, folder, log):
    """Numbers of tasks that were begun again after their folder was whole."""
    whole = {task.arguments["number"]: (folder / task.name / ROW).stat().st_mtime for task in made}
    return [number for number, when in begun(log) if number in whole and when > whole[number]]


def planned(folder, number, log, job):
    """Plan a job as a batch does; note in `log` (a file) when it began."""
    with Path(log).open("a", encoding="utf-8") as file:
        file.write(f"{number} {time.time()} {os.getpid()} {os.getppid()}\n")
    return plan_in(folder, job)
