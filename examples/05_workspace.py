"""What a machine's tip can reach with every tool direction of a cone, and the largest ball and box in it.

Leg limits and the cone are numbers here; joints and collisions are left to the machine's own check. Left: the surface
of the reachable tips. Right: how volume, ball and box shrink as the cone opens.

    python examples/05_workspace.py --out docs/workspace.png
"""

from __future__ import annotations

import argparse

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from pentapod.kinematics import Component, LinearPentapod
from pentapod.theory import ReachField, Workspace

BASE = np.array([(0.586, -0.120), (0.224, 0.554), (-0.326, 0.498), (-0.597, -0.039), (-0.055, -0.595)])
ROBOT = LinearPentapod.quadratic(BASE, 0.185)
TILTS = (0, 10, 20, 30, 40)


def field(tilt_deg: float, step: float) -> ReachField:
    """Return the field of the bench machine for a cone about the vertical."""
    limits = ([0.489] * 5, [0.929] * 5)
    return ReachField.of(
        Workspace(ROBOT, Component(1, 1), np.array([0.0, 0.0, 1.0]), np.radians(tilt_deg), *limits, 0.198), step
    )


def draw(out: str) -> None:
    """Write the picture."""
    shown = field(20.0, 0.02)
    vertices, triangles = shown.surface()
    centre, radius, _ = shown.largest_ball()
    low, high = shown.largest_box()
    figure = plt.figure(figsize=(14, 6.5), layout="constrained")
    axes = figure.add_subplot(1, 2, 1, projection="3d")
    axes.plot_trisurf(*(1e3 * vertices.T), triangles=triangles, color="tab:blue", alpha=0.22, linewidth=0.0)
    azimuth, polar = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 25), np.linspace(0.0, np.pi, 13))
    ball = np.stack([np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)])
    axes.plot_wireframe(*(1e3 * (centre[:, None, None] + radius * ball)), color="tab:orange", linewidth=0.6)
    corners = np.array(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    )
    for a in range(len(corners) - 1):
        axes.plot(*(1e3 * (low + corners[[a, a + 1]] * (high - low))).T, color="crimson")
    for a, b in ((8, 5), (1, 6), (2, 7), (3, 8)):
        axes.plot(*(1e3 * (low + corners[[a, b]] * (high - low))).T, color="crimson")
    axes.set(xlabel="x (mm)", ylabel="y (mm)", zlabel="z (mm)")
    axes.set_aspect("equal")
    axes.set_title("every direction within 20° of z: surface, largest ball and box")

    axes = figure.add_subplot(1, 2, 2)
    fields = [field(tilt, 0.025) for tilt in TILTS]
    volumes = [1e3 * each.volume() for each in fields]
    balls = [1e3 * 4.0 / 3.0 * np.pi * each.largest_ball()[1] ** 3 for each in fields]
    boxes = [1e3 * float(np.nan_to_num(np.subtract(*each.largest_box()[::-1])).prod()) for each in fields]
    for values, name, style in (
        (volumes, "reachable", "o-"),
        (boxes, "largest box", "s-"),
        (balls, "largest ball", "^-"),
    ):
        axes.semilogy(TILTS, np.maximum(values, 1e-2), style, label=name)
    axes.set(xlabel="half-angle of the cone (degrees)", ylabel="volume (litres)")
    axes.grid(alpha=0.4)
    axes.legend()
    figure.savefig(out, dpi=100)
    plt.close(figure)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="docs/workspace.png")
    draw(parser.parse_args().out)


if __name__ == "__main__":
    main()
