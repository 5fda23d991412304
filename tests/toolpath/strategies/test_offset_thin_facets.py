"""Offset curves and fill lines on thin facets: those of the surface, not of its triangulation."""

import numpy as np
import pytest

from pentapod.toolpath import BallCutter, Mesh, OffsetOptions, SpiralOptions
from pentapod.toolpath.strategies.offset import offset_paths
from pentapod.toolpath.strategies.spiral import spiral_paths
from pentapod.toolpath.surfaces.part_surface import PartSurface

BALL = BallCutter(3e-3)
STEP = 4e-3
UP = np.array([0.0, 0.0, 1.0])
slow = pytest.mark.slow


def plate(aspect, facets, size=0.04):
    """A square plate in thin triangles."""
    rows = int(np.sqrt(0.5 * facets * aspect))
    columns = max(2, round(0.5 * facets / rows))
    x, y = np.meshgrid(np.linspace(0, size, columns + 1), np.linspace(0, size, rows + 1))
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    a, n = (j * (columns + 1) + i).ravel(), columns + 1
    faces = np.concatenate([np.stack([a, a + 1, a + n + 1], 1), np.stack([a, a + n + 1, a + n], 1)])
    return Mesh.of(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1), faces)


def turns(points):
    """The cosines of a line's turns, points closer than a micrometre left out."""
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6
    points = points[np.concatenate([[True], apart])]
    along = np.diff(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return (along[1:] * along[:-1]).sum(axis=1)


@pytest.mark.parametrize(
    ("aspect", "facets"), [(1, 600), *(pytest.param(*each, marks=slow) for each in ((10, 400), (30, 900)))]
)
def test_offsets_of_a_circle_are_circles_on_thin_facets(aspect, facets):
    turn = np.linspace(0, 2 * np.pi, 200)
    curve = np.stack([0.02 + 3.5e-3 * np.cos(turn), 0.02 + 3.5e-3 * np.sin(turn), 0 * turn], 1)
    passes = offset_paths(
        PartSurface(plate(aspect, facets), BALL, UP), OffsetOptions(stepover=STEP, curve=curve)
    ).passes
    radius = np.hypot(*(passes.points[:, :2] - 0.02).T)
    for k, level in enumerate(passes.levels):
        if level <= 6:  # further ones are fill lines
            np.testing.assert_allclose(radius[passes.rows(k)], 3.5e-3 + level * STEP, atol=0.01 * STEP)
        assert (turns(passes.points[passes.rows(k)]) > np.cos(np.radians(120))).all()
    assert set(range(6)) <= set(passes.levels.tolist())


@pytest.mark.parametrize(
    ("aspect", "facets"), [(3, 500), *(pytest.param(*each, marks=slow) for each in ((10, 400), (30, 900)))]
)
def test_offsets_of_the_border_are_squares_on_thin_facets(aspect, facets):
    passes = offset_paths(PartSurface(plate(aspect, facets), BALL, UP), OffsetOptions(stepover=STEP)).passes
    for k, level in enumerate(passes.levels):
        if level < 5:
            points = passes.points[passes.rows(k), :2]
            inside = np.minimum(points, 0.04 - points).min(axis=1)
            # Within a facet a line cuts the corner off.
            assert (np.abs(inside - (level + 0.5) * STEP) < 0.01 * STEP).mean() > 0.9
        assert (turns(passes.points[passes.rows(k)]) > np.cos(np.radians(120))).all()


@pytest.mark.parametrize("form", [pytest.param("offset", marks=slow), "planar"])
def test_a_spiral_on_thin_facets_has_no_reversal(form):
    passes = spiral_paths(PartSurface(plate(10, 400), BALL, UP), SpiralOptions(stepover=STEP, form=form)).passes
    longest = int(passes.lengths.argmax())
    assert (turns(passes.points[passes.rows(longest)]) > np.cos(np.radians(120))).all()
