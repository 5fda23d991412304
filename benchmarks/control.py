"""Control: asked and reached. The module, the player and contour correction for LinuxCNC; forces and deflection.

Microseconds, differences, cold starts. Compiled as halcompile does (-Os). Forces and deflection: against MuJoCo.
Jogs in LinuxCNC itself: PENTAPOD_JOG_POSES=200 pytest
tests/program/posts/test_linuxcnc_by_hand.py -m slow, 40 s a pose.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import mujoco
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))


from compiled_contour import LAGS, REST, Contour, commanded, contour_um, lagging
from compiled_kinematics import Compiled, calibrated, poses, world_of
from elastic_legs import deflections, left
from linuxcnc_kinematics import MODULE, asked
from mujoco_forces import MACHINES, by_mujoco, curves, loaded
from pentapod.kinematics import AsBuiltPentapod
from pentapod.machine import Machine
from pentapod.machine.dynamics.dynamics import Dynamics
from pentapod.simulate import Reference, simulate_servo
from pentapod.simulate.paced import Player
from pentapod.timing.topp.engine import fastest
from played_overrides import fast_program, off_path, played, random_overrides, shares
from short_motion import motion
from timing import Problem

LEAST = np.array([0.1, 20.0, 0.0, 0.0, 0.0, 1.0, 1.0])
FAST = np.array([1000.0, 1000.0, 1000.0, 289.4, 289.4])
ROUNDS = 7


def microseconds(work: Callable[[], object], count: int, rounds: int = ROUNDS) -> float:
    """Return the least CPU time of a few rounds, by one of `count`."""
    found = np.inf
    for _ in range(rounds):
        start = time.process_time()
        work()
        found = min(found, time.process_time() - start)
    return 1e6 * found / count


def row(what: str, bound: str, reached: str) -> None:
    """Print one line of the table."""
    print(f"{what:<58}{bound:>14}{reached:>16}")


def speeds(name: str, machine: Machine, module: Compiled, count: int) -> None:
    """Time forward and inverse kinematics and the guard."""
    p, i = poses(machine, count)
    world = world_of(machine, p, i)
    legs, _ = module.inverses(world)
    row(f"{name}: legs to XYZAB, µs", "0.2", f"{microseconds(lambda: module.worlds(legs), count):.3f}")
    row(
        f"{name}: XYZAB to legs with all margins, µs",
        "0.3",
        f"{microseconds(lambda: module.inverses(world), count):.3f}",
    )
    here = np.cumsum(np.tile([1e-5, -2e-5, 1e-5, 2e-6, -1e-6], (count, 1)), axis=0)
    moving, _ = module.inverses(here)
    guard = microseconds(lambda: module.guards(moving, False, LEAST, FAST), count)
    row(f"{name}: guard, µs", "3", f"{guard:.3f}")


def correction(name: str, machine: Machine, folder: Path, count: int) -> None:
    """Time the contour correction; and what it leaves of the error of drives that lag, against the simulation."""
    commands = np.repeat(commanded(6.0), count // 6600 + 1, axis=0)[:count]
    module = Contour(machine, folder, ("-Os",))
    spent = microseconds(lambda: module.run(commands, LAGS), count)
    row(f"{name}: contour correction, µs", "", f"{spent:.3f}")


def worth(folder: Path) -> None:
    """Compare the largest contour errors of the short motion with drives that lag, and those of the simulation."""
    program, machine = motion(6.0)[0], lagging(Machine.load("desk"))
    module, reference = Contour(machine, folder), Reference(program, machine)
    for on, words in ((False, "without"), (True, "with")):
        run = module.run(commanded(6.0), LAGS, on, bound=0.5)
        legs = run.legs[REST : REST + len(program.legs)] / 1e3
        found = contour_um(machine, reference, legs).max()
        row(f"desk, lags of 11 to 14 ms: µm off the path, {words} correction", "", f"{found:.2f}")
        predicted = contour_um(machine, reference, simulate_servo(reference, correct=on).unwrap().legs).max()
        row("  the same by `simulate`", "", f"{predicted:.2f}")


def starts(name: str, machine: Machine, module: Compiled, count: int) -> None:
    """Count cold starts that end elsewhere, or nowhere."""
    wrong = missing = 0
    largest = 0.0
    for seed in range(max(count // 200_000, 1)):
        p, i = poses(machine, min(count, 200_000), seed + 1)
        found = module.lines(1e3 * machine.robot.leg_lengths(p, i))
        off = np.abs(found[:, :3] - 1e3 * p).max(axis=1)
        missing += int(np.isnan(off).sum())
        wrong += int((off > 1e-6).sum())
        largest = max(largest, float(np.nanmax(off)))
    row(f"{name}: cold starts wrong, of {count}", "0", str(wrong))
    row(f"{name}: cold starts without a pose, of {count}", "0", str(missing))
    row(f"{name}: largest error of a point, mm", "", f"{largest:.1e}")


def against_pentakins(module: Compiled, folder: Path) -> None:
    """Compare legs with those of LinuxCNC's own pentakins."""
    machine = Machine.load("desk")
    p, i = poses(machine, 2000)
    tilts = np.degrees(np.stack([np.arcsin(-i[:, 1]), np.arctan2(i[:, 0], i[:, 2])], axis=1))
    theirs, _, _ = asked(AsBuiltPentapod.of(machine.robot), p, tilts, folder)
    ours, _ = module.inverses(world_of(machine, p, i))
    row("desk: legs against pentakins, mm", "1e-9", f"{np.abs(ours - 1e3 * theirs).max():.1e}")


def overrides(seeds: int) -> None:
    """Play a program near its limits with random steps of the override, holds and resumes among them."""
    program, machine = fast_program()
    player, most, off = Player(program, machine), 0.0, 0.0
    for seed in range(seeds):
        # Then at full speed to the end: a run that ends on the way has a last row that is not at rest.
        wanted = np.append(random_overrides(20_000, seed), np.ones(len(program.legs)))
        legs, places, _, _ = played(player, wanted)
        most = max(most, *shares(machine, legs, program.period))
        off = max(off, off_path(program, legs, places))
    row(f"player, {seeds} random overrides: largest share of a limit", "1", f"{most:.6f}")
    row("player: legs beside the path, µm", "1", f"{1e6 * off:.1e}")


def forces(count: int) -> None:
    """Compare forces of the drives with MuJoCo's inverse dynamics, and time them."""
    for name in MACHINES:
        machine = loaded(name)
        curve, x, u = curves(machine, count, 3)
        ours = Dynamics.of(machine).along(curve).forces(x, u)
        states = ([(tips[k], axes[k]) for tips, axes in curve] for k in range(count))
        theirs = np.array([by_mujoco(mujoco, machine, at, x[k], u[k]) for k, at in enumerate(states)])
        row(f"{name}: forces against MuJoCo, {count} states, N", "1e-6", f"{np.abs(ours - theirs).max():.1e}")
        many, dynamics = curves(machine, 20_000, 4)[0], Dynamics.of(machine)
        spent = microseconds(partial(dynamics.along, many), 20_000)
        row(f"{name}: forces, µs a gridpoint", "3", f"{spent:.2f}")


def passes(n: int) -> None:
    """Compare a time law's passes over rows of forces, which have an offset, with those over as many without one."""
    problem = Problem("sine", n)
    offset = np.full_like(problem.rows[0], 0.3)
    times = [
        microseconds(partial(fastest, problem.s, *problem.rows, problem.ceiling, offset=weight), n)
        for weight in (None, offset)
    ]
    row("time law's passes over forces, times those over accelerations", "1.2", f"{times[1] / times[0]:.2f}")


def yielding(seeds: int) -> None:
    """Compare deflection, and what commands leave of it, with MuJoCo where legs are springs."""
    apart = [
        np.linalg.norm(found - expected) / np.linalg.norm(expected)
        for seed in range(1, seeds + 1)
        for expected, found in deflections(seed)
    ]
    row(f"deflection against MuJoCo, {len(apart)} cases, %", "1", f"{100.0 * max(apart):.2f}")
    rests: dict[tuple[str, float], list[float]] = {}
    for seed in range(1, seeds + 1):
        for name, softer, sag, rest in left(seed):
            rests.setdefault((name, softer), []).append(rest / sag)
    for (name, softer), found in rests.items():
        bound = 20 if softer else 3 if "force" in name else 2
        words = f", legs {softer:.0%} softer" if softer else ""
        row(f"compensation of {name} leaves, %{words}", f"{bound}", f"{100.0 * max(found):.2f}")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=1_000_000)
    count = parser.parse_args().starts
    compiler = subprocess.run(["cc", "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    print(compiler)
    row("", "asked", "reached")
    machines = {
        "desk": Machine.load("desk"),
        "as built": calibrated(3),
        "as built, rings of 12 mm": calibrated(4, 0.012),
    }
    with tempfile.TemporaryDirectory() as scratch:
        for name, machine in machines.items():
            module = Compiled(machine, Path(scratch) / name.replace(" ", "-"), ("-Os",))
            speeds(name, machine, module, 100_000)
            correction(name, machine, Path(scratch) / f"{name}-contour".replace(" ", "-"), 100_000)
            starts(name, machine, module, count)
            if name == "desk" and MODULE.exists():
                against_pentakins(module, Path(scratch))
        worth(Path(scratch) / "worth")
    overrides(10)
    forces(1000)
    passes(100_000)
    yielding(3)


if __name__ == "__main__":
    main()
