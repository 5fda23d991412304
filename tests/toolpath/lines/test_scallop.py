"""Scallops: the ridge between neighbouring balls, found by brute force across the passes, against the asked one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import KDTree

import toolpath_surfaces as surfaces
from pentapod.toolpath import (
    BallCutter,
    Mesh,
    OffsetOptions,
    RasterOptions,
    Region,
    SegmentKind,
    SpiralOptions,
    stepover_for,
    toolpath_with_report,
)

RADIUS, SCALLOP = 3e-3, 4e-5
UPPER = Region(angle=np.radians(50.0))


def cylinder(radius=0.03, length=0.08, cells=160):
    def height(x, y):
        return np.sqrt(radius**2 - y**2)

    return surfaces.grid(height, width=length, cells=cells, depth=0.9 * 2 * radius * np.sin(np.radians(55)))


def exact_normals(kind, points):
    """Outward normals of the smooth surface that a mesh stands for."""
    if kind == "sphere":
        return points / np.linalg.norm(points, axis=1, keepdims=True)
    if kind == "cylinder":
        away = points * [0, 1, 1]
        return away / np.linalg.norm(away, axis=1, keepdims=True)
    ring = np.hypot(points[:, 0], points[:, 1])
    away = points * np.stack([1 - 0.04 / ring, 1 - 0.04 / ring, 1 + 0 * ring], 1)
    return away / np.linalg.norm(away, axis=1, keepdims=True)


SHAPES = {
    "sphere": lambda: surfaces.sphere(subdivisions=5),
    "cylinder": cylinder,
    "torus": lambda: surfaces.torus(sections=(300, 150)),
}


def ridges(kind, mesh, toolpath, count):
    """Height (n,) of what is left over `count` random points of the surface, metres, well inside the region."""
    centres = []
    for segment in toolpath.segments:
        if segment.kind is SegmentKind.CUT:
            line = segment.tips + RADIUS * segment.axes
            steps = np.maximum(np.ceil(np.linalg.norm(np.diff(line, axis=0), axis=1) / 5e-5).astype(int), 1)
            centres += [
                a + (b - a) * np.linspace(0, 1, n, endpoint=False)[:, None]
                for a, b, n in zip(line, line[1:], steps, strict=False)
            ]
    tree = KDTree(np.concatenate(centres))
    # Planes are densest at the region's edge, a stepover inside which the ridges are as high as asked.
    points, _ = surfaces.random_points(mesh, count, Region(angle=np.radians(46.0)))
    if kind == "cylinder":
        points = points[np.abs(points[:, 0]) < 0.036]
    normals = exact_normals(kind, points)
    # What stands over a point is cut where a ball holds it: the lowest place along the normal that a ball reaches.
    low, high = np.full(len(points), -SCALLOP), np.full(len(points), 4 * SCALLOP)
    for _ in range(15):  # to a few thousandths of the ridge
        middle = 0.5 * (low + high)
        free = np.asarray(tree.query(points + middle[:, None] * normals)[0]) >= RADIUS
        low, high = np.where(free, middle, low), np.where(free, high, middle)
    return low


POINTS = 20_000  # of few points chance can put more than 0.1 % where an offset's fronts turn a corner


@pytest.mark.slow  # in the fast lane: scallops on slopes, test_raster.py
@pytest.mark.parametrize("options", [RasterOptions, OffsetOptions, SpiralOptions])
@pytest.mark.parametrize("kind", SHAPES)
def test_scallops_are_as_high_as_asked_for(kind, options):
    """The highest ridge within a tenth below and a twentieth above; facets sag by less than a hundredth of that."""
    mesh = Mesh.of(*SHAPES[kind]())
    told = options(scallop=SCALLOP, region=UPPER, spacing=1e-3, chordal=2e-6)
    toolpath, _ = toolpath_with_report(mesh, BallCutter(RADIUS), told)
    high = np.quantile(ridges(kind, mesh, toolpath, POINTS), 0.999)
    assert 0.9 * SCALLOP <= high <= 1.05 * SCALLOP


@pytest.mark.parametrize("curvature", [-200.0, -30.0, 0.0, 1e-9, 20.0, 500.0])
def test_the_stepover_against_two_circles_that_meet(curvature):
    """Ridge between two discs on a circle, by bisection on the line between them."""
    scallop, radius = 2e-5, 3e-3
    step = float(stepover_for(scallop, radius, curvature))
    if abs(curvature) < 1e-6:
        centres = np.array([[-step / 2, radius], [step / 2, radius]])
        way, base = np.array([0.0, 1.0]), np.zeros(2)
    else:
        bend, angle = 1.0 / curvature, 0.5 * step * curvature
        centres = np.array([[np.sin(s * angle), np.cos(s * angle) - 1] for s in (-1, 1)]) * bend
        centres += radius * np.array([[np.sin(s * angle), np.cos(s * angle)] for s in (-1, 1)])
        way, base = np.array([0.0, 1.0]), np.zeros(2)
    low, high = 0.0, radius
    for _ in range(60):
        middle = 0.5 * (low + high)
        free = np.linalg.norm(base + middle * way - centres, axis=1).min() >= radius
        low, high = (middle, high) if free else (low, middle)
    assert low == pytest.approx(scallop, rel=1e-6)
