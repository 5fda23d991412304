"""Where the legs of a linear pentapod can cross its tool line, and how near they come to spindle and holder.

    python examples/13_legs_and_tool.py --out docs/legs_and_tool.png

A leg begins on the tool line, at its platform joint. So it crosses the line nowhere else, unless it lies along it: that
is where the line runs through the leg's base joint. Left: an upright tool moves over the plane below the base; colours
say how near the nearest leg comes to the spindle, and each base joint has an island in which its leg runs through it.
The islands are points widened by the bodies' thickness: the machine can always go around them. Right: the plane of a
leg and the tool line, in which all of it is decided; legs at several angles beside the spindle and two holders.
"""

from __future__ import annotations

import argparse

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Rectangle

from pentapod.geometry.solids import Solid
from pentapod.machine import Machine, clearances
from pentapod.machine.clearance.tool_clearance import NUMPY, leg_spindle_gap, leg_tool_gap

HEIGHT = 0.467
SLIM = Solid("holder", 0.02, 0.06, 0.012, 0.016)
WIDE = Solid("holder", 0.02, 0.08, 0.045, 0.045)
ANGLES = np.radians([15.0, 30.0, 60.0, 90.0, 112.0])


def gaps_over_plane(machine: Machine, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return x, y (count,) and the smallest gap (count, count) of any leg and the spindle, tool upright, metres."""
    x, y = (np.linspace(-0.75, 0.75, count) for _ in range(2))
    tips = np.stack([*np.meshgrid(x, y, indexing="xy"), np.full((count, count), HEIGHT)], axis=-1)
    down = np.array([0.0, 0.0, 1.0])
    gaps = clearances(machine, tips - machine.tool_length * down, np.broadcast_to(down, tips.shape))
    return x, y, gaps[..., 10:].min(axis=-1)


def draw(machine: Machine, out: str, count: int) -> None:
    """Write the picture."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 6), layout="constrained")
    x, y, gaps = gaps_over_plane(machine, count)
    shown = left.pcolormesh(1e3 * x, 1e3 * y, 1e3 * gaps, cmap="RdYlGn", vmin=-20.0, vmax=60.0, shading="auto")
    left.contour(1e3 * x, 1e3 * y, gaps, [0.0], colors="k", linewidths=1.2)
    for k, (px, py) in enumerate(1e3 * machine.robot.base):
        left.plot(px, py, "k+")
        left.annotate(f"{k + 1}", (px, py), textcoords="offset points", xytext=(6, 6))
    circle = plt.Circle(1e3 * machine.work.centre[:2], 500.0 * machine.work.diameter, fill=False, linestyle="--")
    left.add_patch(circle)
    left.set(aspect="equal", xlabel="x of the tip (mm)", ylabel="y (mm)")
    left.set_title("gap of the nearest leg from the spindle")
    figure.colorbar(shown, ax=left, label="mm; black: 0; +: base joints; dashed: work volume", shrink=0.8)

    leg = int(np.argmax(machine.robot.offsets))
    joint = 1e3 * (machine.tool_length - machine.robot.offsets[leg])
    radius, end = 1e3 * machine.bodies.shaft_radius, 1e3 * machine.bodies.shaft_end
    right.add_patch(Rectangle((-radius, end), 2.0 * radius, 300.0, color="0.8", label="spindle"))
    for solid, colour, name in ((SLIM, "tab:blue", "slim holder"), (WIDE, "tab:orange", "wide holder")):
        corners = 1e3 * np.array(
            [
                (-solid.low_radius, solid.low),
                (solid.low_radius, solid.low),
                (solid.high_radius, solid.high),
                (-solid.high_radius, solid.high),
                (-solid.low_radius, solid.low),
            ]
        )
        right.plot(*corners.T, color=colour, label=name)
    for angle in ANGLES:
        cosine, length = np.cos(angle), 0.7
        spindle = 1e3 * float(leg_spindle_gap(machine, leg, cosine, NUMPY))
        wide = 1e3 * float(leg_tool_gap(machine, [WIDE], leg, cosine, length, NUMPY))
        ends = np.array([[0.0, joint], [180.0 * np.sin(angle), joint + 180.0 * np.cos(angle)]])
        label = f"{np.degrees(angle):.0f}°: spindle {spindle:.0f}, wide holder {wide:.0f}"
        right.plot(*ends.T, linewidth=1.0 * 2e3 * machine.bodies.leg_radius, alpha=0.5, label=label)
    right.plot(0.0, 0.0, "k.")
    right.set(xlim=(-70, 380), ylim=(-10, 290), aspect="equal", xlabel="distance from the tool line (mm)")
    right.set(ylabel="height over the tip (mm)", title=f"the plane of leg {leg + 1} and the tool line")
    legend = right.legend(loc="upper right", fontsize=8, title="leg's angle to the axis; gaps (mm)")
    for line in legend.get_lines():
        line.set_linewidth(4.0)
    figure.savefig(out, dpi=90)
    plt.close(figure)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=241)
    parser.add_argument("--out", default="docs/legs_and_tool.png")
    arguments = parser.parse_args()
    machine = Machine.load("desk")
    draw(machine, arguments.out, arguments.count)
    _, _, gaps = gaps_over_plane(machine, 121)
    print(f"{100.0 * (gaps <= 0.0).mean():.1f} % of the plane is lost to legs that run through the spindle")


if __name__ == "__main__":
    main()
