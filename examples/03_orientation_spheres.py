"""The paper's Fig. 4: the sphere of orientations at eight positions around the y axis, for delta < 1, = 1 and > 1.

Each disc is the sphere of directions (u, v, w) seen along v, at a position in the plane of px and pz; only the
direction of that position matters. Colours are the four components; they change where w = 0 or S = 0.

    python examples/03_orientation_spheres.py --out docs/orientation_spheres.png
"""

from __future__ import annotations

import argparse

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from pentapod.kinematics import COMPONENTS, LinearPentapod
from pentapod.theory import cell_decomposition

BASE = np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])
COLOURS = ("#4477aa", "#66ccee", "#cc6677", "#ddcc77")
RADIUS = 0.34


def components(pentapod: LinearPentapod, position, pixels: int = 241) -> np.ndarray:
    """Return the number of the component (pixels, pixels) over the disc of directions, NaN outside."""
    u, w = np.meshgrid(np.linspace(-1.0, 1.0, pixels), np.linspace(-1.0, 1.0, pixels))
    inside = u * u + w * w <= 1.0
    v = np.sqrt(np.maximum(1.0 - u * u - w * w, 0.0))
    signs = pentapod.branch(position, np.stack([u, v, w], axis=-1))
    number = np.full(u.shape, np.nan)
    for k, component in enumerate(COMPONENTS):
        number[(signs == component).all(axis=-1) & inside] = k
    return number


def draw(out: str) -> None:
    """Write the picture."""
    figure, panels = plt.subplots(1, 3, figsize=(15, 5.8), layout="constrained")
    for axes, delta in zip(panels, (0.5, 1.0, 2.0), strict=True):
        pentapod = LinearPentapod.quadratic(BASE, delta)
        for turn in np.radians([0, 26, 90, 154, 180, 206, 270, 334]):
            x, z = 1.6 * np.cos(turn), 1.6 * np.sin(turn)
            axes.imshow(
                components(pentapod, [x, 0.0, z]),
                extent=(x - RADIUS, x + RADIUS, z - RADIUS, z + RADIUS),
                origin="lower",
                cmap=ListedColormap(COLOURS),
                vmin=-0.5,
                vmax=3.5,
                interpolation="nearest",
            )
            axes.add_patch(plt.Circle((x, z), RADIUS, fill=False, color="black", linewidth=0.8))
        axes.annotate("", (0.55, 0.0), (0.0, 0.0), arrowprops={"arrowstyle": "->"})
        axes.annotate("", (0.0, 0.55), (0.0, 0.0), arrowprops={"arrowstyle": "->"})
        axes.text(0.45, -0.12, "$p_x$, u")
        axes.text(0.04, 0.45, "$p_z$, w")
        counts = cell_decomposition(delta).counts(paper=True)
        axes.set_title(f"δ = {delta:g}; the paper's cells, 5D to 1D: {counts}")
        axes.set(xlim=(-2.0, 2.0), ylim=(-2.0, 2.0), aspect="equal")
        axes.axis("off")
    handles = [
        Patch(color=colour, label=f"w {'<>'[k.w > 0]} 0, S {'<>'[k.s > 0]} 0")
        for colour, k in zip(COLOURS, COMPONENTS, strict=True)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    figure.savefig(out, dpi=110)
    plt.close(figure)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="docs/orientation_spheres.png")
    draw(parser.parse_args().out)


if __name__ == "__main__":
    main()
