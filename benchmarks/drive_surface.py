"""Drive surface of a 6 mm ball over a part of 100 mm: seconds until it stands, and exact waypoints a second.

Run ``make bench-gouge``. The peers: SciPy's distance transform of trimesh's voxels, of the same step, which knows the
offset to within a voxel and has no surface yet; and trimesh's closest points, one for each waypoint, where an exact
waypoint needs several, and its chord a proof. Seconds are those of the processor, one thread.
"""

from __future__ import annotations

import argparse
import platform
import time

import numpy as np
import trimesh
from scipy import ndimage

from pentapod.base.arrays import Floats
from pentapod.toolpath import Mesh, RasterOptions
from pentapod.toolpath.strategies.raster import raster_paths
from pentapod.toolpath.surfaces.drive_surface import DriveSurface

RADIUS, CHORDAL, CLOSEST = 3e-3, 10e-6, 10e-6
UP = np.array([0.0, 0.0, 1.0])


def relief(width: float, cells: int) -> Mesh:
    """Return a closed block, square and 10 to 30 mm high, whose top has waves narrower than the ball and wider ones."""
    line = np.linspace(0.0, width, cells + 1)
    x, y = np.meshgrid(line, line, indexing="ij")
    z = 20e-3 + 8e-3 * np.sin(x / 8e-3) * np.cos(y / 7e-3) + 1e-3 * np.sin(x / 2e-3)
    z[[0, -1]] = z[:, [0, -1]] = 10e-3
    top, n = np.stack([x, y, z], -1).reshape(-1, 3), cells + 1
    i, j = np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij")
    a = (i * n + j).ravel()
    faces = np.concatenate([np.stack([a, a + n, a + n + 1], 1), np.stack([a, a + n + 1, a + 1], 1)])
    index = np.arange(n)
    rim = np.concatenate([index[:-1] * n, (n - 1) * n + index[:-1], index[:0:-1] * n + n - 1, index[:0:-1]])
    after, low = np.roll(rim, -1), len(top) + np.arange(len(rim))
    after_low = np.roll(low, -1)
    # Seen from above the rim runs clockwise about the middle of the bottom's fan, so walls face outwards.
    walls = [np.stack([rim, after, after_low], 1), np.stack([rim, after_low, low], 1)]
    middle = np.full(len(rim), len(top) + len(rim))
    bottom = np.stack([low, after_low, middle], 1)
    vertices = np.concatenate([top, top[rim] * [1.0, 1.0, 0.0], [[0.5 * width, 0.5 * width, 0.0]]])
    return Mesh.of(vertices, np.concatenate([faces, *walls, bottom]), repair=True)


def voxels(mesh: Mesh, step: float) -> float:
    """Return the seconds for voxels of a mesh and their distance transform as far as the ball reaches."""
    start = time.process_time()
    grid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).voxelized(step).matrix
    ndimage.distance_transform_edt(~np.pad(grid, int(RADIUS / step) + 2))
    return time.process_time() - start


def closest_points(mesh: Mesh, points: Floats) -> float:
    """Return the seconds a point for trimesh's closest points."""
    shape = trimesh.Trimesh(1e3 * mesh.vertices, mesh.faces, process=False)
    start = time.process_time()
    trimesh.proximity.closest_point(shape, 1e3 * points)
    return (time.process_time() - start) / len(points)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=100)
    parser.add_argument("--width-mm", type=float, default=100.0)
    parser.add_argument("--peer-points", type=int, default=2000)
    options = parser.parse_args()
    DriveSurface.of(relief(0.02, 4), RADIUS, UP)  # compiles, or loads what was compiled
    part = relief(1e-3 * options.width_mm, options.cells)
    start = time.process_time()
    surface = DriveSurface.of(part, RADIUS, UP)
    making = time.process_time() - start
    drawn = raster_paths(surface, RasterOptions(stepover=1.5e-3)).passes
    surface.centres.exact(drawn, CHORDAL, CLOSEST)
    start = time.process_time()
    exact = surface.centres.exact(drawn, CHORDAL, CLOSEST)
    each = (time.process_time() - start) / len(exact.points)
    peer = voxels(part, surface.options.step * RADIUS)
    closest = closest_points(part, exact.points[:: max(1, len(exact.points) // options.peer_points)])
    print(f"{options.width_mm:g} mm, {len(part.faces):,} facets, ball of {2e3 * RADIUS:g} mm, {platform.machine()}")
    print(f"drive surface: {making:.2f} s, {len(surface.mesh.faces):,} facets")
    print(f"  voxels and their distances, of the same step: {peer:.2f} s, ratio {peer / making:.1f}")
    print(f"exact waypoints, chords proven: {1.0 / each:,.0f} a second ({len(exact.points):,} points)")
    print(f"  trimesh's closest points: {1.0 / closest:,.0f} a second, ratio {closest / each:.0f}")


if __name__ == "__main__":
    main()
