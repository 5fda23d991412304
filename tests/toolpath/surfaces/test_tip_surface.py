"""Tip surface: bull-nose and flat ends with a fixed axis, against closed forms and OpenCAMLib."""

import numpy as np
import pytest
import trimesh

from concave_parts import terraces, within
from left_by_ends import gouges, rest_heights
from pentapod import Mesh, RasterOptions, Region
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.flat_end import FlatEnd
from pentapod.mesh.offset.tip_surface import Lowered
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath import SegmentKind, make_toolpath
from pentapod.toolpath.surfaces.tip_surface import TipSurface

UP, RADIUS = np.array([0.0, 0.0, 1.0]), 2e-3
FLAT, BULL = FlatEnd(RADIUS), BullNose(RADIUS, 5e-4)


def pocket():
    """A block of 20 × 16 × 8 mm with a pocket of 12 × 8 × 4 mm that is open above."""

    def height(x, y):
        return np.where(within(x, -6, 6) & within(y, -4, 4), 4.0, 8.0)

    return terraces([-10, -6, 6, 10], [-8, -4, 4, 8], height)


def part(shape, turn=None):
    vertices, faces = shape
    return Mesh.of(1e-3 * vertices @ (np.eye(3) if turn is None else turn.T), faces)


def raster(mesh, tool, axis, up=UP):
    options = RasterOptions(stepover=1.8e-3, region=Region(direction=tuple(up), angle=0.5 * np.pi))
    return make_toolpath(mesh, tool, options, axis)


def cuts(toolpath):
    return np.concatenate([s.tips for s in toolpath.segments if s.kind is SegmentKind.CUT])


@pytest.mark.parametrize("tool", [FLAT, BULL], ids=["flat", "bull"])
def test_lowered_end_rests_where_another_library_lets_it_rest(tool):
    ball = trimesh.creation.icosphere(subdivisions=2, radius=5.0)
    places = np.random.default_rng(3).uniform(-6.5e-3, 6.5e-3, (400, 2))
    mesh = part((ball.vertices, ball.faces))
    heights, _ = Lowered(FacetTree.of(mesh), tool.corner, tool.radius - tool.corner).heights(places)
    expected = rest_heights(mesh, places, tool.radius, tool.corner)
    assert (np.isfinite(heights) == np.isfinite(expected)).all()
    met = np.isfinite(expected)
    assert np.abs(heights[met] - expected[met]).max() < 1e-7


@pytest.mark.parametrize("tool", [FLAT, pytest.param(BULL, marks=pytest.mark.slow)], ids=["flat", "bull"])
def test_end_goes_into_a_pocket_as_far_as_its_shape_allows_and_cuts_into_nothing(tool):
    mesh = part(pocket())
    path = raster(mesh, tool, UP)
    tips = cuts(path)
    floor = tips[np.abs(tips[:, 2] - 4e-3) < 1e-6]
    inside = floor[(np.abs(floor[:, 0]) < 6e-3) & (np.abs(floor[:, 1]) < 4e-3)]
    assert np.abs(np.abs(inside).max(axis=0)[:2] - [4e-3, 2e-3]).max() < 2e-5
    assert gouges(mesh, tool, path, 1.1e-5) == 0
    assert (path.segments[0].axes == UP).all()


def test_flat_end_stays_down_where_contacts_on_the_facets_are_dropped():
    mesh = part(pocket())
    rolled, drawn = (len([s for s in raster(mesh, FLAT, axis).segments if s.kind is SegmentKind.RAPID])
                     for axis in (UP, None))  # fmt: skip
    assert rolled < drawn


def test_tip_surface_turns_with_part_and_axis():
    turn = trimesh.transformations.rotation_matrix(0.5 * np.pi, [1.0, 0.0, 0.0])[:3, :3]
    mesh, axis = part(pocket(), turn), turn @ UP
    tips = cuts(raster(mesh, FLAT, axis, axis)) @ turn
    inside = tips[(np.abs(tips[:, 0]) < 6e-3) & (np.abs(tips[:, 1]) < 4e-3)]
    assert abs(inside[:, 2].min() - 4e-3) < 1e-6
    assert np.abs(np.abs(inside[inside[:, 2] < 4.001e-3]).max(axis=0)[:2] - [4e-3, 2e-3]).max() < 2e-5


@pytest.mark.parametrize("tool", [FLAT, pytest.param(BULL, marks=pytest.mark.slow)], ids=["flat", "bull"])
def test_end_on_an_open_cap_keeps_within_its_border(tool):
    """At the border, rounded outwards, a lowered cutter meets nothing."""
    angle, turn = np.meshgrid(np.radians(np.linspace(0.0, 55.0, 12)), np.linspace(0.0, 2.0 * np.pi, 49))
    x, y = 18.0 * np.sin(angle) * np.cos(turn), 18.0 * np.sin(angle) * np.sin(turn)
    k = np.arange(angle.size).reshape(angle.shape)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
    mesh = part((np.stack([x, y, 18.0 * np.cos(angle)], axis=-1).reshape(-1, 3), faces))
    path = raster(mesh, tool, UP)
    away = np.hypot(*cuts(path)[:, :2].T)
    rim = 18e-3 * np.sin(np.radians(55.0))
    assert rim < away.max() < rim + tool.radius + 1e-6  # the last pass has the cutter's middle beyond the rim
    assert gouges(mesh, tool, path, 1.1e-5) == 0


@pytest.mark.parametrize("tool", [FLAT, BULL], ids=["flat", "bull"])
def test_a_wall_that_leans_to_the_axis_is_machined_down_to_its_foot(tool):
    """The lowest pass was half a stepover above where the region ended, and that was up to a facet above the foot."""
    mesh, lean = Mesh.of(*box(20.0, 16.0, 8.0)), np.radians(7.0)
    axis = np.array([np.sin(lean), 0.0, np.cos(lean)])
    surface = TipSurface.of(mesh, tool, axis, UP, 0.9e-3)
    patch = surface.patch(Region(angle=0.5 * np.pi))
    edges = patch.topology.edges
    feet = patch.vertices[edges[surface.feet(patch)]].mean(axis=1)
    beside = (feet[:, 0] > 0.01) & (np.abs(feet[:, 1]) < 0.007)
    # The tip is beside the wall, as high along the axis as the foot of the wall, less what the corner is above the tip.
    height = 0.01 * axis[0] - tool.corner * (1.0 - np.sin(lean))
    assert beside.sum() > 10
    assert np.abs(feet[beside] @ axis - height).max() < 3e-5
    along = np.ptp(feet[beside, 1])
    assert along > 0.012


def box(x, y, z):
    """A solid box on z = 0 about the z axis, mm."""
    shape = trimesh.creation.box(bounds=1e-3 * np.array([(-x / 2, -y / 2, 0.0), (x / 2, y / 2, z)]))
    return np.asarray(shape.vertices), np.asarray(shape.faces)
