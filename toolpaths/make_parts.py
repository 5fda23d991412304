"""Write the meshes of the jobs in this folder: `python toolpaths/make_parts.py [FOLDER]`; same bytes every time.

Each part is a height z(x, y) in millimetres over a rectangle or a disc, cut into triangles fine enough that the
flat facets leave the true surface by a few micrometres at most (printed for each part).
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.toolpath import write_stl

Height = Callable[[Floats, Floats], Floats]


def square_grid(width: float, depth: float, cells: int) -> tuple[Floats, Floats, Ints]:
    """Return x, y (V,) in mm of a grid about the origin, and facets (F, 3), anticlockwise from above."""
    rows = max(1, round(cells * depth / width))
    x, y = np.meshgrid(np.linspace(-width / 2, width / 2, cells + 1), np.linspace(-depth / 2, depth / 2, rows + 1))
    corner = (np.arange(rows)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    a, b, c, d = corner, corner + 1, corner + cells + 2, corner + cells + 1
    return x.ravel(), y.ravel(), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def disc_grid(radius: float, rings: int) -> tuple[Floats, Floats, Ints]:
    """Return x, y (V,) in mm of rings about the origin with 6 k points on ring k, and facets (F, 3)."""
    ring = np.repeat(np.arange(rings + 1), [1, *(6 * np.arange(1, rings + 1))])
    first = np.concatenate([[0, 1], 1 + np.cumsum(6 * np.arange(1, rings + 1))])
    place = np.arange(len(ring)) - first[ring]
    angle = 2.0 * np.pi * place / np.maximum(6 * ring, 1)
    r = radius * ring / rings
    facets = [(0, 1 + k, 1 + (k + 1) % 6) for k in range(6)]
    for k in range(1, rings):  # ring k inside, ring k + 1 outside; each sixth has k and k + 1 steps
        for j in range(6 * (k + 1)):
            sixth, step = divmod(j, k + 1)
            outer = [first[k + 1] + (j + i) % (6 * k + 6) for i in range(2)]
            inner = [first[k] + (sixth * k + step + i) % (6 * k) for i in (-1, 0)]
            facets.append((inner[1], outer[0], outer[1]))
            if step:
                facets.append((inner[1], inner[0], outer[0]))
    return r * np.cos(angle), r * np.sin(angle), np.array(facets)


def dome(x: Floats, y: Floats) -> Floats:
    """Cap of a sphere: 75 mm from its axis the slope is 40°."""
    radius = 75.0 / np.sin(np.radians(40.0))
    return np.sqrt(radius**2 - x**2 - y**2) - radius * np.cos(np.radians(40.0))


def saddle(x: Floats, y: Floats) -> Floats:
    """Saddle over 150 mm with slopes to 35° in its corners."""
    return (x**2 - y**2) * (np.tan(np.radians(35.0)) / (2.0 * np.hypot(75.0, 75.0)))


def wavy(x: Floats, y: Floats) -> Floats:
    """Two crossing waves, slopes to about 20°."""
    return 5.0 * np.sin(2.0 * np.pi * x / 90.0) * np.cos(2.0 * np.pi * y / 130.0)


def relief(x: Floats, y: Floats) -> Floats:
    """Rings of 1.2 mm that fade towards the rim, on a gentle crown."""
    r2 = x**2 + y**2
    return 1.2 * np.cos(2.0 * np.pi * np.sqrt(r2 + 9.0) / 24.0) * np.exp(-r2 / 50.0**2) - r2 / 900.0


def grooves(x: Floats, y: Floats) -> Floats:
    """Two valleys that cross, with flanks of 25°: a ball touches both flanks along their bottoms."""
    return np.tan(np.radians(25.0)) * np.minimum(np.abs(x), np.abs(y))


def oversize(x: Floats, y: Floats) -> Floats:
    """Long waves over 600 mm: on purpose too large for the machine."""
    return 20.0 * np.cos(2.0 * np.pi * x / 400.0) * np.cos(2.0 * np.pi * y / 400.0)


def rail(x: Floats, y: Floats) -> Floats:
    """Back of a rail: rounded, rising and falling by 3 mm along its 800 mm, too long for one set-up."""
    return 3.0 * np.cos(2.0 * np.pi * x / 200.0) - y**2 / 160.0


HOLE_MM = (12.0, -8.0, 18.0)
"""Centre and radius of the hole in the wavy plate."""


def with_hole(x: Floats, y: Floats, facets: Ints) -> tuple[Floats, Floats, Ints]:
    """Return the grid with a round hole: facets inside it dropped, points near its rim pulled onto it."""
    cx, cy, radius = HOLE_MM
    distance = np.hypot(x - cx, y - cy)
    kept = facets[(distance[facets] >= radius).all(axis=1)]
    lost = np.setdiff1d(facets[(distance[facets] < radius).any(axis=1)], np.flatnonzero(distance < radius))
    scale = np.ones_like(x)
    scale[lost] = radius / distance[lost]
    return cx + (x - cx) * scale, cy + (y - cy) * scale, kept


PARTS: dict[str, tuple[Height, tuple[Floats, Floats, Ints]]] = {
    "dome": (dome, disc_grid(75.0, 74)),
    "saddle": (saddle, square_grid(150.0, 150.0, 100)),
    "wavy": (wavy, with_hole(*square_grid(150.0, 120.0, 150))),
    "relief": (relief, square_grid(100.0, 100.0, 140)),
    "rail": (rail, square_grid(800.0, 60.0, 320)),
    "grooves": (grooves, square_grid(80.0, 80.0, 40)),
    "oversize": (oversize, square_grid(600.0, 600.0, 100)),
}


def triangles(name: str) -> Floats:
    """Return the triangles (F, 3, 3) of a part, mm."""
    height, (x, y, facets) = PARTS[name]
    return np.stack([x, y, height(x, y)], axis=1)[facets]


def chord_error(name: str) -> float:
    """Return the largest height between the facets' centres and sides' middles and the true surface, mm."""
    height, corners = PARTS[name][0], triangles(name)
    points = np.concatenate([corners.mean(axis=1), *(0.5 * (corners[:, k] + corners[:, k - 1]) for k in range(3))])
    return float(np.abs(points[:, 2] - height(points[:, 0], points[:, 1])).max())


def main(folder: Path) -> None:
    """Write all parts into a folder."""
    for name in PARTS:
        data = write_stl(triangles(name), f"pentapod part: {name}, mm")
        (folder / f"{name}.stl").write_bytes(data)
        print(f"{name}.stl: {len(data) / 1e6:.2f} MB, facets within {1e3 * chord_error(name):.1f} um of the surface")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
