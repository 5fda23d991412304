"""Figures of the shipped machines: what they reach, how stiff they are, and how well power-on tells their modes apart.

    python benchmarks/machines.py            # or: make bench-machines

Reachable poses are drawn evenly from a box around the work volume and from the half sphere of directions, and kept
where strokes, cones and bodies allow them in the work volume's component. "another": the share of them in which a
second mode fits the same legs. The peer, "by strokes", is a controller that checks the strokes alone.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from pentapod.base.refusal import Refusal
from pentapod.geometry.directions import angle_between
from pentapod.machine import Machine, admissible_modes, check, clearances, shipped_machines


def reachable(machine: Machine, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and directions of the poses, of `count` drawn, that the machine can take."""
    rng, joints, legs, robot = np.random.default_rng(seed), machine.joints, machine.legs, machine.robot
    i = rng.normal(size=(count, 3))
    i /= np.linalg.norm(i, axis=1, keepdims=True)
    i[:, 2] = np.abs(i[:, 2])
    size = float(np.linalg.norm(robot.base_joints, axis=1).max())
    p = machine.work.centre + size * rng.uniform(-0.6, 0.6, (count, 3)) - machine.tool_length * i
    vectors = robot.leg_vectors(p, i)
    length, platform = np.linalg.norm(vectors, axis=2), angle_between(-vectors, -i[:, None, :])
    fits = ((length > legs.min_length) & (length < legs.max_length)).all(axis=1)
    fits &= (angle_between(vectors, joints.base_axes) < joints.base_cone).all(axis=1)
    fits &= ((platform > joints.platform_range[:, 0]) & (platform < joints.platform_range[:, 1])).all(axis=1)
    fits[fits] &= clearances(machine, p[fits], i[fits]).min(axis=1) > 0.0
    down = np.array([0.0, 0.0, 1.0])
    fits &= (robot.branch(p, i) == robot.branch(machine.work.centre - machine.tool_length * down, down)).all(axis=1)
    return p[fits], i[fits]


def main() -> None:
    """Print a line for each machine."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=2000, help="reachable poses for each machine")
    options = parser.parse_args()
    print("machine        tilt  base   legs          forces  clearance  singular  another  by strokes  refused  ms")
    for name in shipped_machines():
        machine = Machine.load(name)
        report = check(machine)
        p, i = reachable(machine, 400 * options.poses, 1)
        p, i = p[: options.poses], i[: options.poses]
        legs = machine.robot.leg_lengths(p, i)
        several, by_strokes, refused, start = 0, 0, 0, time.perf_counter()
        for row in legs:
            found = admissible_modes(machine, row)
            if isinstance(found, Refusal):
                refused += 1
            else:
                several += len(found.admissible) > 1
                by_strokes += len(found.poses) > 1  # readings within their strokes exclude no mode
        each = (time.perf_counter() - start) / max(len(legs), 1)
        near = min(m for m, s in zip(report.margins, machine.robot.singularities, strict=True) if s.unit == "mm")
        radius = np.linalg.norm(machine.robot.base_joints, axis=1).max()
        print(
            f"{name:<14} {np.degrees(machine.work.tilt):3.0f}°  {1e3 * radius:4.0f}  "
            f"{1e3 * machine.legs.min_length.min():4.0f} to {1e3 * machine.legs.max_length.max():4.0f}  "
            f"{report.amplification:6.2f}  {1e3 * report.clearance:6.1f} mm  {1e3 * near:5.0f} mm  "
            f"{several / max(len(legs), 1):7.2%}  {by_strokes / max(len(legs), 1):10.0%}  {refused:7d}  "
            f"{1e3 * each:.1f}   ({len(legs)} poses)",
            flush=True,
        )


if __name__ == "__main__":
    main()
