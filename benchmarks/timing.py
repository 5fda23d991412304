"""Time laws against toppra and copp-py in one run, on one core: `make bench-timing`.

Figures are processor time a gridpoint, the best of a few runs, and ratios; peers that are not installed are left out
(pip install copp-py drake ruckig). Paths: "raster", a 0.1 mm zigzag with 1 mm turns and a pentapod's legs, feed 0.1 m/s
(for copp-py the velocity of a sixth axis; none for Drake and in the chain); "sine", smooth, limited by legs alone.
Limits of each leg: 0.5 m/s, 5 m/s², 200 m/s³.
"""

from __future__ import annotations

import argparse
import platform
import resource
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline
from timing_peers import copp_robot, highs, our_chain, socp, toppra_chain
from timing_robots import drake_solver, ruckig_line

from pentapod.timing.jerk.interval import Interval
from pentapod.timing.jerk.jerk_limited import JerkProblem, JerkProfile, jerk_limited
from pentapod.timing.jerk.knots import place_knots
from pentapod.timing.jerk.options import DEFAULTS, JerkOptions
from pentapod.timing.jerk.rows import JerkRows
from pentapod.timing.jerk.subproblem import Subproblem
from pentapod.timing.topp.engine import fastest
from pentapod.timing.topp.reference import solve as solve_by_toppra
from pentapod.timing.topp.stages import Failure, Stages

NO_KINKS = np.empty(0)
VELOCITY, ACCELERATION, JERK, FEED = 0.5, 5.0, 200.0, 0.1


def raster(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Stations (n,) and legs (n, 5) of a zigzag on a wavy surface: rows of 80 mm, turns of 1 mm radius."""
    row, radius = 0.08, 1e-3
    period = row + np.pi * radius
    t = np.arange(n) * 1e-4
    k, u = np.floor(t / period), t % period
    turn = np.clip((u - row) / radius, 0.0, None)
    x = np.minimum(u, row) + radius * np.sin(turn)
    x = np.where(k % 2 == 1, row - x, x) - row / 2
    rows = 40
    folded = np.where(k % (2 * rows) < rows, k % (2 * rows), 2 * rows - k % (2 * rows))
    up = np.where(k % (2 * rows) < rows, 1.0, -1.0)
    y = 2 * radius * folded + up * radius * (1 - np.cos(turn)) - 0.04
    wave = 2 * np.pi * np.array([1 / 0.06, 1 / 0.04])
    z = 0.005 * np.sin(wave[0] * x) * np.cos(wave[1] * y)
    slope = 0.005 * np.stack(
        [wave[0] * np.cos(wave[0] * x) * np.cos(wave[1] * y), -wave[1] * np.sin(wave[0] * x) * np.sin(wave[1] * y)], 1
    )
    tip = np.column_stack([x, y, z])
    axis = np.column_stack([-0.08 * slope, np.ones(n)])
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    angle = np.radians([0, 72, 144, 216, 288])
    base = np.column_stack([0.9 * np.cos(angle), 0.9 * np.sin(angle), [0.9, 1.0, 0.8, 0.95, 0.85]])
    height = np.array([0.15, 0.25, 0.35, 0.45, 0.55])
    legs = np.linalg.norm(tip[:, None] + height[:, None] * axis[:, None] - base, axis=2)
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tip, axis=0), axis=1))]), legs


def sine(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Stations (n,) and legs (n, 5) of sums of four waves."""
    rng, s = np.random.default_rng(1), np.arange(n) * 1e-3
    size = np.array([1, 0.6, 0.3, 0.12])
    legs = np.empty((n, 5))
    for j in range(5):
        wave, phase = np.array([0.13, 0.37, 0.9, 2.1]) * (1 + 0.2 * rng.random(4)), 2 * np.pi * rng.random(4)
        legs[:, j] = (size[:, None] * np.sin(2 * np.pi * wave[:, None] * s + phase[:, None])).sum(0) / size.sum()
    return s, 1 + 0.3 * legs


class Problem:
    """A path through waypoints and what limits it."""

    def __init__(self, kind: str, n: int) -> None:
        """Take the waypoints as gridpoints."""
        self.kind, self.feed = kind, FEED if kind == "raster" else 1e3
        self.s, self.legs = (raster if kind == "raster" else sine)(n)
        self.spline = make_interp_spline(self.s, self.legs, k=5)
        self.q = [self.spline(self.s, nu=k) for k in range(4)]
        self.rows = (self.q[1] / ACCELERATION, self.q[2] / ACCELERATION)
        self.ceiling = self.bound(self.q[1])

    def bound(self, first: np.ndarray) -> np.ndarray:
        """Return the largest x at gridpoints, by velocities and the feed."""
        return np.minimum((VELOCITY / np.abs(first)).min(axis=1), self.feed) ** 2

    def jerk_rows(self, s: np.ndarray) -> JerkRows:
        """Return what the jerk passes ask for."""
        q1, q2, q3 = (self.spline(s, nu=k) for k in (1, 2, 3))
        jerks = np.stack([q3, 1.5 * q2, 0.5 * q1], axis=-1) / JERK
        return JerkRows(q1 / ACCELERATION, q2 / ACCELERATION, np.zeros((1, 5)), jerks, self.bound(q1))

    def solved(self, engine: str) -> np.ndarray:
        """Return ṡ² by one of our engines."""
        x = fastest(self.s, *self.rows, self.ceiling, engine=engine)
        if isinstance(x, Failure):
            raise SystemExit(f"{engine}: {x}")
        return x

    def duration(self, x: np.ndarray) -> float:
        """Return the seconds of a profile linear between gridpoints."""
        root = np.sqrt(x)
        return float((2.0 * np.diff(self.s) / (root[1:] + root[:-1])).sum())


def best(work: Callable[[], Any], runs: int = 5) -> tuple[float, Any]:
    """Return the least processor time of a few runs, in seconds, and the last result."""
    times, result = [], None
    for _ in range(runs):
        start = time.process_time()
        result = work()
        times.append(time.process_time() - start)
    return min(times), result


def toppra_solver(p: Problem) -> Callable[[], np.ndarray]:
    """Return toppra's solve alone, its constraints set up."""
    stages = Stages.of(p.s, *p.rows, p.ceiling)
    return lambda: solve_by_toppra(stages, 0.0, 0.0)


def core(sizes: list[int]) -> None:
    """Velocities and accelerations: the core, toppra and copp-py."""
    for kind in ("raster", "sine"):
        for n in sizes:
            p = Problem(kind, n)
            p.solved("core")
            ours, x = best(lambda p=p: p.solved("core"))
            seconds = p.duration(x)
            line = f"{kind:7s} {n:8d} gridpoints: core {1e6 * ours / n:6.3f} µs"
            if n <= 100_000:
                theirs, y = best(toppra_solver(p), 2)
                same = p.duration(y) / seconds - 1.0
                line += f", toppra {1e6 * theirs / n:6.2f} µs: {theirs / ours:5.0f} times the core; "
                line += f"durations differ by {same:.1e}"
            print(line, flush=True)
            if peer := copp_robot(p.s, p.q, (VELOCITY, ACCELERATION, JERK), p.feed):
                copp, robot = peer
                task = copp.solver.topp2_ra.Problem(robot.constraints, idx_s_interval=(0, n - 1), a_boundary=(0.0, 0.0))
                theirs, y = best(lambda c=copp, t=task: c.solver.topp2_ra.solve(t, c.solver.topp2_ra.Options()), 3)
                same = p.duration(np.asarray(y)) / seconds - 1.0
                print(f"{'':28s} copp-py {1e6 * theirs / n:.2f} µs: {theirs / ours:.1f} times; durations {same:.1e}")


def one_pass(p: Problem, x: np.ndarray) -> tuple[Subproblem, float, float]:
    """Return a pass as the product makes it, and its seconds: as the first one, and as the next."""
    interval = Interval.of(p.s, x, p.jerk_rows, NO_KINKS, (False, False), 0.0)
    problem = Subproblem.on(interval, place_knots(interval, x, 1.0))
    start, x_k = problem.start(), np.minimum(problem.top, problem.ramps)
    problem.improved(start, x_k, 0)
    first, y = best(lambda: problem.improved(start, x_k, 0), 3)
    if not isinstance(y, np.ndarray):
        raise SystemExit("the first pass finds no law")
    inside = np.maximum(problem.values(y)[:, 0], 1e-9 * x.max())
    later, _ = best(lambda: problem.improved(y, inside, 1), 3)
    return problem, first, later


def jerk_law(problem: JerkProblem) -> JerkProfile:
    """Return the jerk-limited profile of a problem that has one."""
    profile = jerk_limited(problem)
    if isinstance(profile, Failure):
        raise SystemExit(str(profile))
    return profile


def jerk(n: int) -> None:
    """Jerk limits: time a pass and the whole law, and how near few passes come to what they settle at."""
    for kind in ("raster", "sine"):
        p = Problem(kind, n)
        x = p.solved("core")
        problem, first, later = one_pass(p, x)
        count, durations, used = len(problem.s), [], 0.0
        for passes in (1, 2, DEFAULTS.passes):
            used, profile = best(
                lambda k=passes, p=p, x=x: jerk_law(JerkProblem(p.s, x, p.jerk_rows, NO_KINKS, JerkOptions(k))), 2
            )
            durations.append(profile.nodes.law().duration)
        print(
            f"{kind:7s} {count:8d} gridpoints, jerk: first pass {1e6 * first / count:.1f} µs, the next "
            f"{1e6 * later / count:.1f} µs; the whole law {1e6 * used / n:.1f} µs for each of {n} gridpoints given; "
            f"durations with at most 1, 2, {DEFAULTS.passes} passes: " + ", ".join(f"{d:.4f}" for d in durations)
            + f" s (without jerk limits {p.duration(x):.4f} s)",
            flush=True,
        )  # fmt: skip


def jerk_peers(n: int) -> None:
    """One pass of ours, by HiGHS and by copp-py's TOPP3-SOCP, for the same path; and what these settle at."""
    for kind in ("raster", "sine"):
        p = Problem(kind, n)
        x = p.solved("core")
        problem, first, later = one_pass(p, x)
        count = len(problem.s)
        line = f"{kind:7s} {count} gridpoints: our first pass {1e6 * first / count:.1f} µs, the next "
        line += f"{1e6 * later / count:.1f} µs"
        used, _ = best(highs(problem), 1)
        line += f"; HiGHS {1e6 * used / count:.0f} µs: {used / first:.0f} times the first"
        if peer := copp_robot(p.s, p.q, (VELOCITY, ACCELERATION, JERK), p.feed):
            solves, durations = socp(peer, x, p.s, 6)
            used, _ = best(solves[0], 1)
            profile = jerk_law(JerkProblem(p.s, x, p.jerk_rows, NO_KINKS))
            ours = profile.nodes.law().duration
            line += f"; TOPP3-SOCP {1e6 * used / len(p.s):.0f} µs: {used / len(p.s) / (first / count):.0f} times; "
            line += f"durations {ours:.4f} s, SOCP's " + ", ".join(f"{d:.4f}" for d in durations)
        print(line, flush=True)


def chain(n: int) -> None:
    """From waypoints to samples every millisecond, velocities and accelerations: ours and toppra's."""
    for kind in ("raster", "sine"):
        p = Problem(kind, n)
        ours, theirs = (make(p.s, p.legs, VELOCITY, ACCELERATION, 1e-3) for make in (our_chain, toppra_chain))
        ours()
        fast, rows = best(ours, 20)
        slow, others = best(theirs, 2)
        print(
            f"{kind:7s} {n} waypoints to {len(rows)} samples: {1e3 * fast:.1f} ms, toppra {1e3 * slow:.0f} ms "
            f"({len(others)} samples): {slow / fast:.0f} times",
            flush=True,
        )


def largest(s: np.ndarray, rows: tuple[np.ndarray, np.ndarray], x: np.ndarray) -> float:
    """Return the largest share of an acceleration limit at the ends of stages."""
    u = (np.diff(x) / (2.0 * np.diff(s)))[:, None]
    ends = (slice(None, -1), slice(1, None))
    return max(float(np.abs(rows[0][at] * u + rows[1][at] * x[at, None]).max()) for at in ends)


def drake(n: int) -> None:
    """Velocities and accelerations by Drake's TOPP-RA, on Drake's own spline through the waypoints."""
    for kind in ("raster", "sine"):
        p = Problem(kind, n)
        if not (peer := drake_solver(p.s, p.legs, VELOCITY, ACCELERATION)):
            print("Drake: not installed")
            return
        solve, (first, second) = peer
        ceiling = np.square((VELOCITY / np.abs(first)).min(axis=1))
        rows = first / ACCELERATION, second / ACCELERATION
        ours, x = best(lambda s=p.s, rows=rows, ceiling=ceiling: fastest(s, *rows, ceiling))
        if isinstance(x, Failure):
            raise SystemExit(str(x))
        theirs, y = best(solve, 2)
        line = f"{kind:7s} {n:8d} gridpoints: core {1e6 * ours / n:.3f} µs, Drake {1e6 * theirs / n:.0f} µs: "
        line += f"{theirs / ours:.0f} times; "
        if isinstance(y, np.ndarray):
            line += f"durations differ by {p.duration(y) / p.duration(x) - 1.0:.1e}; largest share of an acceleration "
            line += f"limit: core {largest(p.s, rows, x):.4f}, Drake {largest(p.s, rows, y):.4f}"
        else:
            line += "it finds no law"
        print(line, flush=True)


def line(n: int) -> None:
    """Time a straight line from rest to rest with jerk limits, where ruckig's answer is the optimum."""
    way = np.array([0.3, -0.2, 0.12, 0.05, 0.25])
    if not (peer := ruckig_line(way, (VELOCITY, ACCELERATION, JERK))):
        print("ruckig: not installed")
        return
    solve, optimum = peer
    theirs, _ = best(solve, 20)
    s = np.linspace(0.0, 1.0, n)
    first = np.broadcast_to(way, (n, 5))
    bound = np.square((VELOCITY / np.abs(first)).min(axis=1))
    x = fastest(s, first / ACCELERATION, 0.0 * first, bound)

    def rows(s: np.ndarray) -> JerkRows:
        q1 = np.broadcast_to(way, (len(s), 5))
        jerks = np.stack([0.0 * q1, 0.0 * q1, 0.5 * q1], axis=-1) / JERK
        return JerkRows(q1 / ACCELERATION, 0.0 * q1, np.zeros((1, 5)), jerks, np.full(len(s), bound[0]))

    ours, profile = best(lambda: jerk_law(JerkProblem(s, x, rows, NO_KINKS)), 3)
    seconds = profile.nodes.law().duration
    print(
        f"line    {len(profile.nodes.s):8d} gridpoints with jerk limits, from rest to rest: {seconds:.5f} s in "
        f"{1e3 * ours:.1f} ms; the optimum, by ruckig without a path: {optimum:.5f} s in {1e3 * theirs:.3f} ms; "
        f"ours is longer by {seconds / optimum - 1:.1e}"
    )


def million(n: int) -> None:
    """Time a long path: feed, leg velocities, accelerations and jerks, from the path to a law."""
    p = Problem("raster", n)
    x = p.solved("core")
    s, base = p.s, p.s[-1]
    start, wall = time.process_time(), time.perf_counter()
    profile = jerk_law(JerkProblem(s, x, p.jerk_rows, NO_KINKS))
    profile.nodes.law()
    count = len(profile.nodes.s)
    used = time.process_time() - start
    print(
        f"long path: {n} gridpoints ({base:.0f} m), {count} with jerk limits, all passes and "
        f"the law: {used:.1f} s ({1e6 * used / n:.1f} µs a gridpoint, wall {time.perf_counter() - wall:.1f} s); "
        f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.2f} GB"
    )


def versions() -> str:
    """Return what runs here."""
    names = []
    for name in ("numpy", "numba", "toppra", "copp-py", "drake", "ruckig"):
        try:
            names.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            names.append(f"{name} not installed")
    return f"Python {platform.python_version()} on {platform.machine()}; " + ", ".join(names)


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[10_000, 100_000, 1_000_000])
    parser.add_argument("--jerk", type=int, default=10_000)
    parser.add_argument("--peers", type=int, default=2_000)
    parser.add_argument("--drake", type=int, default=1_000)
    parser.add_argument("--chain", type=int, default=10_000)
    parser.add_argument("--long", type=int, default=1_000_000)
    arguments = parser.parse_args()
    print(versions())
    million(arguments.long)  # first: the peak of memory is its own
    core(arguments.sizes)
    jerk(arguments.jerk)
    jerk_peers(arguments.peers)
    drake(arguments.drake)
    line(arguments.drake)
    chain(arguments.chain)


if __name__ == "__main__":
    main()
