"""Robots whose passive joints decide the platform's turn: how the shipped machines `spr` and `prpu` were found.

    python examples/17_passive_joints.py --machine prpu --seconds 120 --seed 2

Unknown are the base joints, where the legs end on the platform, where the work lies, and of `prpu` the passive limb's
rail and universal joint: 26 and 31 numbers. A design is priced over the work volume by what it lacks of clearance,
distance from singular surfaces, short legs, a short strut and small forces; a random search with shrinking steps lowers
the price, from many starts. Printed are designs that are better than those before, what a good one needs of strokes and
joints, and the figures of the shipped one.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from collections.abc import Callable

import numpy as np

from pentapod.base.errors import MachineError
from pentapod.geometry.directions import angle_between
from pentapod.kinematics import tip_force_amplification
from pentapod.kinematics.arithmetic import NUMPY
from pentapod.kinematics.mode import Mode
from pentapod.kinematics.platforms.constrained import ConstrainedPlatform
from pentapod.machine import Machine, clearances, sample_work_volume
from pentapod.machine.bars import PassiveLimb
from pentapod.planning.limits.leg_pairs import LegPairClearance
from pentapod.planning.limits.leg_spindle import LegSpindleClearance
from pentapod.planning.limits.margins import Margins

Range = tuple[float, float, float]
TURN, BASE, ARM, HEIGHT = (-20.0, 20.0, 0.3), (0.35, 0.65, 0.05), (0.04, 0.13, 0.02), (-0.15, 0.11, 0.04)
CENTRE: list[Range] = [(-0.15, 0.15, 0.03), (-0.15, 0.15, 0.03), (0.38, 0.65, 0.04)]
LIMB: list[Range] = [(-20.0, 20.0, 0.3), (-0.2, 0.2, 0.03), (-0.15, -0.03, 0.02)]
NUMBERS = {
    "spr": [*[TURN] * 5, *[BASE] * 5, *[TURN] * 4, *[ARM] * 4, *[HEIGHT] * 5, *CENTRE],
    "prpu": [*[TURN] * 5, *[BASE] * 5, *[TURN] * 5, *[ARM] * 5, *[HEIGHT] * 5, *CENTRE, *LIMB],
}
"""Least, greatest and step of each number: azimuths and radii at the base and the platform, heights, work centre."""


def around(turn: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Return points (n, 2) of azimuths and radii."""
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)


def spr_of(design: np.ndarray, like: Machine) -> Machine:
    """Return the 4-UPS+SPR machine of 26 numbers."""
    turn, radius, beside, arm, heights, centre = np.split(design, [5, 10, 14, 18, 23])
    joints = np.column_stack([np.vstack([around(beside, arm), [0.0, 0.0]]), heights])
    robot = ConstrainedPlatform(around(turn, radius), joints, "revolute leg", centre - [0.0, 0.0, like.tool_length])
    return dataclasses.replace(like, robot=robot, work=dataclasses.replace(like.work, centre=centre))


def prpu_of(design: np.ndarray, like: Machine) -> Machine:
    """Return the 5-UPS+PRPU machine of 31 numbers; the last ones: azimuth and distance of the rail, universal joint."""
    turn, radius, beside, arm, heights, centre, (rail, aside, joint) = np.split(design, [5, 10, 15, 20, 25, 28])
    along, across = np.array([np.cos(rail), np.sin(rail), 0.0]), np.array([-np.sin(rail), np.cos(rail), 0.0])
    assert like.limb is not None
    limb = dataclasses.replace(like.limb, rail=along, origin=aside * across, joint=float(joint))
    joints, home = np.column_stack([around(beside, arm), heights]), centre - [0.0, 0.0, like.tool_length]
    robot = ConstrainedPlatform(around(turn, radius), joints, "universal joint", home, along[:2])
    return dataclasses.replace(like, robot=robot, limb=limb, work=dataclasses.replace(like.work, centre=centre))


MAKE: dict[str, Callable[[np.ndarray, Machine], Machine]] = {"spr": spr_of, "prpu": prpu_of}


def figures(machine: Machine, around: int, levels: int) -> dict[str, float]:
    """Return the worst values over the work volume: mm, degrees, ratio of lengths, N/N."""
    tips, axes = sample_work_volume(machine.work, rings=1, around=around, levels=levels)
    p, i = tips + machine.tool_length * axes, -axes
    robot = machine.robot
    signs = robot.branch(p, i)
    mode = Mode(*(int(sign) or 1 for sign in signs[0]))
    _, surface, held = robot.singularity_margins(list(p.T), list(i.T), mode, NUMPY)
    legs = robot.leg_lengths(p, i)
    strut, bend = (1.0, 0.0) if machine.limb is None else limb_figures(machine.limb, p, i)
    return {
        "clearance": 1e3 * min(float(clearances(machine, p, i).min()), signed_gaps(machine, mode, tips, axes)),
        "singular surface": 1e3 * float(surface.min()),
        "turn held": 1e3 * float(held.min()),
        "ratio": float(legs.max() / legs.min()),
        "force": float(tip_force_amplification(robot, p, i, machine.tool_length).max()),
        "components": float(len(np.unique(signs, axis=0))),
        "strut ratio": strut,
        "strut's joint": bend,
    }


def signed_gaps(machine: Machine, mode: Mode, tips: np.ndarray, axes: np.ndarray) -> float:
    """Return the least gap as the planner sees it, metres: negative where legs change sides, as if they had crossed."""
    margins = Margins.of(machine, mode)
    limits = enumerate(margins.own_limits)
    gaps = {k: limit.comfort for k, limit in limits if isinstance(limit, LegPairClearance | LegSpindleClearance)}
    return float((margins.own(tips, axes)[:, list(gaps)] * list(gaps.values())).min())


def limb_figures(limb: PassiveLimb, p: np.ndarray, i: np.ndarray) -> tuple[float, float]:
    """Return longest by shortest strut, and its largest angle to the tool axis, degrees."""
    foot, end = limb.ends(p, i)
    length = np.linalg.norm(end - foot, axis=1)
    return float(length.max() / length.min()), float(np.degrees(angle_between(foot - end, -i)).max())


def price(found: dict[str, float]) -> float:
    """Return what a design lacks, 0 where it lacks nothing."""
    short = {"clearance": (5.0, 20.0), "singular surface": (170.0, 0.4), "turn held": (200.0, 0.3)}
    lacks = sum(weight * max(0.0, wanted - found[name]) for name, (wanted, weight) in short.items())
    lacks += 100.0 * max(0.0, found["ratio"] - 1.85) + 10.0 * max(0.0, min(found["force"], 1e3) - 5.8)
    lacks += 100.0 * max(0.0, found["strut ratio"] - 1.8) + 2.0 * max(0.0, found["strut's joint"] - 70.0)
    return lacks + 500.0 * (found["components"] - 1.0)


def needs(machine: Machine) -> None:
    """Print the geometry of a machine, and what its work volume needs of strokes and joints: mm, degrees."""
    tips, axes = sample_work_volume(machine.work, rings=2, around=24, levels=4)
    p, i = tips + machine.tool_length * axes, -axes
    vectors, robot, limb = machine.robot.leg_vectors(p, i), machine.robot, machine.limb
    lengths = np.linalg.norm(vectors, axis=-1)
    towards = (vectors / lengths[..., None]).mean(axis=0)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    cones, joints = angle_between(vectors, towards).max(axis=0), angle_between(-vectors, axes[:, None, :])
    print("base", (1e3 * robot.base_joints[:, :2]).round().tolist(), "work", (1e3 * machine.work.centre).round())
    if isinstance(robot, ConstrainedPlatform):
        print("platform", (1e3 * robot.joints).round().tolist())
    print("legs", 1e3 * lengths.min(), 1e3 * lengths.max(), "platform joints", np.degrees([joints.min(), joints.max()]))
    print("base axes", towards.round(3).tolist(), "cones", np.degrees(cones).round(1))
    if limb is not None:
        foot, end = limb.ends(p, i)
        place, size = (foot - limb.origin) @ limb.rail, np.linalg.norm(end - foot, axis=1)
        angle = np.degrees(angle_between(foot - end, axes))
        print("rail", limb.rail, "through", 1e3 * limb.origin, "joint", 1e3 * limb.joint)
        print("carriage", 1e3 * place.min(), 1e3 * place.max(), "strut", 1e3 * size.min(), 1e3 * size.max())
        print("strut's joint", angle.min(), angle.max())


def main() -> None:
    """Search, and print the shipped design's figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machine", choices=MAKE, default="spr")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=2)
    options = parser.parse_args()
    rng, like, best = np.random.default_rng(options.seed), Machine.load(options.machine), np.inf
    low, high, steps = np.array(NUMBERS[options.machine]).T
    end = time.monotonic() + options.seconds
    while time.monotonic() < end and best > 0.0:
        design, least, step, idle = low, np.inf, 1.0, 0
        while idle < 120 and time.monotonic() < end:
            moved = design + step * steps * (rng.random(len(low)) < 0.25) * rng.normal(size=len(low))
            trial = np.clip(moved, low, high) if np.isfinite(least) else rng.uniform(low, high)
            try:
                machine = MAKE[options.machine](trial, like)
                found = figures(machine, 8, 2)
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
                    needs(machine)
    shipped = Machine.load(options.machine)
    print("shipped:", *(f"{name} {x:.3g}" for name, x in figures(shipped, 16, 3).items()), sep="; ")
    needs(shipped)


if __name__ == "__main__":
    main()
