"""The paper's Fig. 5: the cells in the boundary of one component for delta = 1, and how they bound each other.

Each small picture shows the platform line (red, its end an arrow) over the base plane for a pose of the cell. A line
joins two cells when one lies in the boundary of the other and their dimensions differ by one. Grey: the cells that
the paper leaves out of its count.

    python examples/04_cells.py --component ++ --out docs/cells.png
"""

from __future__ import annotations

import argparse

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import ConnectionPatch

from pentapod.kinematics import COMPONENTS, Component, LinearPentapod
from pentapod.theory import cell_decomposition, poses_in_cell

BASE = np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])


def little_frame(axes, pentapod: LinearPentapod, cell: int) -> None:
    """Draw the base plane, the frame and the platform line for a clear pose of the cell."""
    positions, directions = poses_in_cell(pentapod, cell, 500, seed=2)
    size = np.abs(positions).max(axis=1)
    signs = pentapod_signs(cell)
    wanted = np.abs(positions[:, [0, 2]])[:, [s != 0 for s in signs]] if any(signs) else size[:, None]
    clear = np.argmin(np.abs(size - 1.5) + 2.0 * (wanted.min(axis=1) < 0.6) + 2.0 * (np.abs(directions[:, 1]) > 0.5))
    p, i = positions[clear], directions[clear]
    square = 1.8 * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (-1, -1, 0)])
    axes.plot(*square.T, color="0.75", linewidth=0.8)
    for axis, name in zip(np.eye(3), "xyz", strict=True):
        axes.plot(*np.stack([0 * axis, 1.4 * axis]).T, color="0.35", linewidth=0.9)
        axes.text(*(1.65 * axis), f"$p_{name}$", fontsize=7, color="0.35", ha="center")
    axes.plot(*np.stack([p - 1.1 * i, p + 1.1 * i]).T, color="crimson", linewidth=2.2)
    axes.quiver(*(p + 0.4 * i), *(0.9 * i), color="crimson", arrow_length_ratio=0.45, linewidth=2.2)
    axes.plot(*np.stack([p, [p[0], p[1], 0.0]]).T, ":", color="tab:blue", linewidth=1.0)
    axes.plot(*p[:, None], "o", color="tab:blue", markersize=4)
    axes.set(xlim=(-1.7, 1.7), ylim=(-1.7, 1.7), zlim=(-1.4, 1.4))
    axes.set_box_aspect((1, 1, 0.8), zoom=1.05)
    axes.view_init(24, -62)
    axes.set_axis_off()


def pentapod_signs(cell: int) -> tuple[int, int]:
    """Return the signs of px and pz that the cell asks for (1 where it leaves them free)."""
    _, _, z, x, _ = cell_decomposition(1.0).cells[cell].signs
    return (1 if x is None else x, 1 if z is None else z)


def draw(component: Component, out: str) -> None:
    """Write the picture."""
    pentapod, decomposition = LinearPentapod.quadratic(BASE, 1.0), cell_decomposition(1.0)
    top = COMPONENTS.index(component)
    shown = [top, *decomposition.boundary(top)]
    figure = plt.figure(figsize=(17, 13))
    centres = {}
    for row, dimension in enumerate((5, 4, 3, 2, 1)):
        cells = [k for k in shown if decomposition.cells[k].dimension == dimension]
        figure.text(0.012, 0.90 - 0.195 * row, f"{dimension}D", fontsize=16, weight="bold")
        for column, k in enumerate(cells):
            cell = decomposition.cells[k]
            x, y = 0.04 + 0.95 * (column + 0.5) / len(cells), 0.90 - 0.195 * row
            axes = figure.add_axes((x - 0.1, y - 0.085, 0.2, 0.17), projection="3d")
            axes.patch.set_alpha(0.0)
            little_frame(axes, pentapod, k)
            words = ", ".join(cell.equations) + "\n" + ", ".join(cell.inequalities)
            figure.text(
                x,
                y - 0.064,
                words.strip(),
                ha="center",
                va="top",
                fontsize=8,
                color="black" if cell.in_paper else "0.55",
            )
            centres[k] = (x, y)
    for a in shown:
        for b in shown:
            step = decomposition.cells[b].dimension - decomposition.cells[a].dimension
            if decomposition.incidence[a, b] and step == 1:
                (xa, ya), (xb, yb) = centres[a], centres[b]
                grey = not (decomposition.cells[a].in_paper and decomposition.cells[b].in_paper)
                figure.add_artist(
                    ConnectionPatch(
                        (xa, ya + 0.058),
                        (xb, yb - 0.088),
                        "figure fraction",
                        "figure fraction",
                        color="0.8" if grey else "0.4",
                        linewidth=0.8,
                        linestyle="--" if grey else "-",
                    )
                )
    figure.suptitle(
        f"The closure of component {component} (w {'<>'[component.w > 0]} 0, S {'<>'[component.s > 0]} 0), δ = 1"
    )
    figure.savefig(out, dpi=90)
    plt.close(figure)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--component", default="++", help="++, +-, -+ or --")
    parser.add_argument("--out", default="docs/cells.png")
    given = parser.parse_args()
    draw(Component.parse(given.component), given.out)


if __name__ == "__main__":
    main()
