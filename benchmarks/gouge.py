"""Contact points, normals and gouge check of a 6 mm ball, in points a second, against OpenCAMLib's BatchDropCutter.

Run ``make bench-gouge``. The mesh is an irregular wavy sheet of 200,000 facets, the points lie on a raster over it.
Ours: everything from the mesh to the verdict, the tree of facets included. Its: the drop cutter alone, without the time
that it needs before the first point, on every n-th of the same points, for it would take long over all of them.
Seconds are those of the processor, of one thread each, so that other work on the machine does not count.
"""

from __future__ import annotations

import argparse
import platform
import time
from typing import Any

import numpy as np
from scipy.spatial import Delaunay

from pentapod.base.arrays import Floats
from pentapod.cutters.ball import BallCutter
from pentapod.mesh.query.swept_depth import sweep, touch
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath import HeightField, Mesh

RADIUS, CELLS = 3e-3, 316
UP = np.array([0.0, 0.0, 1.0])


def wavy_sheet(width: float) -> Mesh:
    """Return a sheet of about 2 · CELLS² facets, waves 4 mm high and 50 mm long, on a square `width` metres wide.

    Its vertices lie anywhere and the facets have any shape: on a regular grid the peer's tree is at its worst.
    """
    inside = np.random.default_rng(1).uniform(-0.5 * width, 0.5 * width, (CELLS**2, 2))
    line = np.linspace(-0.5 * width, 0.5 * width, CELLS + 1)[:-1]
    border = np.full(CELLS, 0.5 * width)
    sides = [np.stack(pair, 1) for pair in ((line, -border), (border, line), (-line, border), (-border, -line))]
    places = np.concatenate([inside, *sides])
    x, y = places.T
    z = 4e-3 * np.sin(x / 8e-3) * np.cos(y / 9e-3)
    faces = Delaunay(places).simplices.astype(np.intp)
    (a, b), (c, d) = (places[faces[:, k]].T - places[faces[:, 0]].T for k in (1, 2))
    turned = a * d - b * c < 0.0
    faces[turned] = faces[turned][:, ::-1]
    return Mesh.of(np.stack([x, y, z], -1), faces)


def raster_points(width: float, count: int) -> Floats:
    """Return about `count` places (N, 3) on parallel lines, 5 mm inside the sheet's border."""
    side = round(count**0.5)
    line = np.linspace(-0.5 * width + 5e-3, 0.5 * width - 5e-3, side)
    x, y = np.meshgrid(line, line)
    x[1::2] = x[1::2, ::-1]
    return np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=1)


def ours(mesh: Mesh, places: Floats, *, between: bool) -> tuple[int, float]:
    """Return how many points gouge by more than 10 µm, and the deepest in metres."""
    contacts, normals, _ = HeightField(mesh, UP).topmost(places)
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    tool = BallCutter(RADIUS)
    tips = tool.tips(contacts, normals, normals)
    met = (sweep if between else touch)(FacetTree.of(mesh), tool, tips, normals, threshold=10e-6)
    return int((met.deepest > 10e-6).sum()), float(met.deepest.max())


def drop_cutter(mesh: Mesh, places: Floats) -> float:
    """Return OpenCAMLib's seconds for the places; nan where it is not installed."""
    try:
        import opencamlib  # noqa: PLC0415
    except ImportError:
        return float("nan")
    ocl: Any = opencamlib  # it has no types
    surface = ocl.STLSurf()
    for corners in 1e3 * mesh.vertices[mesh.faces]:
        surface.addTriangle(ocl.Triangle(*(ocl.Point(*corner) for corner in corners)))
    cutter, drop = ocl.BallCutter(2e3 * RADIUS, 50.0), ocl.BatchDropCutter()
    drop.setThreads(1)
    drop.setSTL(surface)
    drop.setCutter(cutter)
    for x, y, _ in 1e3 * places:
        drop.appendPoint(ocl.CLPoint(float(x), float(y), -100.0))
    return best(drop.run, repeats=1)[1]


def best(action: Any, repeats: int) -> tuple[Any, float]:
    """Return what an action gives, and its shortest time in seconds."""
    times: list[float] = []
    result: Any = None
    for _ in range(repeats):
        start = time.process_time()
        result = action()
        times.append(time.process_time() - start)
    return result, min(times)


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--width-mm", type=float, default=300.0, help="of the sheet; wider is easier for the peer")
    parser.add_argument("--points", type=int, default=100_000)
    parser.add_argument("--peer-points", type=int, default=1000)
    options = parser.parse_args()
    width = 1e-3 * options.width_mm
    mesh, places = wavy_sheet(width), raster_points(width, options.points)
    ours(mesh, places[:10], between=False)  # compiles, or loads what was compiled
    ours(mesh, places[:10], between=True)
    (gouging, deepest), seconds = best(lambda: ours(mesh, places, between=False), 3)
    _, sweeping = best(lambda: ours(mesh, places, between=True), 1)
    few = places[:: max(1, len(places) // options.peer_points)]
    start = few[:: len(few) // 20]
    peer = (drop_cutter(mesh, few) - drop_cutter(mesh, start)) / (len(few) - len(start))
    print(f"{len(mesh.faces):,} facets, {len(places):,} points, ball of {2e3 * RADIUS:g} mm; ", end="")
    print(f"{gouging} points deeper than 10 µm, the deepest {1e6 * max(deepest, 0.0):.1f} µm")
    print(f"NumPy {np.__version__}, Python {platform.python_version()}, {platform.machine()}, one thread")
    print(f"{'':38}  {'points/s':>10}  {'ratio':>7}")
    for name, each in (
        ("drop cutter alone", peer),
        ("contacts, normals, tree, gouge check", seconds / len(places)),
        ("the same, and between the points", sweeping / len(places)),
    ):
        print(f"{name:38}  {1.0 / each:10.0f}  {peer / each:6.1f}x")


if __name__ == "__main__":
    main()
