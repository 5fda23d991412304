"""Drop cutter with a 6 mm ball, in points a second, against OpenCAMLib's BatchDropCutter.

Run ``make bench-gouge``. The mesh is a wavy sheet of 200,000 irregular facets, each vertex of a grid moved by up to a
quarter of a step: on a regular grid the peer's tree is at its worst. Seconds are those of the processor, of one thread
each. The peer gets every n-th point, and its best size of bucket; its heights are compared with ours.
"""

from __future__ import annotations

import argparse
import platform
import time
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.mesh.offset.drop_cutter import drop_cutter
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath import Mesh

RADIUS, WIDTH = 3e-3, 0.1


def jittered_sheet(cells: int, width: float = WIDTH) -> Mesh:
    """Return a sheet of 2 · cells² facets, `width` metres wide, with waves 4 mm high and others of 0.5 mm."""
    step = width / cells
    x, y = np.meshgrid(step * np.arange(cells + 1), step * np.arange(cells + 1), indexing="ij")
    moved = np.random.default_rng(0).uniform(-0.25, 0.25, (2, cells + 1, cells + 1)) * step
    moved[:, [0, -1]] = moved[:, :, [0, -1]] = 0.0
    x, y = x + moved[0], y + moved[1]
    z = 4e-3 * np.sin(x / 9e-3) * np.cos(y / 7e-3) + 0.5e-3 * np.sin(x / 1.3e-3)
    i, j = np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij")
    a, n = (i * (cells + 1) + j).ravel(), cells + 1
    faces = np.concatenate([np.stack([a, a + n, a + n + 1], 1), np.stack([a, a + n + 1, a + 1], 1)])
    return Mesh.of(np.stack([x, y, z], -1).reshape(-1, 3), faces)


def peer(mesh: Mesh, places: Floats, bucket: int) -> tuple[Floats, float]:
    """Return OpenCAMLib's heights of the centre in metres, and its seconds for them."""
    import opencamlib  # noqa: PLC0415

    ocl: Any = opencamlib  # it has no types
    surface = ocl.STLSurf()
    for corners in 1e3 * mesh.vertices[mesh.faces]:
        surface.addTriangle(ocl.Triangle(*(ocl.Point(*corner) for corner in corners)))
    cutter, drop = ocl.BallCutter(2e3 * RADIUS, 50.0), ocl.BatchDropCutter()
    drop.setThreads(1)
    drop.setSTL(surface)
    drop.setCutter(cutter)
    drop.setBucketSize(bucket)
    for x, y in 1e3 * places:
        drop.appendPoint(ocl.CLPoint(float(x), float(y), -100.0))
    start = time.process_time()
    drop.run()
    seconds = time.process_time() - start
    return np.array([1e-3 * point.z for point in drop.getCLPoints()]) + RADIUS, seconds


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=316)
    parser.add_argument("--side", type=int, default=300, help="points along each side")
    parser.add_argument("--peer-points", type=int, default=400)
    options = parser.parse_args()
    mesh = jittered_sheet(options.cells)
    line = np.linspace(1e-3, WIDTH - 1e-3, options.side)
    places = np.stack(np.meshgrid(line, line, indexing="ij"), -1).reshape(-1, 2)
    start = time.process_time()
    tree = FacetTree.of(mesh)
    drop_cutter(tree, places[:1], RADIUS)
    building = time.process_time() - start
    start = time.process_time()
    heights = drop_cutter(tree, places, RADIUS)
    own = (time.process_time() - start) / len(places)
    print(f"{len(mesh.faces):,} facets, ball of {2e3 * RADIUS:g} mm, {platform.machine()}, one thread")
    print(f"ours: {1.0 / own:,.0f} points/s, the tree before in {building:.2f} s")
    few = slice(None, None, max(1, len(places) // options.peer_points))
    for bucket in (1, 10):
        theirs, seconds = peer(mesh, places[few], bucket)
        each = seconds / len(theirs)
        apart = 1e9 * np.abs(theirs - heights[few]).max()
        print(
            f"OpenCAMLib, {bucket} in a bucket: {1.0 / each:,.0f} points/s, ratio {each / own:.0f}; "
            f"heights differ by {apart:.2g} nm at most"
        )


if __name__ == "__main__":
    main()
