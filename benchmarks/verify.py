"""Verdict on a million rows: seconds, memory, and each part against what others offer for it.

Gouges and collisions are judged too, against a mesh of the hill that the program machines, with shank and holder.
Reading against numpy.loadtxt; how far the motion strays between samples against the same proof in ball arithmetic
(`prove_tip_tube`); the whole verdict against merely loading the file with numpy.loadtxt. CPU seconds of one process.
"""

from __future__ import annotations

import argparse
import platform
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from pentapod import Machine, Program, Provenance, Toolpath
from pentapod.cutters.ball import BallCutter
from pentapod.geometry.interpolant import Interpolant
from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.solids import Cone
from pentapod.kinematics import Component, prove_tip_tube
from pentapod.machine.clearance.collision_world import CollisionWorld, Obstacle, mounted
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.planning.problem.constraints import FREE
from pentapod.program import quantised, read_csv, write_csv
from pentapod.toolpath import Segment, SegmentKind
from pentapod.verify import Cutting, verify

BALL, FEED, RAMP = 3e-3, 0.025, 0.5


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Return CPU seconds and what the work gave."""
    start = time.process_time()
    value = work()
    return time.process_time() - start, value


def curve(s: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return tips and axes (n, 3) at arc lengths s: a spiral over a hill, 30 mm wide."""
    turns = length / (2.0 * np.pi * 0.02)
    angle = 2.0 * np.pi * turns * s / length
    radius = 0.02 + 0.01 * np.sin(np.pi * s / length)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    tips = np.stack([x, y, 4e-3 * np.cos(x / 0.02) * np.cos(y / 0.03)], axis=-1)
    normal = np.stack(
        [0.2 * np.sin(x / 0.02) * np.cos(y / 0.03), 4.0 / 30.0 * np.cos(x / 0.02) * np.sin(y / 0.03), np.ones_like(x)],
        axis=-1,
    )
    return tips, normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def case(rows: int, waypoints: int) -> tuple[Machine, Toolpath, Program]:
    """Return a machine, a spiral of so many waypoints, and a program of so many rows that follows it."""
    machine = Machine.load("desk")
    period = machine.controller.period
    duration = (rows - 1) * period
    speed = 0.65 * FEED
    length = speed * (duration - RAMP)
    t = np.arange(rows) * period
    # From rest to rest: the ramp is a sine squared of the time.
    up, down = np.minimum(t, RAMP), np.minimum(duration - t, RAMP)
    ramp = up / 2.0 - RAMP * np.sin(np.pi * up / RAMP) / (2.0 * np.pi)
    fall = down / 2.0 - RAMP * np.sin(np.pi * down / RAMP) / (2.0 * np.pi)
    s = np.clip(
        speed * np.where(t < RAMP, ramp, np.where(duration - t < RAMP, length / speed - fall, t - RAMP / 2.0)),
        0.0,
        length,
    )
    place = RigidTransform(np.diag([1.0, -1.0, -1.0]), machine.work.centre)
    tips, axes = curve(s, length)
    direction = -place.rotate(axes)
    legs = machine.robot.leg_lengths(place.apply(tips) - machine.tool_length * direction, direction)
    source = Provenance(machine.name, machine.digest, "bench", "0")
    program = Program(period, quantised(legs), machine.controller.interpolation, Component(1, 1), place, source)
    cut = Segment(SegmentKind.CUT, *curve(np.linspace(0.0, length, waypoints), length), FEED)
    return machine, Toolpath((cut,), tilt_centre=BALL), program


def hill(cells: int) -> Mesh:
    """Return the surface that the spiral lies on, as an open sheet."""
    side = np.linspace(-0.04, 0.04, cells + 1)
    x, y = (q.ravel() for q in np.meshgrid(side, side, indexing="ij"))
    k = np.arange(len(x)).reshape(cells + 1, cells + 1)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    facets = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh.of(np.stack([x, y, 4e-3 * np.cos(x / 0.02) * np.cos(y / 0.03)], axis=-1), facets)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--waypoints", type=int, default=100_000)
    parser.add_argument("--cells", type=int, default=200, help="of the hill's mesh, each way")
    given = parser.parse_args()
    _, toolpath, program = (machine, *_) = case(given.rows, given.waypoints)
    tolerances = {
        "tilt": 0.0,
        "path_tolerance": 20e-6,
        "axis_tolerance": np.radians(0.5),
        "lowest_share": 0.0,
        "job_digest": "bench",
        "waived": ("surface left on the region",),
    }
    surface = MeshDistance.of(hill(given.cells))
    tool = BallCutter(BALL, shank=(Cone(0.03, 2e-3, 2e-3),), holder=(Cone(0.02, 8e-3, 8e-3),))
    around = CollisionWorld((Obstacle("part", surface, clamped=True, allowance=5e-5),), mounted(tool.solids, machine))
    tolerances |= {"collision_world": around, "constraints": FREE, "cutting": Cutting(surface, tool.solids, 5e-5)}
    with tempfile.TemporaryDirectory() as folder:
        short, path = Path(folder, "short.csv"), Path(folder, "program.csv")
        # Kernels compile and load once on a machine, not for each program.
        write_csv(case(2000 + 5000, 700)[2], short)
        little = case(7000, 700)
        verify(short, little[0], little[1], **tolerances)
        write_csv(program, path)
        component = program.component
        part = Interpolant.through(program.legs[:2001], program.period, program.interpolation).bernstein
        del program
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        seconds, verdict = timed(lambda: verify(path, machine, toolpath, **tolerances))
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        reading, _ = timed(lambda: read_csv(path))
        loading, _ = timed(lambda: np.loadtxt(path, delimiter=",", comments="#", skiprows=11))
        ball, _ = timed(lambda: prove_tip_tube(machine.robot, part, component))
        size = path.stat().st_size
    rows, words = given.rows, "passed" if verdict.passed else "FAILED"
    print(f"{platform.machine()}, Python {platform.python_version()}, NumPy {np.__version__}")
    print(f"program: {rows:,} rows, {size / 1e6:.0f} MB, {given.waypoints:,} waypoints; verdict {words}")
    for certificate in verdict.certificates:
        if not certificate.passed:
            print(f"  FAIL {certificate.claim}: {certificate.value} ({certificate.bound}) {certificate.method}")
    for claim in verdict.not_judged:
        print(f"  not judged: {claim.claim}: {claim.why}")
    memory = f"peak {peak / 1024:.0f} MB (before it {before / 1024:.0f} MB)"
    gouge = next(c for c in verdict.certificates if c.claim == "gouge on cuts and links")
    print(f"gouge: {gouge.value:.4g} mm of {gouge.bound:.4g} mm, {2 * given.cells**2:,} facets")
    print(f"verify: {seconds:.1f} s, {1e6 * seconds / rows:.1f} µs/row, {memory}")
    print(f"reading: read_csv takes {reading:.2f} s, {reading / loading:.2f} × the {loading:.2f} s of numpy.loadtxt")
    print(f"the whole verdict takes {seconds / loading:.1f} × what numpy.loadtxt takes to load the file")
    per = 1e6 * ball / len(part)
    print(f"prove_tip_tube alone: {per:.0f} µs/row, {per * rows / 1e6 / seconds:.1f} × the whole verdict")


if __name__ == "__main__":
    main()
