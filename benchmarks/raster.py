"""Rasters: seconds against trimesh's bare `mesh_multiplane` on the same planes, and how they grow with the facets.

Run ``make bench-gouge``. The surface is one wavy sheet, 300 mm wide, in more and more irregular facets. Seconds are
those of the processor, one thread; the lines are drawn (cut, joined, with normals), and finished (waypoints within the
tolerance, in order, with links that are proven clear).
"""

from __future__ import annotations

import argparse
import platform
import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from drop_cutter import jittered_sheet

from pentapod.mesh.query.swept_depth import touch
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath import BallCutter, Mesh, RasterOptions, toolpath_with_report
from pentapod.toolpath.strategies.raster import raster_paths
from pentapod.toolpath.surfaces.part_surface import PartSurface

WIDTH, STEPOVER = 0.3, 1.5e-3
TOOL = BallCutter(3e-3)
Value = TypeVar("Value")


def timed(action: Callable[[], Value]) -> tuple[Value, float]:
    """Return what an action gives, and its seconds of the processor."""
    start = time.process_time()
    value = action()
    return value, time.process_time() - start


def planes_of(mesh: Mesh) -> float:
    """Return the seconds of trimesh's sections by as many planes as the raster has lines."""
    import trimesh  # noqa: PLC0415

    shape = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    heights = np.arange(-0.5 * WIDTH + 0.5 * STEPOVER, 0.5 * WIDTH, STEPOVER)
    section = trimesh.intersections.mesh_multiplane
    return timed(lambda: section(shape, np.zeros(3), np.array([0.0, 1.0, 0.0]), heights))[1]


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--facets", type=int, nargs="+", default=[50_000, 200_000, 1_000_000, 5_000_000])
    parser.add_argument("--finish-up-to", type=int, default=1_000_000)
    options = parser.parse_args()
    told = RasterOptions(stepover=STEPOVER, spacing=2e-3, chordal=10e-6)
    raster_paths(PartSurface(jittered_sheet(10, WIDTH), TOOL, told.up), told)
    touch(FacetTree.of(jittered_sheet(10, WIDTH)), TOOL, np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))
    print(f"NumPy {np.__version__}, Python {platform.python_version()}, {platform.machine()}, one thread")
    columns = ("facets", "mesh s", "planes s", "lines s", "ratio", "finished s", "tree s", "lines / n log n")
    print("  ".join(f"{name:>15}" for name in columns))
    for facets in options.facets:
        mesh, loading = timed(lambda count=facets: jittered_sheet(round((count / 2) ** 0.5), WIDTH))
        _ = mesh.corner_normals
        planes = planes_of(mesh)
        lines = timed(lambda part=mesh: raster_paths(PartSurface(part, TOOL, told.up), told))[1]
        tree = timed(lambda part=mesh: FacetTree.of(part))[1]
        count = len(mesh.faces)
        finished = float("nan")
        if count <= options.finish_up_to:
            finished = timed(lambda part=mesh: toolpath_with_report(part, TOOL, told))[1]
        growth = 1e9 * lines / (count * np.log2(count))
        numbers = (loading, planes, lines, lines / planes, finished, tree, growth)
        print("  ".join([f"{count:>15,}", *(f"{number:15.3g}" for number in numbers)]), flush=True)


if __name__ == "__main__":
    main()
