"""Twelve concave parts made here, and parts by others: watertight solids with pockets, ribs, pits and grooves.

All stand on z = 0 and are heights over the plane, with vertical walls, so that a ball that comes from above touches
all that it can reach at all. Lengths are millimetres until `mesh` makes a Mesh of them.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from pentapod import Mesh, load_mesh

Shape = tuple[np.ndarray, np.ndarray]


def terraces(xs, ys, height) -> Shape:
    """A solid below height(x, y), over a grid of lines. Heights may jump there: each cell takes those just inside."""
    xs, ys = (np.unique(np.round(np.asarray(line, dtype=float), 6)) for line in (xs, ys))
    n, m = len(xs) - 1, len(ys) - 1
    side = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    i, j = (k.ravel() for k in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    x, y = xs[i[:, None] + side[:, 0]], ys[j[:, None] + side[:, 1]]
    inward = 1e-7 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    z = np.round(height(x + inward[:, 0], y + inward[:, 1]), 6).reshape(n, m, 4)
    facets = []

    def quads(a, b, c, d):
        facets.extend(np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))

    top = np.stack([x, y, z.reshape(-1, 4)], axis=-1)
    quads(*top.transpose(1, 0, 2))
    flat = top * [1.0, 1.0, 0.0]
    quads(*flat[:, ::-1].transpose(1, 0, 2))
    # All heights at each vertical line of the grid: walls are joined there.
    ends = np.zeros((n + 2, m + 2, 4))
    ends[1:-1, 1:-1] = z
    column = {
        (a, b): np.unique([ends[a, b, 2], ends[a + 1, b, 3], ends[a + 1, b + 1, 0], ends[a, b + 1, 1]])
        for a in range(n + 1)
        for b in range(m + 1)
    }

    def wall(first, last, low, high):
        """A vertical wall between two columns, each from its low to its high end, seen with the first to the left."""
        lines = []
        for (a, b), least, most in ((first, low[0], high[0]), (last, low[1], high[1])):
            heights = column[a, b]
            lines.append([np.array([xs[a], ys[b], k]) for k in heights[(heights >= least) & (heights <= most)]])
        p = q = 0
        left, right = lines
        while p + 1 < len(left) or q + 1 < len(right):
            if q + 1 >= len(right) or (p + 1 < len(left) and left[p + 1][2] <= right[q + 1][2]):
                facets.append(np.array([left[p], right[q], left[p + 1]]))
                p += 1
            else:
                facets.append(np.array([left[p], right[q], right[q + 1]]))
                q += 1

    def between(first, last, here, there):
        """Walls between a cell with the heights `here` above two columns and its neighbour with `there`."""
        here, there = np.array(here), np.array(there)
        if (here >= there).all() and (here > there).any():
            wall(first, last, there, here)
        elif (there >= here).all() and (there > here).any():
            wall(last, first, here[::-1], there[::-1])
        else:
            assert (here == there).all(), "walls that cross are not made"

    for a in range(n + 1):
        for b in range(m):
            # Seen from the side +x the column at the lower y is to the left.
            between((a, b), (a, b + 1), ends[a, b + 1, [1, 2]], ends[a + 1, b + 1, [0, 3]])
    for a in range(n):
        for b in range(m + 1):
            between((a + 1, b), (a, b), ends[a + 1, b, [2, 3]], ends[a + 1, b + 1, [1, 0]])
    return welded(np.array(facets))


def turned(profile, sections=96) -> Shape:
    """A solid of revolution about z below a profile [(radius, height), ...] that begins on the axis."""
    profile = np.array([*profile, (profile[-1][0], 0.0), (0.0, 0.0)], dtype=float)
    angle = 2.0 * np.pi * np.arange(sections + 1) / sections
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ring[-1] = ring[0]
    points = np.stack([np.concatenate([profile[:, :1] * ring[k], profile[:, 1:]], axis=1) for k in range(sections + 1)])
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    facets = np.concatenate([np.stack([a, b, c], 2).reshape(-1, 3, 3), np.stack([a, c, d], 2).reshape(-1, 3, 3)])
    return welded(facets)


def welded(facets) -> Shape:
    """Corners (F, 3, 3) as vertices and faces, those without area left out."""
    vertices, index = np.unique(np.round(facets.reshape(-1, 3), 6) + 0.0, axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    distinct = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return vertices, faces[distinct]


def lines(*ranges) -> np.ndarray:
    """Coordinates from pieces (first, last, count of steps)."""
    return np.concatenate([np.linspace(first, last, count + 1) for first, last, count in ranges])


def within(value, low, high):
    return (value > low) & (value < high)


def pocket_boss() -> Shape:
    """A pocket 10 mm deep with a square boss in it."""

    def height(x, y):
        pocket, boss = within(x, 7, 43) & within(y, 6, 34), within(x, 20, 30) & within(y, 15, 25)
        return np.where(boss, 16.0, np.where(pocket, 10.0, 20.0))

    return terraces([0, 7, 20, 30, 43, 50], [0, 6, 15, 25, 34, 40], height)


def ribs() -> Shape:
    """Three ribs 8 mm high; a ball of 6 mm enters one of the gaps, of 10 mm, but not the other, of 5 mm."""

    def height(x, _y):
        return np.where(within(x, 8, 11) | within(x, 21, 24) | within(x, 29, 32), 18.0, 10.0)

    return terraces([0, 8, 11, 21, 24, 29, 32, 42], [0, 15, 30], height)


def stairs() -> Shape:
    """Five steps, 8 mm wide and 4 mm high."""
    return terraces(np.arange(0, 41, 8), [0, 15, 30], lambda x, _y: 6.0 + 4.0 * np.floor(x / 8.0))


def valley() -> Shape:
    """A V groove of 90°, sharp at its bottom, that rises along its length."""
    return terraces(
        [0, 6, 20, 34, 40], [0, 10, 20, 30], lambda x, y: 6.0 + 0.1 * y + np.minimum(np.abs(x - 20.0), 14.0)
    )


def fillet(radius) -> Callable[[], Shape]:
    """A wall 10 mm high that meets the floor in a fillet."""

    def height(x, _y):
        away = np.clip(20.0 + radius - np.round(x, 6), 0.0, radius)  # its tangent at the wall is upright
        wall = np.where(x < 20.0, 18.0, 0.0)
        return np.maximum(8.0 + radius - np.sqrt(np.maximum(radius**2 - away**2, 0.0)), wall)

    angle = np.linspace(0.0, 0.5 * np.pi, 25)
    return lambda: terraces([0, 20, *(20.0 + radius * (1.0 - np.cos(angle))), 40], [0, 15, 30], height)


def inward_cone() -> Shape:
    """A conical pit of 90°, 12 mm deep, with a sharp tip."""
    return turned([(0, 6), (12, 18), (20, 18)])


def bowl() -> Shape:
    """A hollow of a sphere of 9 mm, 8 mm deep, with a sharp rim."""
    angle = np.linspace(0.0, np.arccos(1.0 / 9.0), 25)
    return turned([*zip(9.0 * np.sin(angle), 15.0 - 9.0 * np.cos(angle), strict=True), (18, 14)], 128)


def egg_crate() -> Shape:
    """Waves both ways, in the lows of which the smallest radius of curvature is 2.5 mm."""
    k = 2.0 * np.pi / 14.0
    amplitude = 1.0 / (2.5 * k**2)
    return terraces(
        lines((0, 42, 70)), lines((0, 28, 46)), lambda x, y: 10.0 + amplitude * np.cos(k * x) * np.cos(k * y)
    )


def ring_groove() -> Shape:
    """A ring-shaped groove, half a circle of 4 mm in section, around a post."""
    angle = np.linspace(np.pi, 2.0 * np.pi, 33)
    groove = zip(11.0 + 4.0 * np.cos(angle), 14.0 + 4.0 * np.sin(angle), strict=True)
    return turned([(0, 14), *groove, (22, 14)])


def crossing_slots() -> Shape:
    """Two slots of 8 mm that cross, one deeper than the other."""

    def height(x, y):
        return np.where(within(x, 16, 24), 8.0, np.where(within(y, 11, 19), 12.0, 18.0))

    return terraces([0, 16, 24, 40], [0, 11, 19, 30], height)


def drafted_pocket() -> Shape:
    """A round pocket with walls of 75° and a round post with the same draft in its middle."""
    draft = 10.0 / np.tan(np.radians(75.0))
    return turned([(0, 18), (4, 18), (4 + draft, 8), (18, 8), (18 + draft, 18), (26, 18)])


GENERATED: dict[str, Callable[[], Shape]] = {
    "pocket_boss": pocket_boss,
    "ribs": ribs,
    "stairs": stairs,
    "valley": valley,
    "fillet_below_the_ball": fillet(1.5),
    "fillet_above_the_ball": fillet(6.0),
    "inward_cone": inward_cone,
    "bowl": bowl,
    "egg_crate": egg_crate,
    "ring_groove": ring_groove,
    "crossing_slots": crossing_slots,
    "drafted_pocket": drafted_pocket,
}

BY_OTHERS = {  # unit, and width in millimetres to which the part is scaled
    "octagonal_pocket.stl": 90.0,
    "fandisk.obj": 50.0,
    "teapot.stl": 50.0,
    "busted.STL": 50.0,
    "wavy_mesh_with_hole.ply": 60.0,
    "1002_tray_bottom.STL": 70.0,
}


def mesh(name: str, folder: Path | None = None) -> Mesh:
    """The part of a name, metres; one by others from the folder, scaled to its width."""
    if name in GENERATED:
        vertices, faces = GENERATED[name]()
        return Mesh.of(1e-3 * vertices, faces)
    assert folder is not None
    wide = float(max(load_mesh(folder / name, "mm").diagnosis.extents[:2]))
    return load_mesh(folder / name, "mm", scale=1e-3 * BY_OTHERS[name] / wide)
