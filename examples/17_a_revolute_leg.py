"""A 4-UPS+SPR robot: how the shipped machine `spr` was found.

    python examples/17_a_revolute_leg.py --seconds 120 --seed 2

Unknown are the five base joints, where legs 1 to 4 end on the platform, the foot of leg 5 on the tool axis, and where
the work lies: 26 numbers. A design is priced over the work volume by what it lacks of clearance, distance from singular
surfaces, short legs and small forces; a random search with shrinking steps lowers the price, from many starts. Printed
are designs that are better than those before, and the figures of the shipped one.
"""

from __future__ import annotations

import argparse
import dataclasses
import time

import numpy as np

from pentapod.base.errors import MachineError
from pentapod.kinematics import tip_force_amplification
from pentapod.kinematics.arithmetic import NUMPY
from pentapod.kinematics.mode import Mode
from pentapod.kinematics.platforms.constrained import ConstrainedPlatform
from pentapod.machine import Machine, clearances, sample_work_volume

STEPS = np.array([0.3] * 5 + [0.05] * 5 + [0.5] * 4 + [0.02] * 4 + [0.04] * 5 + [0.03, 0.03, 0.04])
LOW = np.array([-20.0] * 5 + [0.35] * 5 + [-20.0] * 4 + [0.04] * 4 + [-0.15] * 5 + [-0.15, -0.15, 0.38])
HIGH = np.array([20.0] * 5 + [0.65] * 5 + [20.0] * 4 + [0.13] * 4 + [0.11] * 5 + [0.15, 0.15, 0.65])


def machine_of(design: np.ndarray, like: Machine) -> Machine:
    """Return the machine of 26 numbers: azimuths and radii at the base, at the platform, heights, work centre."""
    turn, radius, around, arm, heights, centre = np.split(design, [5, 10, 14, 18, 23])
    base = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)
    beside = np.vstack([np.stack([arm * np.cos(around), arm * np.sin(around)], axis=1), [0.0, 0.0]])
    home = centre - [0.0, 0.0, like.tool_length]
    robot = ConstrainedPlatform(base, np.column_stack([beside, heights]), "revolute leg", home)
    return dataclasses.replace(like, robot=robot, work=dataclasses.replace(like.work, centre=centre))


def figures(machine: Machine, around: int, levels: int) -> dict[str, float]:
    """Return the worst values over the work volume: mm, ratio of lengths, N/N."""
    tips, axes = sample_work_volume(machine.work, rings=1, around=around, levels=levels)
    p, i = tips + machine.tool_length * axes, -axes
    robot = machine.robot
    signs = robot.branch(p, i)
    mode = Mode(*(int(sign) or 1 for sign in signs[0]))
    _, surface, through = robot.singularity_margins(list(p.T), list(i.T), mode, NUMPY)
    legs = robot.leg_lengths(p, i)
    return {
        "clearance": 1e3 * float(clearances(machine, p, i).min()),
        "singular surface": 1e3 * float(surface.min()),
        "base joint 5": 1e3 * float(through.min()),
        "ratio": float(legs.max() / legs.min()),
        "force": float(tip_force_amplification(robot, p, i, machine.tool_length).max()),
        "components": float(len(np.unique(signs, axis=0))),
    }


def price(found: dict[str, float]) -> float:
    """Return what a design lacks, 0 where it lacks nothing."""
    short = {"clearance": (5.0, 20.0), "singular surface": (170.0, 0.4), "base joint 5": (200.0, 0.3)}
    lacks = sum(weight * max(0.0, wanted - found[name]) for name, (wanted, weight) in short.items())
    lacks += 100.0 * max(0.0, found["ratio"] - 1.85) + 10.0 * max(0.0, min(found["force"], 1e3) - 5.8)
    return lacks + 500.0 * (found["components"] - 1.0)


def main() -> None:
    """Search, and print the shipped design's figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=2)
    options = parser.parse_args()
    rng, like, best = np.random.default_rng(options.seed), Machine.load("spr"), np.inf
    end = time.monotonic() + options.seconds
    while time.monotonic() < end and best > 0.0:
        design, least, step, idle = LOW, np.inf, 1.0, 0
        while idle < 120 and time.monotonic() < end:
            moved = design + step * STEPS * (rng.random(26) < 0.25) * rng.normal(size=26)
            trial = np.clip(moved, LOW, HIGH) if np.isfinite(least) else rng.uniform(LOW, HIGH)
            try:
                found = figures(machine_of(trial, like), 8, 2)
            except MachineError:  # too short a tool, or singular everywhere
                continue
            if not (value := price(found)) < least:
                idle, step = idle + 1, max(0.97 * step, 0.05)
                continue
            design, least, idle, step = trial, value, 0, min(1.3 * step, 1.0)
            if value < best:
                best = value
                print(f"lacks {value:.1f}", *(f"{name} {x:.3g}" for name, x in found.items()), sep="; ", flush=True)
                if value == 0.0:
                    print(np.array2string(design, precision=4, max_line_width=110))
    print("shipped:", *(f"{name} {x:.3g}" for name, x in figures(Machine.load("spr"), 16, 3).items()), sep="; ")


if __name__ == "__main__":
    main()
