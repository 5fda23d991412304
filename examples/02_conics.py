"""The paper's Fig. 3: where each base attachment must not be, given the other four.

A conic through four attachments and the point at infinity of the y direction has no y² term: it is the graph of a
quotient of two polynomials, with a vertical asymptote. On it the fifth attachment would make the machine singular in
every pose. The dashed circle touches it: so far is that attachment alone. The last panel moves all five at once.

    python examples/02_conics.py --out docs/conics.png
"""

from __future__ import annotations

import argparse

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from pentapod.kinematics import attachment_conic, conic_determinant, forbidden_conic
from pentapod.theory import architectural_distance

BASE = np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])
REACH = 4.0


def curve(axes, conic, **style) -> None:
    """Draw the zero line of a conic."""
    x, y = np.meshgrid(np.linspace(-REACH, REACH, 801), np.linspace(-REACH, REACH, 801))
    axes.contour(x, y, conic(np.stack([x, y], axis=-1)), levels=[0.0], **style)


def attachments(axes, base, chosen: int | None) -> None:
    """Draw the attachments with their names, the chosen one in red."""
    for leg, (x, y) in enumerate(base):
        axes.plot(x, y, "o", color="crimson" if leg == chosen else "black", zorder=4)
        axes.annotate(f"$a_{leg + 1}$", (x, y), xytext=(6, 5), textcoords="offset points")
    axes.set(xlim=(-REACH, REACH), ylim=(-REACH, REACH), aspect="equal", xlabel="x (m)", ylabel="y (m)")


def draw(out: str) -> None:
    """Write the picture."""
    distance = architectural_distance(BASE)
    figure, panels = plt.subplots(2, 3, figsize=(12, 8), layout="constrained")
    for leg, axes in enumerate(panels.flat[:5]):
        curve(axes, forbidden_conic(BASE, leg), colors="tab:blue", linewidths=1.6)
        axes.add_patch(plt.Circle(BASE[leg], distance.alone[leg], fill=False, linestyle="--", color="crimson"))
        attachments(axes, BASE, leg)
        axes.set_title(f"$a_{leg + 1}$ alone: {distance.alone[leg]:.3f} m to its conic")
    axes = panels.flat[5]
    curve(axes, attachment_conic(distance.nearest), colors="tab:blue", linewidths=1.6)
    for start, end in zip(BASE, distance.nearest, strict=True):
        axes.plot(*np.stack([start, end]).T, "--", color="crimson")
        axes.plot(*end, "o", mfc="white", color="crimson", zorder=3)
    attachments(axes, BASE, None)
    axes.set_title(f"all five: {distance.together:.3f} m (root sum of squares)")
    figure.suptitle(f"F = {conic_determinant(BASE):.0f} m$^6$, and 0 where an attachment meets the conic of the others")
    figure.savefig(out, dpi=110)
    plt.close(figure)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="docs/conics.png")
    draw(parser.parse_args().out)


if __name__ == "__main__":
    main()
