"""A batch whose driver and workers are killed at random: `python killed_batch.py OUT LOG COUNT SECONDS` drives one."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import stub_tasks

from pentapod.batch import Engine


def rows_of(made, out, workers):
    """Run tasks and return their rows by name."""
    with Engine(out, workers=workers) as engine:
        return {done.task.name: done.columns for done in engine.run(made)}


def run_and_kill(command, log, seed, most, patience):
    """Run a command till it succeeds, killing it or one of its processes every so often; return how often which.

    log: of the tasks that were begun; most: how many more of them there are at most before the next kill. So a busy
    machine gets on as well.
    """
    chance, counts, until = random.Random(seed), {"drivers": 0, "workers": 0}, time.monotonic() + patience
    while time.monotonic() < until:
        driver = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            while driver.poll() is None and time.monotonic() < until:
                enough = len(stub_tasks.begun(log)) + chance.randint(1, most)
                while driver.poll() is None and time.monotonic() < until and len(stub_tasks.begun(log)) < enough:
                    time.sleep(0.02)
                time.sleep(chance.uniform(0.0, 0.5))
                if driver.poll() is not None:
                    break
                if chance.random() < 0.3:
                    counts["drivers"] += 1
                    driver.kill()
                elif below := workers_of(driver.pid):
                    counts["workers"] += 1
                    os.kill(chance.choice(below), signal.SIGKILL)
        finally:
            driver.kill()
            driver.wait()
        if driver.returncode == 0:
            return counts
    raise TimeoutError(f"not done after {patience} s: {counts}")


def workers_of(driver):
    """Numbers of the processes of the workers, and of their tasks."""
    try:
        found = psutil.Process(driver).children(recursive=True)
        return [each.pid for each in found if "resource_tracker" not in " ".join(each.cmdline())]
    except psutil.Error:
        return []


if __name__ == "__main__":
    out, log, count, seconds = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])
    rows_of(stub_tasks.tasks(count, log, seconds), out, 2)
