"""A general linear pentapod and the platform that a sixth leg makes of it: all poses of given leg lengths.

The offsets of this machine along its line are not proportional to the base joints' x: forward kinematics is a
quartic. Still no leg lengths have more than four real poses, named by a mode: which root, and which of two mirror
images.

    python examples/06_general_pentapod.py

prints, in order: the four poses of one set of leg lengths with their modes, order and image, and the singularity
polynomial, whose sign is the order; a motion that dips through the horizontal, where the image changes its name and
the order does not, followed from row to row; what stands in the way of leg lengths that no pose has; and the six-leg
platform's poses, two for each of the line's where the sixth leg reaches, none where it does not.
"""

from __future__ import annotations

import numpy as np

from pentapod.kinematics import (
    MODES,
    GeneralPentapod,
    SixLegPlatform,
    assembly_obstacles,
    follow,
    singularity_polynomial,
)

np.set_printoptions(precision=4, suppress=True)
BASE = [(-0.40, 0.20), (-0.20, -0.40), (0.05, 0.10), (0.20, -0.40), (0.40, 0.40)]
OFFSETS = [-0.30, 0.20, 0.10, -0.15, 0.40]


def main() -> None:
    """Print the poses."""
    pentapod = GeneralPentapod(BASE, OFFSETS)
    position, direction = np.array([0.10, 0.05, 0.60]), np.array([0.36, 0.48, 0.80])
    legs = pentapod.leg_lengths(position, direction)
    print(f"legs (m): {legs}")
    positions, directions = pentapod.assembly_modes(legs)
    for mode, p, i in zip(MODES, positions, directions, strict=True):
        value = float(singularity_polynomial(pentapod, p, i))
        print(f"  mode {mode}: p = {p}, i = {i}, polynomial (2) = {value:+.2e} m^7")

    elevation = np.linspace(0.5, -0.2, 8)
    swing = np.stack([0.6 * np.cos(elevation), 0.8 * np.cos(elevation), np.sin(elevation)], axis=-1)
    path = follow(pentapod, pentapod.leg_lengths(position, swing), position, swing[0])
    print("a swing through the horizontal, w and the mode:")
    for i, mode in zip(path.direction, pentapod.branch(path.position, path.direction), strict=True):
        print(f"  w = {i[2]:+.3f}  order {mode[0]:+d}  image {mode[1]:+d}")

    for change in (0.05, 0.2, 1.0):
        longer = legs + change * np.eye(5)[1]
        print(f"leg 2 longer by {change:.2f} m: {assembly_obstacles(pentapod, longer).explain()}")

    platform = SixLegPlatform(pentapod, sixth_base=[-0.30, 0.45, 0.0], sixth_joint=[-0.10, 0.25, 0.30])
    first = np.cross([0.0, 1.0, 0.0], direction) / np.hypot(direction[0], direction[2])
    rotation = np.stack([first, np.cross(direction, first), direction], axis=-1)
    six = platform.leg_lengths(position, rotation)
    print(f"six legs (m): {six}")
    positions, rotations = platform.assembly_modes(six)
    for label, p, r in zip(platform.labels, positions, rotations, strict=True):
        state = "no pose" if np.isnan(p[0]) else f"p = {p}, twist = {float(platform.twist(p, r)):+.4f} m^2"
        print(f"  label {label}: {state}")


if __name__ == "__main__":
    main()
