"""The planner's own solver against IPOPT on the same problems, in the same run. Run ``make bench-planning``.

Smallest margin and time of both from the same start; the cost and the time of the smoothest axes at the same placement;
the same on 1,000 and 10,000 waypoints, the axes also against plain IPOPT. Then what a tilt cone gains over strict
normals, how fast the axes turn beside strict normals, how long refusals take beside plans, and how time and memory grow
with the number of waypoints.
"""

from __future__ import annotations

import argparse
import platform
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import TypeVar

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "planning"))
from planning_instances import Instance, instances

from pentapod.base.refusal import Refusal
from pentapod.machine.machine import Machine
from pentapod.planning.leg_path.leg_path import leg_path
from pentapod.planning.placement.ipopt import IpoptSolver
from pentapod.planning.placement.placed_path import PlacedPath, Placement
from pentapod.planning.placement.sampling import first_candidate, first_guesses
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.plan import plan
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import lean
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.planning.tool_axis.cost import AxisCost
from pentapod.planning.tool_axis.spline import AxisSpline
from pentapod.toolpath.toolpath import Toolpath

KEPT_SHARE = 0.9
EVEN_PLACES = 4_000
Value = TypeVar("Value")


def timed(action: Callable[[], Value]) -> tuple[Value, float]:
    """Return what an action gives and its processor seconds."""
    start = time.process_time()
    return action(), time.process_time() - start


def start_of(problem: PlacementProblem) -> Candidate:
    """Return the first candidate of the best first guess."""
    guess = next(first_guesses(problem))
    return first_candidate(problem, guess.margins, guess.transform)


def against_ipopt(tasks: list[Instance], machine: Machine) -> None:
    """Print margin, cost and time of both solvers, each from the same start."""
    print(f"{'task':58s} {'margin':>8s} {'IPOPT':>8s} {'faster':>7s} {'cost':>9s} {'IPOPT':>9s} {'faster':>7s}")
    ratios: list[tuple[float, float]] = []
    for task in tasks:
        problem = PlacementProblem.of(ToolpathSamples.of(task.toolpath, task.tilt), machine)
        start = start_of(problem)
        ours, seconds = timed(lambda s=problem, c=start: SequentialSolver(s, True).raise_margin(c))
        theirs, their_seconds = timed(lambda s=problem, c=start: IpoptSolver(s, True).raise_margin(c))
        line = f"{task.name:58s} {ours.smallest:8.4f} {theirs.smallest:8.4f} {their_seconds / seconds:6.1f}x"
        ratios.append((ours.smallest - theirs.smallest, their_seconds / seconds))
        if task.tilt > 0.0 and ours.smallest > 0.0:
            line += smooth_against(problem, ours, whole=False)
        print(line, flush=True)
    gain, faster = np.median(np.array(ratios), axis=0)
    print(f"median: margin {gain:+.4f} against IPOPT's, {faster:.1f}x as fast\n")


def smooth_against(problem: PlacementProblem, at: Candidate, *, whole: bool) -> str:
    """Return the columns that compare the smoothest axes of both solvers."""
    keep = KEPT_SHARE * at.smallest
    ours, seconds = timed(lambda: SequentialSolver(problem, False).smooth(at, keep))
    theirs, their_seconds = timed(lambda: IpoptSolver(problem, False, whole).smooth(at, keep))
    cost = AxisCost(problem, AxisSpline.of(problem.samples, problem.cone), at)
    costs = [f"{'none':>9s}" if c is None else f"{cost.of(c):9.6f}" for c in (ours, theirs)]
    return f" {' '.join(costs)} {their_seconds / seconds:6.1f}x"


def against_ipopt_on_many(tasks: list[Instance], machine: Machine) -> None:
    """Print both solvers on many waypoints: the placement beside our own IPOPT, which generates its constraints.

    For the axes IPOPT gets all waypoints and margins at once, and finishes.
    """
    for task, count in ((tasks[0], 1_000), (tasks[1], 1_000), (tasks[0], 10_000)):
        problem = PlacementProblem.of(visited(task, count, 0.0), machine)
        start = start_of(problem)
        ours, seconds = timed(lambda s=problem, c=start: SequentialSolver(s, True).raise_margin(c))
        theirs, their_seconds = timed(lambda s=problem, c=start: IpoptSolver(s, True).raise_margin(c))
        print(
            f"{task.name:58s} placement, {count:6,d} waypoints: {ours.smallest:.4f} {theirs.smallest:.4f} "
            f"{seconds:.2f} s, {their_seconds / seconds:.1f}x as fast as IPOPT with constraint generation",
            flush=True,
        )
    for task in tasks[:4]:
        problem = PlacementProblem.of(visited(task, 1_000, max(task.tilt, np.radians(5.0))), machine)
        raised = SequentialSolver(problem, True).raise_margin(start_of(problem))
        print(
            f"{task.name:58s} axes, 1,000 waypoints, plain IPOPT: {smooth_against(problem, raised, whole=True)}",
            flush=True,
        )
    print()


def tilt_gain(tasks: list[Instance], machine: Machine) -> None:
    """Print the median gain of the smallest margin by a tilt cone over strict normals, where both fit."""
    gains: list[float] = []
    for task in tasks:
        found: list[float] = []
        for tilt in (0.0, np.radians(15.0)):
            problem = PlacementProblem.of(ToolpathSamples.of(task.toolpath, tilt), machine)
            found.append(SequentialSolver(problem, True).raise_margin(start_of(problem)).smallest)
        if found[0] > 0.0:
            gains.append(found[1] / found[0])
    print(
        f"smallest margin with a cone of 15°: {np.median(gains):.2f}x that of strict normals, median of {len(gains)}\n"
    )


def rates(tasks: list[Instance], machine: Machine) -> None:
    """Print axis rates and leg accelerations along the path beside those of strict normals at the same placement."""
    print(f"{'beside strict normals':58s} {'axis rate':>22s} {'leg acceleration':>22s}")
    print(f"{'':58s} {'median':>7s} {'peak':>6s} {'above':>7s} {'median':>7s} {'peak':>6s} {'above':>7s}")
    columns: list[list[float]] = []
    for task in [t for t in tasks if t.tilt > 0.0]:
        problem = PlacementProblem.of(ToolpathSamples.of(task.toolpath, task.tilt), machine)
        at = SequentialSolver(problem, True).raise_margin(start_of(problem))
        smooth = SequentialSolver(problem, False).smooth(at, KEPT_SHARE * at.smallest) if at.smallest > 0.0 else None
        if smooth is None:
            continue
        found = [
            along_path(task, problem, at, axes) for axes in (problem.samples.nominal, smooth_axes(problem, smooth))
        ]
        row: list[float] = []
        for strict, turned, fits in zip(*found, strict_fits(problem, at), strict=True):
            above = (fits & (turned > 1.1 * strict + 0.01 * strict.max())).mean()
            row += [float(np.median(turned) / np.median(strict)), float(turned.max() / strict.max()), float(above)]
        columns.append(row)
        cells = [f"{v:6.2f}x" if k % 3 < 2 else f"{100.0 * v:6.1f}%" for k, v in enumerate(row)]
        print(f"{task.name:58s} {' '.join(cells)}", flush=True)
    middle = np.median(np.array(columns), axis=0)
    print(
        f"{'median':58s} " + " ".join(f"{v:6.2f}x" if k % 3 < 2 else f"{100.0 * v:6.1f}%" for k, v in enumerate(middle))
    )
    print("above: share of the path where strict normals fit and theirs is exceeded by 10 % and by 1 % of its peak\n")


def smooth_axes(problem: PlacementProblem, smooth: np.ndarray) -> np.ndarray:
    """Return the axes (N, 3) of a spline, workpiece frame."""
    return lean(problem.samples.nominal, AxisSpline.of(problem.samples, problem.cone).leans(smooth))


def strict_fits(problem: PlacementProblem, at: Candidate) -> tuple[np.ndarray, np.ndarray]:
    """Return where strict normals are within all limits: for each interval of waypoints, and each even place."""
    task = problem.samples
    fits = at.margins(*task.machine_poses(at.transform, task.nominal), at.transform).min(axis=1) >= NEEDED_MARGIN
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(task.tilt_centres, axis=0), axis=1))])
    between = fits[1:] & fits[:-1]
    even = np.linspace(0.0, way[-1], EVEN_PLACES)[1:-1]
    return between, between[np.clip(np.searchsorted(way, even) - 1, 0, len(between) - 1)]


def along_path(
    task: Instance, problem: PlacementProblem, at: Candidate, axes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return axis rates and second derivatives of the legs along the path, at one density, for axes (N, 3)."""
    tips, turned = problem.samples.machine_poses(at.transform, axes)
    component = at.margins.scene.branch
    values, limits = at.margins(tips, turned, at.transform), at.margins.limits
    placed = PlacedPath(task.toolpath, Placement(at.transform, "benchmark"), component, tips, turned, values, limits)
    path = leg_path(placed, problem.machine, path_tolerance=20e-6, axis_tolerance=np.radians(0.5))
    if isinstance(path, Refusal):
        raise SystemExit(f"no leg path for {task.name}: {path}")
    moved = np.linalg.norm(np.diff(problem.samples.tilt_centres, axis=0), axis=1)
    rate = np.linalg.norm(np.diff(axes, axis=0), axis=1) / np.maximum(moved, 1e-9)
    parameter = np.linspace(0.0, path.length, 20_000)
    tip, axis = path.pose(parameter)
    way = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(tip + problem.samples.tilt_centre * axis, axis=0), axis=1))]
    )
    even = np.linspace(0.0, way[-1], EVEN_PLACES)
    legs = np.stack([np.interp(even, way, leg) for leg in path(parameter).T], axis=1)
    return rate, np.abs(np.diff(legs, 2, axis=0)).max(axis=1) / even[1] ** 2


def visited(task: Instance, count: int, tilt: float) -> ToolpathSamples:
    """Return a task visited at `count` waypoints, evenly along the same path."""
    path = task.toolpath
    at = np.linspace(0.0, len(path) - 1.0, count)
    low = np.minimum(at.astype(np.intp), len(path) - 2)
    share = (at - low)[:, None]
    axes = (1.0 - share) * path.axes[low] + share * path.axes[low + 1]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    tilt_centres = (1.0 - share) * path.tilt_centres[low] + share * path.tilt_centres[low + 1]
    return ToolpathSamples(tilt_centres, axes, path.tilt_centre, tilt)


def dense_dome(count: int) -> ToolpathSamples:
    """Return a dome of 120 mm under a zigzag of `count` waypoints, 0.2 mm apart."""
    half, radius = 0.06, 0.06 / np.sin(np.radians(35.0))
    rows = max(6, int(count * 0.2e-3 / (2.0 * half)))
    passes: list[np.ndarray] = []
    for k, y in enumerate(np.linspace(-0.97 * half, 0.97 * half, rows)):
        x = np.linspace(-1.0, 1.0, count // rows) * np.sqrt(half**2 - y**2) * (-1.0) ** k
        passes.append(np.column_stack([x, np.full_like(x, y)]))
    xy = np.concatenate(passes)
    z = np.sqrt(radius**2 - np.square(xy).sum(axis=1))
    axes = np.column_stack([xy, z]) / radius
    return ToolpathSamples(np.column_stack([xy, z - radius]) + 0.003 * axes, axes, 0.003, np.radians(15.0))


def refusals(tasks: list[Instance], machine: Machine) -> None:
    """Print how long the refusals of enlarged parts take beside the plans of the parts themselves."""
    print(f"{'task':58s} {'plan, s':>8s} {'enlarged':>9s} {'refusal, s':>11s} {'times':>6s}")
    ratios: list[float] = []
    for task in tasks:
        placed, usual = timed(lambda t=task: plan(t.toolpath, machine, tilt=t.tilt))
        if isinstance(placed, Refusal):
            continue
        for factor in (1.5, 2.0, 3.0, 5.0):
            larger = enlarged(task.toolpath, factor)
            answer, seconds = timed(lambda path=larger, t=task: plan(path, machine, tilt=t.tilt))
            if isinstance(answer, Refusal):
                ratios.append(seconds / usual)
                print(f"{task.name:58s} {usual:8.2f} {factor:9.1f} {seconds:11.2f} {ratios[-1]:6.2f}", flush=True)
    print(f"refusals: {np.median(ratios):.2f} times a plan in the median, {min(ratios):.2f} to {max(ratios):.2f}\n")


def enlarged(toolpath: Toolpath, factor: float) -> Toolpath:
    """Return the toolpath of a part that is larger in all directions."""
    segments = [replace(each, tips=factor * each.tips) for each in toolpath.segments]
    return replace(toolpath, segments=tuple(segments))


def growth(machine: Machine) -> None:
    """Print seconds and memory by the number of waypoints, of one part under ever more passes."""
    print("waypoints   raise, s   smooth, s   waypoints a second of smooth   peak memory, kB a waypoint")
    seconds: list[tuple[int, float]] = []
    for count in (1_000, 10_000, 50_000, 100_000, 1_000_000):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        problem = PlacementProblem.of(dense_dome(count), machine)
        raised, up = timed(lambda s=problem: SequentialSolver(s, True).raise_margin(start_of(s)))
        keep = KEPT_SHARE * raised.smallest
        _, down = timed(lambda s=problem, c=raised, k=keep: SequentialSolver(s, False).smooth(c, k))
        memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / count
        seconds.append((count, up + down))
        print(f"{count:9,d} {up:10.2f} {down:9.2f} {count / down:16,.0f} {memory:28.2f}", flush=True)
    (small, short), (large, long) = seconds[1], seconds[-1]
    slope = np.log(long / short) / np.log(large / small)
    print(f"slope of the time from {small:,d} to {large:,d} waypoints, log-log: {slope:.2f}")


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=12, help="how many random tasks")
    count = parser.parse_args().tasks
    machine, tasks = Machine.load("desk"), instances(count)
    print(f"casadi {version('casadi')}, SciPy {version('scipy')}, Python {platform.python_version()}, one core\n")
    against_ipopt(tasks, machine)
    against_ipopt_on_many(tasks, machine)
    tilt_gain(tasks, machine)
    rates(tasks, machine)
    refusals(tasks[:8], machine)
    growth(machine)


if __name__ == "__main__":
    main()
