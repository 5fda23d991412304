"""Rest lines: over what passes leave, and nowhere else; what is left is measured at dense samples of the surface."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from concave_parts import mesh
from left_material import Reachable, dense, left
from pentapod import BallCutter, Mesh
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.toolpath import RasterOptions, make_toolpath
from pentapod.toolpath.lines.rest_lines import rest_lines
from pentapod.toolpath.strategies import registry

R, STEP = 3e-3, 3e-3
RIDGE = R - np.sqrt(R**2 - 0.25 * STEP**2)


def sheet(height, width=0.03, length=0.02, cells=40):
    """A surface of centres over a rectangle. cells: number along both sides, or the coordinates along them."""
    even = isinstance(cells, int)
    sides = [np.linspace(0.0, size, cells + 1) for size in (length, width)] if even else cells
    x, y = np.meshgrid(*sides, indexing="ij")
    k = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    points = np.stack([x.ravel(), y.ravel(), height(x, y).ravel()], axis=1)
    return Patch.whole(Mesh.of(points, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])))


def along_x(ys, height):
    x = np.linspace(0.0, 0.02, 81)
    lines = [np.stack([x, 0 * x + y, height(x, 0 * x + y)], axis=1) for y in ys]
    return Passes.of([(line, np.tile([0.0, 0.0, 1.0], (len(x), 1))) for line in lines], np.arange(len(lines)))


def none(points):
    return np.zeros(len(points), dtype=np.bool_)


def closed(patch):
    """No border of the patch lies in a corner."""
    return np.zeros(0, dtype=np.intp), np.zeros((0, 3))


def flat(x, y):
    return 0.0 * x + 0.0 * y


def hollow(x, y):
    """Centres of a ball in a groove whose radius is 1 mm larger than its own, with slopes of 45° beside it."""
    side = np.abs(y - 0.015)
    inner = 1e-3 / np.sqrt(2.0)
    return (
        np.where(side < inner, 1e-3 - np.sqrt(np.maximum(1e-6 - side**2, 0.0)), 1e-3 - inner + side - inner) + 0.0 * x
    )


YS = np.arange(0.5 * STEP, 0.03, STEP)


def test_passes_a_stepover_apart_leave_no_rest_on_a_plane():
    assert len(rest_lines(sheet(flat), along_x(YS, flat), R, STEP, none, closed)) == 0


@pytest.mark.parametrize("step", [3e-3, 1e-3, 0.4e-3, 0.1e-3])
def test_only_what_may_be_left_is_looked_at_closely_however_near_the_passes_are(step, monkeypatch):
    """The points that stood for them were farther apart than the passes; all of the surface was refined."""
    looked = []

    def refined(self, longest):
        looked.append(len(self.faces))
        return self

    monkeypatch.setattr(Patch, "refined", refined)
    ys = np.arange(0.5 * step, 0.03, step)
    assert len(rest_lines(sheet(flat), along_x(ys, flat), R, step, none, closed)) == 0
    rim = 2 * 40 * 3  # between the first pass and the border lies half a stepover
    assert looked[0] <= rim


def test_the_ball_dips_into_a_hole_narrower_than_itself_however_finely_the_pit_over_it_is_meshed():
    """A pass is 0.4 mm beside the axis. The pit has hardly any area, but all of the hole answers for its bottom."""
    hole = 2.5e-3

    def pit(x, y):
        return np.sqrt(R**2 - (hole - np.minimum(np.hypot(x - 0.01, y - 0.015), hole)) ** 2)

    even = np.linspace(-1.0, 1.0, 121)
    patch = sheet(pit, cells=(0.01 + 0.01 * even * np.abs(even), 0.015 + 0.015 * even * np.abs(even)))
    found = rest_lines(patch, along_x(0.4e-3 + np.arange(0.0, 0.03, STEP), pit), R, STEP, none, closed, 0.5e-3)
    (dip,) = (k for k in range(len(found)) if np.abs(found.points[found.rows(k)][:, 1] - 0.015).max() < hole)
    assert found.lengths[dip] > 0.5 * STEP
    assert np.hypot(*(found.points[found.rows(dip)][:, :2] - [0.01, 0.015]).T).min() < 0.1e-3


def test_passes_wider_apart_than_the_ball_are_meant_so():
    assert len(rest_lines(sheet(flat), along_x(YS[::3], flat), R, 3.0 * STEP, none, closed)) == 0


def test_a_pass_left_out_is_put_back_in_the_middle_of_the_gap():
    patch = sheet(flat)
    found = rest_lines(patch, along_x(np.delete(YS, 4), flat), R, STEP, none, closed)
    assert len(found) == 1
    assert np.abs(found.points[:, 1] - YS[4]).max() < 0.3 * STEP
    assert np.ptp(found.points[:, 0]) > 0.018
    assert (
        len(
            rest_lines(
                patch, along_x(np.delete(YS, 4), flat), R, STEP, lambda x: np.abs(x[:, 1] - YS[4]) < STEP, closed
            )
        )
        == 0
    )


def test_the_corner_at_a_border_gets_a_line_where_the_last_pass_leaves_too_much():
    """A wall rises at y = 0, beyond the patch; the last pass is 1.3 mm from it: on the floor itself nothing is left."""

    def wall(patch):
        side = np.flatnonzero(patch.topology.facets_at_edge[patch.topology.edge_of_side.ravel()] == 1)
        side = side[(patch.vertices[patch.side_ends(side)][:, :, 1] < 1e-9).all(axis=1)]
        return side, np.tile([0.0, 1.0, 0.0], (len(side), 1))

    patch, passes = sheet(flat), along_x(1.3e-3 + np.arange(0.0, 0.028, STEP), flat)
    assert len(rest_lines(patch, passes, R, STEP, none, closed)) == 0
    found = rest_lines(patch, passes, R, STEP, none, wall)
    assert len(found) == 1
    assert found.points[:, 1].max() < 0.3e-3
    assert np.ptp(found.points[:, 0]) > 0.018


def test_the_corner_between_two_walls_gets_a_line_however_small_the_facets_in_it_are():
    """Passes along both walls end 1 mm before it: too much is left only where the ball touches three sides at once."""

    def walls(patch):
        side = np.flatnonzero(patch.topology.facets_at_edge[patch.topology.edge_of_side.ravel()] == 1)
        along_y, along_x = ((patch.vertices[patch.side_ends(side)][:, :, k] < 1e-9).all(axis=1) for k in (0, 1))
        normals = np.where(along_x[:, None], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
        return side[along_x | along_y], normals[along_x | along_y]

    uneven = np.linspace(0.0, 1.0, 121) ** 2
    patch = sheet(flat, cells=(0.02 * uneven, 0.03 * uneven))
    way = np.linspace(1e-3, 0.02, 80)
    first = Passes.of([(np.outer(way, axis), np.tile([0.0, 0.0, 1.0], (80, 1))) for axis in np.eye(3)[:2]])
    passes = Passes.joined([first, along_x(np.append(np.arange(STEP, 0.03, STEP), 0.0295), flat)])
    assert len(rest_lines(patch, passes, R, STEP, none, closed)) == 0
    found = rest_lines(patch, passes, R, STEP, none, walls)
    assert len(found) == 1
    assert np.linalg.norm(found.points, axis=1).min() < 0.1e-3
    assert np.linalg.norm(found.points, axis=1).max() < STEP


def test_the_bottom_of_a_hollow_gets_a_line_where_passes_beside_it_leave_too_much():
    """Passes on both flanks, a stepover apart along the surface of centres; the ball's own bottom lies between them."""
    apart = 0.5 * (STEP - 0.5 * np.pi * 1e-3) / np.sqrt(2.0) + 1e-3 / np.sqrt(2.0)
    beside = apart + np.arange(0.0, 0.016, STEP / np.sqrt(2.0))
    ys = np.concatenate([0.015 + beside, 0.015 - beside])
    passes = along_x(ys, hollow)
    found = rest_lines(sheet(hollow, cells=120), passes, R, STEP, none, closed)
    bottom = np.stack([np.linspace(2e-3, 0.018, 50), np.full(50, 0.015), np.full(50, -R)], axis=1)
    before = KDTree(np.concatenate([dense(passes.points[passes.rows(k)]) for k in range(len(passes))]))
    assert before.query(bottom)[0].min() - R > 1.3 * RIDGE
    assert len(found) == 1
    assert np.abs(found.points[:, 1] - 0.015).max() < 5e-4
    after = KDTree(np.concatenate([dense(found.points[found.rows(k)]) for k in range(len(found))]))
    assert after.query(bottom)[0].max() - R < 0.5 * RIDGE


def test_the_bottom_of_a_pit_gets_a_line_where_passes_beside_it_leave_too_much():
    """Three walls meet at a point midway between two passes: the ball at the bottom touches all three at once."""

    def pit(x, y):
        away = [np.cos(a) * (x - 0.01) + np.sin(a) * (y - 0.015) for a in np.radians([90.0, 210.0, 330.0])]
        return 0.6 * np.maximum.reduce(away)

    beside = STEP * np.arange(0.5, 5.0)
    found = rest_lines(
        sheet(pit, cells=150), along_x(np.concatenate([0.015 + beside, 0.015 - beside]), pit), R, STEP, none, closed
    )
    bottom = np.array([0.01, 0.015, -R])
    assert np.linalg.norm(found.points - bottom - [0.0, 0.0, R], axis=1).min() < 3e-4
    near = KDTree(np.concatenate([dense(found.points[found.rows(k)]) for k in range(len(found))]))
    assert near.query(bottom)[0] - R < 0.5 * RIDGE


@pytest.mark.slow
def test_hollows_of_an_egg_crate_are_machined(monkeypatch):
    """Lows of 2.5 mm for a ball of 2 mm: without rest lines much more is left in them than the ridge."""
    part, ball, options = mesh("egg_crate"), BallCutter(2e-3), RasterOptions(stepover=2e-3)
    samples = Reachable(part, 2e-3, 2e-4).samples(8000)
    ridge = 2e-3 - np.sqrt(3e-6)

    def most():
        found = left(samples, make_toolpath(part, ball, options), 2e-3)
        return float(np.quantile(found.excess, 0.9999))

    assert most() < 1.25 * ridge
    monkeypatch.setattr(registry, "rest_lines", lambda *_: Passes.of([]))
    assert most() > 1.3 * ridge


def test_a_facet_folded_onto_what_rises_beside_it_is_passed_over():
    """No direction is between opposite normals: it once ended with an error about a vector without length."""
    patch = sheet(flat)

    def folded(part):
        return np.array([0]), -part.facet_normals[:1]

    lines = rest_lines(patch, along_x(YS, flat), R, STEP, none, folded)
    assert not len(lines)
