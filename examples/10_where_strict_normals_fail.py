"""A placement found where strict normals have none: a dome steeper than the machine can follow with its axis.

    python examples/10_where_strict_normals_fail.py --out docs/tilt.png

plans a raster over a spherical cap, 170 mm wide with slopes to 50°, on the machine `desk`: first with the tool strictly
along the normals, which is refused with the limits in the way; then with a tool that may lean by 20°, which fits. The
picture shows the smallest margin along the path of the best placement of either.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from pentapod import Component, Machine, PlacedPath, Toolpath, plan
from pentapod.planning import PlacementConstraints
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.search import search
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.toolpath import Segment, SegmentKind

WIDTH, SLOPE, TILT, BALL = 0.17, np.radians(50.0), np.radians(20.0), 0.003


def dome(width: float, slope: float, waypoints: int = 320) -> Toolpath:
    """Return a zigzag over a spherical cap of this width, as steep as `slope` at its rim."""
    half, radius = 0.5 * width, 0.5 * width / np.sin(slope)
    passes = []
    for k, y in enumerate(np.linspace(-0.95 * half, 0.95 * half, 16)):
        reach = np.sqrt(half**2 - y**2)
        x = np.linspace(-reach, reach, waypoints // 16)
        passes.append(np.column_stack([x[:: 1 if k % 2 == 0 else -1], np.full(len(x), y)]))
    xy = np.concatenate(passes)
    z = np.sqrt(radius**2 - (xy**2).sum(axis=1))
    tips, axes = np.column_stack([xy, z - radius]), np.column_stack([xy, z]) / radius
    return Toolpath((Segment(SegmentKind.CUT, tips, axes, 0.02),), BALL)


def main() -> None:
    """Plan twice, tell both answers, and draw the margins."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("tilt.png"))
    out = parser.parse_args().out
    machine, toolpath, component = Machine.load("desk"), dome(WIDTH, SLOPE), Component(1, 1)

    strict = search(PlacementProblem.of(ToolpathSamples.of(toolpath, 0.0), machine, component=component)).best
    answer = plan(toolpath, machine, component=component, constraints=PlacementConstraints.fixture([strict.transform]))
    print(f"strict normals, at the best placement found:\n  {answer}")
    placed = plan(toolpath, machine, tilt=TILT, component=component)
    if not isinstance(placed, PlacedPath):
        raise SystemExit(f"leaning by up to {np.degrees(TILT):.0f}° is refused as well: {placed}")
    print(
        f"leaning by up to {np.degrees(TILT):.0f}°: smallest margin {placed.smallest_margin:.3f}, {placed.active_limit}"
    )

    margins = Margins.of(machine, component)
    normals = margins(strict.transform.apply(toolpath.tips), strict.transform.rotate(toolpath.axes)).min(axis=1)
    draw(normals, placed.margins.min(axis=1), out)


def draw(strict: np.ndarray, leaning: np.ndarray, out: Path) -> None:
    """Draw the smallest margin along the path, strict and leaning."""
    figure, axes = plt.subplots(figsize=(9.0, 3.8), layout="constrained")
    axes.axhspan(min(strict.min(), 0.0) - 0.05, 0.0, color="#d2413a", alpha=0.12, label="beyond a limit")
    axes.plot(strict, color="#e08a00", label="along the normals")
    axes.plot(leaning, color="#2a78d6", label=f"leaning by up to {np.degrees(TILT):.0f}°")
    axes.set(xlabel="waypoint", ylabel="smallest margin", xlim=(0, len(strict) - 1))
    axes.set_ylim(bottom=min(strict.min(), 0.0) - 0.05)
    axes.legend(loc="upper center", ncols=3, frameon=False)
    figure.savefig(out, dpi=110)
    print(f"wrote {out}")


if __name__ == "__main__":
    main()
