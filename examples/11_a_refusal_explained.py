"""A refusal with its explanation: a plate that no placement reaches, and what is in the way where.

    python examples/11_a_refusal_explained.py --out docs/refusal.png

plans a raster over a plate of 620 mm × 440 mm, slightly bent, on the machine `desk`. It does not fit. The table that
is printed is that of `pentapod plan --explain`; the picture shows the path from above, each waypoint in the colour of
the limit that is exceeded most there, at the best placement found.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from pentapod import Component, Machine, Refusal, Toolpath, plan
from pentapod.cli.limits_text import shortfalls_text
from pentapod.toolpath import Segment, SegmentKind

LENGTH, WIDTH, RADIUS, TILT = 0.62, 0.44, 1.2, np.radians(15.0)
COLOURS = ("#d2413a", "#2a78d6", "#e08a00", "#1baa7a", "#c2417c", "#7a5cd6")


def plate() -> Toolpath:
    """Return a zigzag over a plate that is bent along its length."""
    passes = []
    for k, y in enumerate(np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, 14)):
        x = np.linspace(-0.5 * LENGTH, 0.5 * LENGTH, 24)[:: 1 if k % 2 == 0 else -1]
        passes.append(np.column_stack([x, np.full(len(x), y)]))
    xy = np.concatenate(passes)
    height = np.sqrt(RADIUS**2 - xy[:, 0] ** 2)
    tips = np.column_stack([xy, height - RADIUS])
    axes = np.column_stack([xy[:, 0], np.zeros(len(xy)), height]) / RADIUS
    return Toolpath((Segment(SegmentKind.CUT, tips, axes, 0.02),), 0.003)


def main() -> None:
    """Plan, tell the refusal, and draw it on the path."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("refusal.png"))
    out = parser.parse_args().out
    toolpath = plate()
    answer = plan(toolpath, Machine.load("desk"), tilt=TILT, component=Component(1, 1))
    if not isinstance(answer, Refusal):
        raise SystemExit("the plate fits: this example needs a larger one")
    print(f"refused: {answer.cause}\n\n{shortfalls_text(answer)}")
    draw(toolpath, answer, out)


def draw(toolpath: Toolpath, refusal: Refusal, out: Path) -> None:
    """Draw the path from above, with the waypoints that each limit is to blame for."""
    figure, axes = plt.subplots(figsize=(9.0, 6.2), layout="constrained")
    x, y = 1e3 * toolpath.tips[:, 0], 1e3 * toolpath.tips[:, 1]
    axes.plot(x, y, color="#8a8f98", linewidth=0.8, label="within all limits")
    free = np.ones(len(x), dtype=bool)
    for colour, blame in zip(COLOURS, refusal.diagnosis, strict=False):  # the worst first
        short = np.concatenate([np.arange(a, b + 1) for a, b in blame.waypoints])
        short = short[free[short]]
        free[short] = False
        if len(short) > 0:
            label = f"{blame.constraint}, by up to {blame.shortfall:.0f} {blame.unit}"
            axes.scatter(x[short], y[short], s=16, color=colour, label=label, zorder=3)
    axes.set(xlabel="x, mm", ylabel="y, mm", aspect="equal")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.09), ncols=2, frameon=False)
    figure.savefig(out, dpi=110)
    print(f"\nwrote {out}")


if __name__ == "__main__":
    main()
