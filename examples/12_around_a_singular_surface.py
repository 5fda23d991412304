"""A path led around the singular surface: at the naive placement it passes within 5 mm of it.

    python examples/12_around_a_singular_surface.py --out docs/led_around.png

A dome of 60 mm is put naively, its axis upright and high under the base, where the plane S = 0 of the position
(two modes meet there) cuts the work. With strict normals the path comes within 5 mm of it. The planner may shift the
part by 60 mm along each axis, turn it by 10°, and lean the tool by 10°: it leads the path away. The distance is told by
the kinematics, not by the planner's margins.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from pentapod import Component, Machine, PlacedPath, RigidTransform, Toolpath, plan
from pentapod.kinematics import position_distance, singularity_values
from pentapod.planning import PlacementConstraints
from pentapod.toolpath import Segment, SegmentKind

COMPONENT, TILT, NEAR = Component(1, 1), np.radians(10.0), 5e-3
SHIFT, TURN = 0.06, np.radians(10.0)


def dome() -> Toolpath:
    """Return a zigzag over a spherical cap of 60 mm with slopes to 20°."""
    half = 0.03
    radius = half / np.sin(np.radians(20.0))
    passes = []
    for k, y in enumerate(np.linspace(-0.9 * half, 0.9 * half, 11)):
        x = np.linspace(-1.0, 1.0, 20)[:: 1 if k % 2 == 0 else -1] * np.sqrt(half**2 - y**2)
        passes.append(np.column_stack([x, np.full(len(x), y)]))
    xy = np.concatenate(passes)
    z = np.sqrt(radius**2 - (xy**2).sum(axis=1))
    tips, axes = np.column_stack([xy, z - radius]), np.column_stack([xy, z]) / radius
    return Toolpath((Segment(SegmentKind.CUT, tips, axes, 0.02),), 0.003)


def distances(machine: Machine, tips: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return how far (N,), metres, each pose can shift before S = 0; negative on the other side."""
    position, direction = tips + machine.tool_length * axes, -axes
    _, s = singularity_values(machine.robot, position, direction)
    return np.sign(s) * position_distance(machine.robot, position, direction)


def naive_placement(machine: Machine, toolpath: Toolpath) -> RigidTransform:
    """Return the placement under the base's middle, upright, raised until the path is 3 mm from the surface."""
    upright = np.diag([1.0, -1.0, -1.0])
    low, high = 0.1, float(machine.work.centre[2])
    placement = RigidTransform(upright, machine.work.centre)
    for _ in range(50):
        middle = 0.5 * (low + high)
        placement = RigidTransform(upright, np.array([*machine.work.centre[:2], middle]))
        least = distances(machine, placement.apply(toolpath.tips), placement.rotate(toolpath.axes)).min()
        low, high = (middle, high) if least < 3e-3 else (low, middle)
    return placement


def main() -> None:
    """Measure the naive placement, plan near it, and draw both."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("led_around.png"))
    out = parser.parse_args().out
    machine, toolpath = Machine.load("desk"), dome()
    naive = naive_placement(machine, toolpath)
    before = distances(machine, naive.apply(toolpath.tips), naive.rotate(toolpath.axes))
    print(f"naive placement, strict normals: {1e3 * before.min():.1f} mm from the singular surface at the nearest")
    if not 0.0 < before.min() < NEAR:
        raise SystemExit("the naive placement is not near to the surface")
    near = PlacementConstraints.free(
        low=naive.translation - SHIFT, high=naive.translation + SHIFT, reference=naive, largest_turn=TURN
    )
    placed = plan(toolpath, machine, tilt=TILT, constraints=near, component=COMPONENT)
    if not isinstance(placed, PlacedPath):
        raise SystemExit(f"refused: {placed}")
    after = distances(machine, placed.tips, placed.axes)
    shift = 1e3 * (placed.placement.transform.translation - naive.translation)
    print(f"planned within {1e3 * SHIFT:.0f} mm and {np.degrees(TURN):.0f}°: {1e3 * after.min():.1f} mm at the nearest")
    print(f"the part moved by ({shift[0]:.1f}, {shift[1]:.1f}, {shift[2]:.1f}) mm; smallest margin "
          f"{placed.smallest_margin:.3f}, {placed.active_limit}")  # fmt: skip
    draw(before, after, out)


def draw(before: np.ndarray, after: np.ndarray, out: Path) -> None:
    """Draw the distance to the singular surface along both paths."""
    figure, axes = plt.subplots(figsize=(9.0, 3.8), layout="constrained")
    axes.axhspan(0.0, 1e3 * NEAR, color="#d2413a", alpha=0.15, label="within 5 mm of S = 0")
    axes.plot(1e3 * before, color="#e08a00", label="naive placement, strict normals")
    axes.plot(1e3 * after, color="#2a78d6", label="as planned")
    axes.set(xlabel="waypoint", ylabel="distance to S = 0, mm", xlim=(0, len(before) - 1), ylim=(0.0, None))
    axes.legend(loc="upper center", ncols=3, frameon=False, bbox_to_anchor=(0.5, 1.14))
    figure.savefig(out, dpi=110)
    print(f"wrote {out}")


if __name__ == "__main__":
    main()
