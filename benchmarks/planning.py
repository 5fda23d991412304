"""The planner's own solver against IPOPT on the same problems, in the same run. Run ``make bench-planning``.

For random tasks on the shipped machine: the smallest margin reached and the time taken to raise it from the same
start, then the cost and the time of the calmest field at the same placement. Then how much the tilt gains over strict
normals, and how the time grows with the number of waypoints.
"""

from __future__ import annotations

import argparse
import platform
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "planning"))
from planning_instances import Instance, instances

from pentapod.kinematics.component import COMPONENTS
from pentapod.machine.machine import Machine
from pentapod.planning.ipopt import IpoptSolver
from pentapod.planning.margins import Margins
from pentapod.planning.sampling import first_guesses
from pentapod.planning.sequential import SequentialSolver
from pentapod.planning.setting import Candidate, Setting
from pentapod.planning.task import Task


def timed(action: Callable[[], Candidate]) -> tuple[Candidate, float]:
    """Return what an action gives and its processor seconds."""
    start = time.process_time()
    return action(), time.process_time() - start


def start_of(setting: Setting) -> Candidate:
    """Return the first candidate of the best first guess."""
    guess = first_guesses(setting.task, setting.machine, COMPONENTS, 0)[0]
    return setting.first_candidate(Margins.of(setting.machine, guess.component), guess.transform)


def against_ipopt(tasks: list[Instance], machine: Machine) -> None:
    """Print margin, cost and time of both solvers, each from the same start."""
    print(f"{'task':58s} {'margin':>8s} {'IPOPT':>8s} {'faster':>7s} {'cost':>9s} {'IPOPT':>9s} {'faster':>7s}")
    ratios: list[tuple[float, float]] = []
    for task in tasks:
        setting = Setting.of(Task.of(task.toolpath, task.tilt), machine)
        start = start_of(setting)
        ours, seconds = timed(lambda s=setting, c=start: SequentialSolver(s, True).raise_margin(c))
        theirs, their_seconds = timed(lambda s=setting, c=start: IpoptSolver(s, True).raise_margin(c))
        line = f"{task.name:58s} {ours.smallest:8.4f} {theirs.smallest:8.4f} {their_seconds / seconds:6.1f}x"
        ratios.append((ours.smallest - theirs.smallest, their_seconds / seconds))
        if task.tilt > 0.0 and ours.smallest > 0.0:
            keep = 0.9 * ours.smallest
            calm, calm_seconds = timed(lambda s=setting, c=ours, k=keep: SequentialSolver(s, False).calm(c, k))
            other, other_seconds = timed(lambda s=setting, c=ours, k=keep: IpoptSolver(s, False).calm(c, k))
            costs = [setting.unrest_of(c.coefficients) for c in (calm, other)]
            line += f" {costs[0]:9.4f} {costs[1]:9.4f} {other_seconds / calm_seconds:6.1f}x"
        print(line, flush=True)
    gain, faster = np.median(np.array(ratios), axis=0)
    print(f"median: margin {gain:+.4f} against IPOPT's, {faster:.1f}x as fast\n")


def tilt_gain(tasks: list[Instance], machine: Machine) -> None:
    """Print the median gain of the smallest margin by a tilt cone over strict normals, where both fit."""
    gains: list[float] = []
    for task in tasks:
        found: list[float] = []
        for tilt in (0.0, np.radians(15.0)):
            setting = Setting.of(Task.of(task.toolpath, tilt), machine)
            found.append(SequentialSolver(setting, True).raise_margin(start_of(setting)).smallest)
        if found[0] > 0.0:
            gains.append(found[1] / found[0])
    print(f"smallest margin with a cone of 15°: {np.median(gains):.2f}x that of strict normals, median of {len(gains)}")


def growth(machine: Machine) -> None:
    """Print seconds by the number of waypoints, of one part visited ever more densely."""
    base = instances(1)[0].toolpath
    print("\nwaypoints   raise, s   calm, s   µs a waypoint")
    for count in (1_000, 10_000, 100_000, 1_000_000):
        at = np.linspace(0.0, len(base) - 1.0, count)
        low = np.minimum(at.astype(np.intp), len(base) - 2)
        share = (at - low)[:, None]
        axes = (1.0 - share) * base.axes[low] + share * base.axes[low + 1]
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        task = Task((1.0 - share) * base.pivots[low] + share * base.pivots[low + 1], axes, base.pivot, np.radians(10.0))
        setting = Setting.of(task, machine)
        start = start_of(setting)
        raised, up = timed(lambda s=setting, c=start: SequentialSolver(s, True).raise_margin(c))
        keep = 0.9 * raised.smallest
        _, down = timed(lambda s=setting, c=raised, k=keep: SequentialSolver(s, False).calm(c, k))
        print(f"{count:9,d} {up:10.2f} {down:9.2f} {1e6 * (up + down) / count:12.1f}", flush=True)


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=12, help="how many random tasks")
    count = parser.parse_args().tasks
    machine, tasks = Machine.load("desk"), instances(count)
    print(f"casadi {version('casadi')}, SciPy {version('scipy')}, Python {platform.python_version()}, one core\n")
    against_ipopt(tasks, machine)
    tilt_gain(tasks, machine)
    growth(machine)


if __name__ == "__main__":
    main()
