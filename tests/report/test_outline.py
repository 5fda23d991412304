"""Outlines of the set-up's drawings against solids whose silhouette is known."""

from __future__ import annotations

import time

import numpy as np
import pytest

from pentapod.mesh.topology import Topology
from pentapod.report.drawings.outline import OPTIONS, Outline, outline_of
from pentapod.report.drawings.raster import Grid, borders, simplified

FRONT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def box(low, high):
    """The vertices and facets of a box, wound outwards."""
    corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)], dtype=float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return corners, np.array([f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))])


def revolved(profile, around=96):
    """The facets of a closed profile (K, 2) of radius and height, turned about z."""
    profile, turn = np.asarray(profile, dtype=float), np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    rim = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    flat, shape = profile[:, None, 0, None] * rim, (len(profile), around, 1)
    rings = np.concatenate([flat, np.broadcast_to(profile[:, None, 1, None], shape)], axis=-1)
    k = np.arange(len(profile) * around).reshape(len(profile), around)
    a, b = k, np.roll(k, -1, axis=1)
    c, d = np.roll(a, -1, axis=0), np.roll(b, -1, axis=0)
    return rings.reshape(-1, 3), np.concatenate([np.stack(f, axis=-1).reshape(-1, 3) for f in ((a, b, d), (a, d, c))])


def joined(*solids):
    """Several solids as one mesh."""
    shifts = np.cumsum([0] + [len(v) for v, _ in solids[:-1]])
    return np.concatenate([v for v, _ in solids]), np.concatenate(
        [f + s for (_, f), s in zip(solids, shifts, strict=True)]
    )


def drawn(vertices, faces):
    """The outline of facets of vertices."""
    return outline_of(vertices, Topology(faces, len(vertices)))


def lines_on(outline: Outline, axis: int, value: float, within: float) -> float:
    """The length of the lines inside that run along an axis at a value of the other."""
    total = 0.0
    for line in outline.lines:
        near = np.abs(line[:, 1 - axis] - value) < within
        total += float(np.abs(np.diff(line[:, axis]))[near[1:] & near[:-1]].sum())
    return total


def test_outline_of_a_tube_has_a_hole():
    vertices, faces = revolved([(10, 0), (20, 0), (20, 5), (10, 5)])
    outline = drawn(vertices, faces)
    assert len(outline.areas) == 2
    polygon = 48 * np.sin(2 * np.pi / 96)  # area of 96 corners on a circle of radius 1
    assert outline.area == pytest.approx(polygon * (20**2 - 10**2), rel=2e-3)
    inner = min(outline.areas, key=lambda line: np.abs(line).max())
    assert np.linalg.norm(inner, axis=1) == pytest.approx(10.0, abs=0.08)
    # From the side the hole is behind a wall.
    side = drawn(vertices @ FRONT.T, faces)
    assert len(side.areas) == 1
    assert side.area == pytest.approx(40 * 5, rel=1e-2)


def test_outline_is_the_union_and_no_hull():
    """Two boxes in an L, which overlap: the area of the L, exactly."""
    vertices, faces = joined(box((0, 0, 0), (60, 20, 10)), box((0, 0, 0), (20, 50, 30)))
    outline = drawn(vertices, faces)
    assert outline.area == pytest.approx(60 * 20 + 50 * 20 - 20 * 20, rel=1e-6)
    (line,) = outline.areas
    assert len(line) == 7, "six corners, and the first again"
    assert outline.low == pytest.approx([0, 0])
    assert outline.high == pytest.approx([60, 50])


def test_outline_hides_lines_behind_the_part():
    """A step on top is drawn from above; a step below is not."""
    step = joined(box((0, 0, 0), (60, 40, 10)), box((20, 5, 10), (50, 35, 20)))
    assert lines_on(drawn(*step), 0, 5.0, 0.2) == pytest.approx(30.0, abs=1.0)
    turned = step[0] * (1.0, -1.0, -1.0), step[1]
    assert lines_on(drawn(*turned), 0, -5.0, 0.2) == 0.0


@pytest.mark.parametrize("turn", [0.0, 17.0, 45.0])
def test_outline_keeps_straight_edges_straight(turn):
    angle = np.radians(turn)
    spin = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    vertices, faces = box((0, 0, 0), (70, 30, 10))
    outline = drawn(vertices @ spin.T, faces)
    (line,) = outline.areas
    assert outline.area == pytest.approx(70 * 30, rel=4e-3)
    cell = 76.0 / OPTIONS.cells
    back = line @ spin[:2, :2]
    off = np.minimum(np.abs(back - (0, 0)), np.abs(back - (70, 30))).min(axis=1)
    assert off.max() < 1.2 * cell
    assert len(line) <= 13


def test_outline_of_an_open_sheet_and_of_nothing_seen():
    """An open sheet has its border; seen along itself it covers nothing, but is drawn as a line."""
    vertices, faces = np.array([[0, 0, 0], [40, 0, 0], [40, 20, 0], [0, 20, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])
    assert drawn(vertices, faces).area == pytest.approx(800, rel=1e-6)
    edge_on = drawn(vertices @ FRONT.T, faces)
    assert edge_on.areas == ()
    assert sum(float(np.ptp(line[:, 0])) for line in edge_on.lines) >= 40.0 - 0.1


@pytest.mark.slow
def test_outline_of_three_hundred_thousand_facets_is_quick():
    count = 390
    x, y = np.meshgrid(np.linspace(0, 200, count), np.linspace(0, 200, count))
    vertices = np.stack([x, y, 10 * np.sin(0.06 * x) * np.cos(0.045 * y)], axis=-1).reshape(-1, 3)
    k = np.arange(count * count).reshape(count, count)
    a, b, c, d = k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]
    faces = np.concatenate([np.stack(f, axis=-1).reshape(-1, 3) for f in ((a, b, c), (a, c, d))])
    assert len(faces) > 300_000
    start = time.process_time()
    outline = drawn(vertices, faces)
    assert time.process_time() - start < 2.0
    assert outline.area == pytest.approx(200 * 200, rel=1e-6)
    noisy = vertices + np.random.default_rng(1).normal(0.0, 0.5, vertices.shape) * (0.0, 0.0, 1.0)
    start = time.process_time()
    assert len(drawn(noisy, faces).lines) <= OPTIONS.most_lines
    assert time.process_time() - start < 2.0


def test_borders_of_cells_that_touch_in_a_corner_stay_apart():
    cells = np.zeros((9, 9), dtype=bool)
    cells[1:4, 1:4] = cells[4:7, 4:7] = True
    lines = borders(cells)
    assert len(lines) == 2
    for line in lines:
        assert (line[0] == line[-1]).all()
    assert borders(np.zeros((4, 4), dtype=bool)) == []


def test_nearest_facet_of_a_cell_is_the_one_towards_the_viewer():
    vertices, faces = joined(box((0, 0, 0), (10, 10, 2)), box((5, 0, 2), (10, 10, 7)))
    grid = Grid.around(vertices[:, :2].min(axis=0), vertices[:, :2].max(axis=0), 100)
    heights = grid.nearest(grid.cuts(vertices[faces]))
    assert heights[50, 20] == pytest.approx(2.0)
    assert heights[50, 80] == pytest.approx(7.0)
    assert heights[0, 0] == -np.inf


def test_simplified_line_stays_within_its_tolerance():
    angles = np.linspace(0.0, 2.0 * np.pi, 500)
    circle = 100.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    thin = simplified(circle, 0.5)
    assert 20 < len(thin) < 80
    middle = 0.5 * (thin[1:] + thin[:-1])
    assert np.linalg.norm(middle, axis=1).min() > 100.0 - 0.6
