"""Gouges are found in every cut, and removed as asked: tilted, lifted, dropped, reported."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import toolpath_surfaces as surfaces
from pentapod.base.errors import ToolpathError
from pentapod.cutters.ball import BallCutter
from pentapod.cutters.flat_end import FlatEnd
from pentapod.geometry import angle_between
from pentapod.geometry.solids import Cone
from pentapod.mesh.query.swept_depth import sweep
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath import (
    GougeOptions,
    LinkStyle,
    Mesh,
    Remedy,
    Segment,
    SegmentKind,
    Toolpath,
    without_gouges,
)

WALL_X = 0.01


def plane_with_wall():
    """A floor z = 0 from x = −50 to 10 mm, and a wall 40 mm high at its end."""
    floor = np.array([[-0.05, -0.05, 0], [WALL_X, -0.05, 0], [WALL_X, 0.05, 0], [-0.05, 0.05, 0]])
    wall = np.array([[WALL_X, -0.05, 0], [WALL_X, -0.05, 0.04], [WALL_X, 0.05, 0.04], [WALL_X, 0.05, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return Mesh.of(np.concatenate([floor, wall]), np.concatenate([faces, faces + 4]))


def along_floor(end, count=31):
    """A rapid down, a cut along the floor towards the wall, a link up."""
    x = np.linspace(-0.02, end, count)
    cut = np.stack([x, 0 * x, 0 * x], 1)
    up = np.tile([0.0, 0.0, 1.0], (count, 1))
    down, away = cut[0] + 0.02 * np.array([[0, 0, 1], [0, 0, 0]]), cut[-1] + 0.02 * np.array([[0, 0, 0], [0, 0, 1]])
    return Toolpath((
        Segment(SegmentKind.RAPID, down, up[:2], np.inf),
        Segment(SegmentKind.CUT, cut, up, 0.02),
        Segment(SegmentKind.LINK, away, up[:2], 0.05),
    ), 3e-3)  # fmt: skip


BALL = BallCutter(3e-3, flute=8e-3, shank=(Cone(0.012, 2.5e-3, 2.5e-3),), holder=(Cone(0.03, 8e-3, 8e-3),))


def cut_depth(path, tool, mesh):
    tree = FacetTree.of(mesh)
    return max(
        sweep(tree, tool, s.tips, s.axes, threshold=1e-6).deepest.max()
        for s in path.segments
        if s.kind is SegmentKind.CUT
    )


def test_clear_path_is_returned_itself():
    path = along_floor(1e-3)
    found, report = without_gouges(path, BALL, plane_with_wall(), GougeOptions())
    assert found is path
    assert (report.motions, report.gouging) == (30, 0)
    assert "no gouge" in str(report)


def test_depths_of_cutter_shank_and_holder():
    # At x = 8.5 mm the wall is 1.5 mm from the axis: ball and flute 1.5 mm deep, shank 1 mm, holder 6.5 mm.
    _, report = without_gouges(along_floor(8.5e-3), BALL, plane_with_wall(), GougeOptions())
    np.testing.assert_allclose(report.depths, [1.5e-3, 1e-3, 6.5e-3], rtol=0.011)
    assert report.left == report.gouging > 5
    assert re.search(r"cutter 1\.\d+ mm, shank \S+ mm, holder 6\.\d+ mm deep", str(report))
    assert "problem" in str(report)


def test_tilt_clears_a_holder_about_the_balls_centre():
    path, mesh = along_floor(5e-3), plane_with_wall()
    options = GougeOptions((Remedy.TILT,), cone=np.radians(30))
    found, report = without_gouges(path, BALL, mesh, options)
    assert report.gouging > 0
    assert report.left == 0
    assert report.tilted > 0
    assert cut_depth(found, BALL, mesh) <= options.tolerance
    np.testing.assert_allclose(found.tilt_centres, path.tilt_centres, atol=1e-15)
    turned = angle_between(found.axes, path.axes)
    assert turned.max() <= options.cone * (1 + 1e-9)
    assert (turned == 0).any()
    # It fades in: no step between neighbours is as large as the whole.
    assert angle_between(found.axes[1:], found.axes[:-1]).max() < 0.6 * turned.max()


def test_lift_raises_gouging_waypoints_only():
    """A flat end pressed 0.3 mm into the floor over part of its way."""
    path, mesh, tool = along_floor(1e-3), plane_with_wall(), FlatEnd(3e-3, flute=0.02)
    tips = path.segments[1].tips.copy()
    tips[10:20, 2] -= 0.3e-3
    sunk = Toolpath((path.segments[0], Segment(SegmentKind.CUT, tips, path.segments[1].axes, 0.02), path.segments[2]))
    found, report = without_gouges(sunk, tool, mesh, GougeOptions((Remedy.LIFT,)))
    assert report.gouging == 11
    assert report.left == 0
    assert 10 <= report.lifted <= 12
    assert 0.28e-3 < report.most_lifted < 0.5e-3
    assert cut_depth(found, tool, mesh) <= 20e-6
    np.testing.assert_array_equal(found.tips[:10], sunk.tips[:10])


def test_drop_after_lift_keeps_the_path_continuous():
    path, mesh = along_floor(9.5e-3), plane_with_wall()
    options = GougeOptions((Remedy.LIFT, Remedy.DROP), highest=5e-3)
    found, report = without_gouges(path, BALL, mesh, options)
    assert report.left == 0
    assert report.dropped > 0
    assert "material is left" in str(report)
    assert cut_depth(found, BALL, mesh) <= options.tolerance
    cut = sum(len(s.tips) - 1 for s in found.segments if s.kind is SegmentKind.CUT)
    assert cut == 30 - report.dropped
    # The places of the part that the ball is nearest to: below it on the floor, then beside it on the wall.
    below = path.segments[1].tips
    beside = (WALL_X - below[:, :1] < 3e-3) * [1.0, 1.0, 1.0]
    places = np.where(beside > 0.0, [WALL_X, 0.0, 3e-3], below)
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert report.dropped_share == pytest.approx(lengths[-report.dropped :].sum() / lengths.sum())
    # The wall is higher than the lift: the link over the dropped cut collides too, and that is reported.
    assert report.unclear > 0
    assert "collide with the part" in str(report)


@pytest.mark.parametrize("bad", [slice(14, 16), slice(10, 20)])
def test_link_over_a_dropped_cut_is_clear(bad):
    """A flat end pressed 3 mm into the floor: one waypoint, or ten; the cuts on either side stay as they are."""
    path, mesh, tool = along_floor(1e-3), plane_with_wall(), FlatEnd(3e-3, flute=0.02)
    tips = path.segments[1].tips.copy()
    tips[bad, 2] -= 3e-3
    sunk = Toolpath((path.segments[0], replace(path.segments[1], tips=tips), path.segments[2]))
    found, report = without_gouges(sunk, tool, mesh, GougeOptions((Remedy.DROP,)))
    assert report.dropped == bad.stop - bad.start + 1
    assert (report.left, report.unclear) == (0, 0)
    cuts = [s for s in found.segments if s.kind is SegmentKind.CUT]
    links = [s for s in found.segments if s.kind is SegmentKind.LINK]
    np.testing.assert_array_equal(cuts[0].tips[-1], tips[bad.start - 1])
    np.testing.assert_array_equal(cuts[1].tips[0], tips[bad.stop])
    tree = FacetTree.of(mesh)
    assert max(sweep(tree, tool, s.tips, s.axes).deepest.max() for s in links) <= 20e-6


def test_links_and_rapids_that_collide_are_reported_or_relinked():
    path, mesh = along_floor(1e-3), plane_with_wall()
    down = path.segments[0].tips[0] - [0.0, 0.0, 0.1]
    up = path.segments[0].axes[:1].repeat(2, axis=0)
    dive = Segment(SegmentKind.RAPID, np.stack([down, path.segments[0].tips[0]]), up, np.inf)
    _, report = without_gouges(Toolpath((dive, *path.segments), path.tilt_centre), BALL, mesh, GougeOptions())
    assert report.unclear == 1
    assert report.unclear_places == (0,)
    assert "rapids collide with the part" in str(report)
    style = LinkStyle(np.array([0.0, 0.0, 1.0]), level=0.05, approach=3e-3, spacing=2e-3, feed=0.05)
    through = Toolpath((dive, *path.segments), path.tilt_centre)
    found, report = without_gouges(through, BALL, mesh, GougeOptions(links=style))
    assert (report.relinked, report.unclear) == (1, 0)
    assert [s.kind for s in found.segments] == ["rapid", "link", "cut", "link"]
    assert found.tips[0, 2] == pytest.approx(0.05)
    np.testing.assert_array_equal(found.segments[2].tips, path.segments[1].tips)
    above = found.segments[0]
    assert (sweep(FacetTree.of(mesh), BALL, above.tips, above.axes, threshold=-1e-3).deepest <= -1e-3).all()


@pytest.mark.parametrize("remedies", [(Remedy.TILT,), (Remedy.LIFT,), (Remedy.TILT, Remedy.LIFT, Remedy.DROP)])
def test_remedies_for_a_ball_in_a_groove_narrower_than_itself(remedies):
    """A gutter of 2.5 mm radius under a 3 mm ball: tilting cannot help, the others can."""
    mesh = Mesh.of(
        *surfaces.grid(
            lambda x, y: np.where(np.abs(x) < 2e-3, -np.sqrt(np.maximum(6.25e-6 - x**2, 0)) + 1.5e-3, 0.0),
            width=0.02,
            cells=160,
        )
    )
    y = np.linspace(-8e-3, 8e-3, 17)
    tips = np.stack([0 * y, y, 0 * y - 1e-3], 1)
    up = np.tile([0.0, 0.0, 1.0], (17, 1))
    tool = BallCutter(3e-3)
    path = Toolpath((Segment(SegmentKind.CUT, tips, up, 0.02),), 3e-3)
    found, report = without_gouges(path, tool, mesh, GougeOptions(remedies))
    assert report.gouging == 16
    if Remedy.LIFT in remedies:
        assert report.left == 0
        assert cut_depth(found, tool, mesh) <= 20e-6
        assert report.most_lifted < 1.2e-3
    else:
        assert report.left == 16


def test_gouge_options_out_of_range_are_refused():
    with pytest.raises(ToolpathError):
        GougeOptions(tolerance=0.0)
    with pytest.raises(ToolpathError):
        GougeOptions(cone=2.0)
