"""Geodesic distances: seconds and errors against pygeodesic's exact MMP on an irregular wavy sheet, and their growth.

Run ``python benchmarks/geodesic.py``. Corners are moved at random by a quarter of an edge. Distances are from a point,
counted in steps of five edges. Seconds are those of the processor, one thread.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from pentapod.mesh.geodesic.distance import GeodesicField, Sources
from pentapod.mesh.patch import Patch
from pentapod.toolpath import Mesh

WIDTH, EDGES_PER_STEP = 40.0, 5.0


def irregular_sheet(cells: int) -> tuple[Patch, float]:
    """Return a wavy sheet of 2 · cells² facets with its corners moved at random, and its stepover, millimetres."""
    edge = WIDTH / cells
    x, y = np.meshgrid(np.linspace(0.0, WIDTH, cells + 1), np.linspace(0.0, WIDTH, cells + 1))
    random = np.random.default_rng(1)
    x, y = (a + random.uniform(-0.25, 0.25, a.shape) * edge for a in (x, y))
    n = cells + 1
    first = np.arange(cells * n).reshape(cells, n)[:, :-1].ravel()
    faces = np.stack([first, first + 1, first + n + 1, first, first + n + 1, first + n], 1).reshape(-1, 3)
    points = np.stack([x, y, 3.0 * np.sin(x / 4.0) * np.sin(y / 5.0)], -1).reshape(-1, 3)
    return Patch.whole(Mesh.of(1e-3 * points, faces)), EDGES_PER_STEP * edge


def main() -> None:
    """Measure and print the table."""
    from pygeodesic import geodesic  # noqa: PLC0415

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, nargs="+", default=[50, 100, 160])
    options = parser.parse_args()
    print(f"{'facets':>10} {'ours s':>10} {'MMP s':>10} {'ratio':>10} {'error, steps':>14}")
    for cells in [10, *options.cells]:  # the first loads the kernels
        patch, step = irregular_sheet(cells)
        source = len(patch.vertices) // 2
        facet, corner = (a[0] for a in np.nonzero(patch.faces == source))
        sources = Sources.points(np.array([facet]), np.eye(3)[[corner]])
        start = time.process_time()
        field = GeodesicField.of(patch, sources, 1e3 / step)
        ours = time.process_time() - start
        start = time.process_time()
        oracle = geodesic.PyGeodesicAlgorithmExact(1e3 * patch.vertices, patch.faces)
        exact = oracle.geodesicDistances(np.array([source]))[0] / step
        peer = time.process_time() - start
        error = np.abs(field.values - exact).max()
        print(f"{len(patch.faces):>10,} {ours:>10.3g} {peer:>10.3g} {peer / ours:>10.3g} {error:>14.2g}", flush=True)


if __name__ == "__main__":
    main()
