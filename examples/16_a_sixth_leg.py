"""A sixth leg for a linear pentapod: how leg 6 of the shipped machine `hexa` was found.

    python examples/16_a_sixth_leg.py --tries 2000 --seed 1

Leg 6 holds the platform's turn about the tool axis. Its base joint, the length of its arm and the place of the arm on
the tool axis are drawn at random; a design counts by the smallest clearance of all legs, arm and spindle over the work
volume, less a price where the leg's lengths or its base cone spread. Legs 1 to 5 and all limits are those of `desk`.
Printed are designs that are better than those before, and the figures of the shipped one.
"""

from __future__ import annotations

import argparse
import dataclasses

import numpy as np

from pentapod.geometry.directions import angle_between
from pentapod.kinematics import RolledPlatform, SixLegPlatform, tip_force_amplification
from pentapod.machine import Machine, clearances, sample_work_volume


def with_sixth_leg(desk: Machine, base: np.ndarray, foot: float, arm: float, side: int) -> Machine:
    """Return the machine with leg 6; its joints are open as far as they go, so that bodies decide."""
    robot = RolledPlatform(SixLegPlatform(desk.robot, [*base, 0.0], [arm, 0.0, foot]), side)
    joints, legs = desk.joints, desk.legs
    return dataclasses.replace(
        desk,
        robot=robot,
        rail_positions=np.zeros(1),
        legs=dataclasses.replace(legs, **{f.name: getattr(legs, f.name)[0] for f in dataclasses.fields(legs)}),
        joints=dataclasses.replace(
            joints,
            base_axes=np.vstack([joints.base_axes, [0.0, 0.0, 1.0]]),
            base_cone=np.append(joints.base_cone, 0.5 * np.pi),
            platform_range=np.vstack([joints.platform_range, [0.0, np.pi]]),
        ),
    )


def figures(machine: Machine, rings: int, around: int, levels: int) -> dict[str, float]:
    """Return clearance (mm), ratio of the lengths of leg 6, half angle of its base cone (deg), force by force."""
    tips, axes = sample_work_volume(machine.work, rings=rings, around=around, levels=levels)
    p, i = tips + machine.tool_length * axes, -axes
    gap = float(clearances(machine, p, i).min())
    leg = machine.robot.leg_vectors(p, i)[:, 5]
    length = np.linalg.norm(leg, axis=1)
    middle = (leg / length[:, None]).mean(axis=0)
    return {
        "clearance": 1e3 * gap,
        "ratio": float(length.max() / length.min()),
        "cone": float(np.degrees(angle_between(leg, middle / np.linalg.norm(middle)).max())),
        "from base joint 6": 1e3 * float(np.linalg.norm(np.cross(machine.robot.seen(p, i), i), axis=1).min()),
        "force": float(tip_force_amplification(machine.robot, p, i, machine.tool_length).max()),
    }


def main() -> None:
    """Search, and print the shipped design's figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tries", type=int, default=2000, help="designs that are drawn")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng, desk, best = np.random.default_rng(options.seed), Machine.load("desk"), -np.inf
    for _ in range(options.tries):
        turn, radius, arm = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.4, 0.65), rng.uniform(0.05, 0.12)
        base, side = radius * np.array([np.cos(turn), np.sin(turn)]), int(rng.choice([-1, 1]))
        low, high = [(-0.19, -0.12), (-0.1, 0.1), (0.118, 0.13)][rng.integers(3)]
        machine = with_sixth_leg(desk, base, foot := rng.uniform(low, high), arm, side)
        if figures(machine, 1, 4, 2)["clearance"] < 0.5:
            continue
        found = figures(machine, 1, 8, 2)
        score = found["clearance"] - 20.0 * max(0.0, found["ratio"] - 1.8) - max(0.0, found["cone"] - 30.0)
        if score > best:
            best = score
            x, y = 1e3 * base
            place = f"base {x:.0f}, {y:.0f}, foot {1e3 * foot:.0f}, arm {1e3 * arm:.0f} mm, side {side:+d}"
            print(place, *(f"{name} {value:.3g}" for name, value in found.items()), sep="; ")
    print(
        "shipped:",
        *(f"{name} {value:.3g}" for name, value in figures(Machine.load("hexa"), 2, 16, 3).items()),
        sep="; ",
    )


if __name__ == "__main__":
    main()
