"""Raster toolpaths: on the surface, over all of the region, continuous, clear of the part, the same every time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import toolpath_surfaces as surfaces
from lengths import examples
from pentapod.base.errors import ToolpathError
from pentapod.geometry import RigidTransform, angle_between
from pentapod.toolpath import (
    STRATEGIES,
    BallCutter,
    BullNose,
    CrossHatchOptions,
    FlatEnd,
    HeightField,
    Mesh,
    PathOptions,
    RasterOptions,
    Region,
    SegmentKind,
    StandOff,
    load_mesh,
    make_toolpath,
    stepover_for,
    toolpath_with_report,
    write_stl,
)
from pentapod.toolpath.strategies.registry import strategy_of

BALL, TOOL = BallCutter(3e-3), FlatEnd(3e-3)
UPPER = Region(angle=np.radians(60.0))
slow = pytest.mark.slow


def waves(x, y):
    return 0.004 * np.sin(70 * x) * np.cos(50 * y)


def of_kind(toolpath, kind):
    chosen = [s for s in toolpath.segments if s.kind is kind]
    return np.concatenate([s.tips for s in chosen]), np.concatenate([s.axes for s in chosen])


def toolpath_axes(toolpath):
    return of_kind(toolpath, SegmentKind.RAPID)[1]


def check_laws(mesh, toolpath, options):
    """What holds for every raster on the part itself: returns the cutting contacts and axes."""
    cuts, axes = of_kind(toolpath, SegmentKind.CUT)
    assert surfaces.surface_distance(mesh, cuts).max() < 1e-9
    view = np.asarray(options.view)
    assert (axes @ view > 0).all()
    rapids, _ = of_kind(toolpath, SegmentKind.RAPID)
    top = (mesh.vertices @ view).max()
    first_and_last = [toolpath.segments[0].tips[0], toolpath.segments[-1].tips[-1]]
    assert (np.stack(first_and_last) @ view >= top + options.clearance - 1e-9).all()
    # Between passes a rapid may hop, but the ball stays off the surface.
    assert surfaces.surface_distance(mesh, rapids + 3e-3 * toolpath_axes(toolpath)).min() >= 3e-3
    field = HeightField(mesh, view)
    assert (rapids @ view > field.topmost(rapids)[2]).all()
    steps = np.linalg.norm(np.diff(toolpath.tips, axis=0), axis=1)
    assert steps.min() > 1e-7
    assert steps.max() <= max(5e-3, 3 * options.spacing) + 1e-9
    assert np.degrees(angle_between(toolpath.axes[1:], toolpath.axes[:-1])).max() < 10.0
    first, last = toolpath.segments[0], toolpath.segments[-1]
    assert first.kind is last.kind is SegmentKind.RAPID
    for segment in toolpath.segments:
        expected = {"cut": options.feed, "link": options.link_feed, "rapid": np.inf}[segment.kind]
        assert segment.feed == expected
    return cuts, axes


@pytest.mark.parametrize(
    ("pattern", "direction"),
    [
        ("zigzag", 0.7),
        *(
            pytest.param(pattern, direction, marks=slow)
            for pattern in ("zigzag", "one-way")
            for direction in (0.0, 0.7, np.pi / 2)
            if (pattern, direction) != ("zigzag", 0.7)
        ),
    ],
)
def test_raster_covers_waves_on_the_surface(pattern, direction):
    mesh = Mesh.of(*surfaces.grid(waves))
    options = RasterOptions(stepover=2e-3, direction=direction, pattern=pattern)
    toolpath, report = toolpath_with_report(mesh, TOOL, options)
    cuts, axes = check_laws(mesh, toolpath, options)
    # Every point of the surface lies within half a stepover (seen from above) of a pass.
    distance, _ = cKDTree(cuts[:, :2]).query(mesh.vertices[:, :2])
    assert distance.max() <= np.hypot(1.05e-3, 1.05e-3)
    assert report.passes == len([s for s in toolpath.segments if s.kind is SegmentKind.CUT])
    assert report.waypoints == len(toolpath)
    assert report.hidden == 0
    assert report.stay_downs + report.hops + report.retracts == report.passes
    assert (report.stay_downs < 5) == (pattern == "one-way")  # a few in the corners
    x, y = cuts[:, 0], cuts[:, 1]
    exact = np.stack([-0.28 * np.cos(70 * x) * np.cos(50 * y), 0.2 * np.sin(70 * x) * np.sin(50 * y), 1 + 0 * x], 1)
    assert np.degrees(angle_between(axes, exact)).max() < 2.0  # at the border normals are one-sided
    inside = np.abs(cuts[:, :2]).max(axis=1) < 0.045
    assert np.degrees(angle_between(axes, exact))[inside].max() < 0.6


def test_one_way_passes_all_run_one_way_and_zigzag_alternates():
    mesh = Mesh.of(*surfaces.grid(waves))
    for pattern, expected in (("one-way", {1.0}), ("zigzag", {1.0, -1.0})):
        toolpath = make_toolpath(mesh, TOOL, RasterOptions(stepover=5e-3, pattern=pattern))
        ways = [np.sign(s.tips[-1, 0] - s.tips[0, 0]) for s in toolpath.segments if s.kind is SegmentKind.CUT]
        assert set(ways) == expected
        assert pattern == "one-way" or np.all(np.diff(ways) != 0)


@slow
def test_stay_down_links_are_on_the_surface():
    mesh = Mesh.of(*surfaces.grid(waves))
    toolpath, report = toolpath_with_report(mesh, TOOL, RasterOptions(stepover=2e-3))
    assert report.retracts == 1
    kinds = [s.kind for s in toolpath.segments]
    inner = [s for a, s, b in zip(kinds, toolpath.segments[1:], kinds[2:], strict=False) if a == b == "cut"]
    assert len(inner) == report.stay_downs
    assert surfaces.surface_distance(mesh, np.concatenate([s.tips for s in inner])).max() < 1e-6


def test_raster_of_a_closed_ball_cuts_its_upper_side_only():
    mesh = Mesh.of(*surfaces.sphere())
    options = RasterOptions(stepover=2e-3, region=UPPER)
    cuts, axes = check_laws(mesh, make_toolpath(mesh, TOOL, options), options)
    assert np.degrees(np.arccos(axes[:, 2])).max() <= 60.0 + 1e-9
    assert np.degrees(angle_between(axes, cuts)).max() < 0.3
    assert cuts[:, 2].min() == pytest.approx(0.025, abs=2e-4)
    cap = mesh.vertices[mesh.vertices[:, 2] > 0.0265]
    assert cKDTree(cuts).query(cap)[0].max() < 3e-3


def test_region_may_face_any_direction():
    mesh = Mesh.of(*surfaces.sphere())
    for direction in ((1, 0, 0), (0, -1, 0), (0, 0, -1), (1, 2, -2)):
        region = Region(direction=direction, angle=np.radians(40.0))
        options = RasterOptions(stepover=8e-3, region=region)
        _, axes = check_laws(mesh, make_toolpath(mesh, TOOL, options), options)
        assert np.degrees(angle_between(axes, region.direction)).max() <= 40.0 + 1e-9


def test_torus_upper_side_against_the_formula():
    mesh = Mesh.of(*surfaces.torus())
    options = RasterOptions(stepover=4e-3, region=UPPER)
    cuts, axes = check_laws(mesh, make_toolpath(mesh, TOOL, options), options)
    ring = np.hypot(cuts[:, 0], cuts[:, 1])
    assert np.abs(np.hypot(ring - 0.04, cuts[:, 2]) - 0.015).max() < 2e-5
    exact = np.stack([cuts[:, 0] / ring * (ring - 0.04), cuts[:, 1] / ring * (ring - 0.04), cuts[:, 2]], 1)
    assert np.degrees(angle_between(axes, exact)).max() < 0.3
    assert cuts[:, 2].min() > 0.007


def test_raster_leaves_a_hole_out_and_finishes_each_side_in_one_go():
    vertices, faces = surfaces.grid(waves, cells=100)
    centres = vertices[faces].mean(axis=1)
    mesh = Mesh.of(vertices, faces[np.hypot(centres[:, 0], centres[:, 1]) > 0.02])
    options = RasterOptions(stepover=2e-3)
    toolpath, report = toolpath_with_report(mesh, TOOL, options)
    cuts, _ = check_laws(mesh, toolpath, options)
    assert np.hypot(cuts[:, 0], cuts[:, 1]).min() > 0.0185
    assert report.passes > 50
    assert report.retracts <= 4


def test_a_box_bounds_the_region():
    mesh = Mesh.of(*surfaces.grid(waves))
    region = Region(box=((0.03, -0.02, -1), (-0.01, 0.01, 1)))
    options = RasterOptions(stepover=2e-3, region=region)
    toolpath, report = toolpath_with_report(mesh, TOOL, options)
    cuts, _ = check_laws(mesh, toolpath, options)
    np.testing.assert_allclose(cuts[:, 0].min(), -0.01, atol=1e-9)
    np.testing.assert_allclose(cuts[:, 0].max(), 0.03, atol=1e-9)
    # Half a step inside the box; a little more than 30 / 2 mm, for the waves are steep across the passes.
    assert report.passes == 16
    assert -0.02 < cuts[:, 1].min() <= -0.019
    assert 0.009 <= cuts[:, 1].max() < 0.01


def test_waypoints_that_the_part_hides_are_left_out():
    vertices, faces = surfaces.grid(lambda x, y: 0 * x, cells=40)
    table = vertices * [0.4, 0.4, 1.0] + [0.0, 0.0, 0.03]
    mesh = Mesh.of(np.concatenate([vertices, table]), np.concatenate([faces, faces + len(vertices)]))
    toolpath, report = toolpath_with_report(mesh, TOOL, RasterOptions(stepover=2e-3))
    cuts, _ = of_kind(toolpath, SegmentKind.CUT)
    low = cuts[cuts[:, 2] < 0.01]
    assert report.hidden > 0
    assert np.abs(low[:, :2]).max(axis=1).min() >= 0.02 - 1e-9
    assert (np.abs(cuts[cuts[:, 2] > 0.02]).max(axis=0)[:2] <= 0.02 + 1e-9).all()


def test_stand_off_keeps_its_distance_and_tilt_centres_on_the_surface():
    mesh = Mesh.of(*surfaces.grid(waves))
    options = RasterOptions(stepover=2e-3)
    toolpath = make_toolpath(mesh, StandOff(5e-3), options)
    assert toolpath.tilt_centre == -5e-3
    tips, axes = of_kind(toolpath, SegmentKind.CUT)
    assert surfaces.surface_distance(mesh, tips - 5e-3 * axes).max() < 1e-6
    np.testing.assert_allclose(surfaces.surface_distance(mesh, tips), 5e-3, rtol=5e-3)


@slow
def test_tilt_centres_of_a_ball_are_its_centres():
    toolpath = make_toolpath(Mesh.of(*surfaces.sphere()), BALL, RasterOptions(stepover=1e-2, region=UPPER))
    assert toolpath.tilt_centre == 3e-3
    cuts = np.concatenate([[s.kind is SegmentKind.CUT] * (len(s.tips) - 1) for s in toolpath.segments])
    centres = toolpath.tilt_centres[1:][cuts]
    np.testing.assert_allclose(np.linalg.norm(centres, axis=1), 0.053, atol=7e-5)  # facets sag by 60 um


def test_ball_tip_at_a_tilted_axis():
    normal, axis = np.array([[0, 0, 1.0]]), np.array([[0.6, 0, 0.8]])
    tip = BALL.tips(np.zeros((1, 3)), normal, axis)
    np.testing.assert_allclose(tip + 3e-3 * axis, [[0, 0, 3e-3]], atol=1e-15)


@pytest.mark.parametrize("tool", [BallCutter(3e-3), BullNose(4e-3, 3e-3)], ids=["ball", "bull-nose"])
@pytest.mark.parametrize("slope_deg", [0.0, 30.0, pytest.param(50.0, marks=slow)])
def test_scallops_on_a_slope_are_as_high_as_asked_for(slope_deg, tool):
    """Ridge between two balls on an inclined plane, found by brute force across the passes."""
    slope, radius, scallop = np.radians(slope_deg), 3e-3, 2e-5
    mesh = Mesh.of(*surfaces.grid(lambda x, y: np.tan(slope) * y, cells=4))
    toolpath, report = toolpath_with_report(mesh, tool, RasterOptions(scallop=scallop, fill=False))
    # Around the border, where a ball's centre turns, the stepover may be up to twice as large.
    assert 0.998 <= report.stepover / stepover_for(scallop, radius) <= (2.0 if tool.tilt_centre else 1.002)
    heights = sorted({round(float(s.tips[0, 1]), 12) for s in toolpath.segments if s.kind is SegmentKind.CUT})
    y0, y1 = heights[3:5]
    normal = np.array([-np.sin(slope), np.cos(slope)])
    centres = [np.array([y, np.tan(slope) * y]) + radius * normal for y in (y0, y1)]
    y = np.linspace(y0, y1, 2001)
    surface = np.stack([y, np.tan(slope) * y], 1)
    up = np.linspace(0, 5 * scallop, 2001)
    middle = surface[1000] + up[:, None] * normal
    free = np.min([np.linalg.norm(middle - c, axis=1) for c in centres], axis=0) >= radius
    ridge = up[free].max() if not free.all() else 0.0
    left = up[~free].min() if (~free).any() else np.inf
    assert min(left, ridge) == pytest.approx(scallop, rel=0.1)


def test_concave_radii_below_the_stand_off_are_reported():
    hollow = Mesh.of(*surfaces.grid(lambda x, y: 300 * 0.5 * x**2, width=0.01))  # radius 3.3 mm at the bottom
    for distance, expected in ((3e-3, False), (5e-3, True)):
        report = toolpath_with_report(hollow, StandOff(distance), RasterOptions(stepover=1e-3))[1]
        assert (report.tight > 0) == expected
        assert ("concave radius" in str(report)) == expected


def test_short_passes_are_dropped_and_reported():
    vertices, faces = surfaces.grid(lambda x, y: 0 * x, cells=20)
    island = vertices[faces[:2]] * 0.01 + [0.0, 0.06, 0.0]
    loose = np.concatenate([vertices[faces], island]).reshape(-1, 3)
    mesh = Mesh.of(loose, np.arange(len(loose)).reshape(-1, 3))
    report = toolpath_with_report(mesh, TOOL, RasterOptions(stepover=5e-5, spacing=0.05, shortest=1e-4, fill=False))[1]
    assert report.dropped > 0
    assert 0 < report.dropped_length < 1e-4 * report.dropped
    assert "short passes dropped" in str(report)


def test_passes_of_a_narrow_strip_count_where_their_stepover_is_small():
    """A strip of 0.3 mm across the passes was left out as a whole."""
    strip = Mesh.of(*surfaces.grid(lambda x, y: 0 * x, cells=20, width=0.3e-3))
    report = toolpath_with_report(strip, BallCutter(0.2e-3), RasterOptions(stepover=0.1e-3))[1]
    assert report.dropped == 0
    with pytest.raises(ToolpathError, match=r"shorter than 0\.5 mm"):
        toolpath_with_report(strip, BallCutter(0.2e-3), RasterOptions(stepover=0.1e-3, shortest=0.5e-3))


@settings(max_examples=examples(2, 4), deadline=None)
@given(angle=st.floats(-3.0, 3.0), scale=st.floats(0.3, 3.0))
def test_turning_and_scaling_the_part_turns_and_scales_the_path(angle, scale):
    vertices, faces = surfaces.grid(waves, cells=40)
    turn = Rotation.from_euler("z", angle).as_matrix()
    lengths = {"stepover": 3e-3, "spacing": 2e-3, "chordal": 1e-5, "closest": 1e-5, "shortest": 1e-3}
    plain = toolpath_with_report(Mesh.of(vertices, faces), TOOL, RasterOptions(**lengths))[1]
    moved = Mesh.of(scale * vertices @ turn.T, faces)
    options = RasterOptions(**{k: scale * v for k, v in lengths.items()}, direction=angle)
    toolpath, report = toolpath_with_report(moved, TOOL, options)
    assert report.passes == plain.passes
    assert report.cut_length == pytest.approx(scale * plain.cut_length, rel=1e-6)
    assert report.stepover == pytest.approx(scale * plain.stepover, rel=1e-6)
    check_laws(moved, toolpath, options)


@settings(max_examples=examples(2, 4), deadline=None)
@given(seed=st.integers(0, 10_000))
def test_turning_part_and_view_together_keeps_the_laws(seed):
    vertices, faces = surfaces.torus(sections=(60, 30))
    turn = Rotation.random(random_state=seed)
    mesh = Mesh.of(vertices, faces).transformed(RigidTransform(turn.as_matrix(), np.array([0.1, -0.2, 0.3])))
    region = Region(direction=turn.apply([0, 0, 1]), angle=np.radians(50.0))
    options = RasterOptions(stepover=3e-3, region=region)
    check_laws(mesh, make_toolpath(mesh, TOOL, options), options)


def test_the_same_input_gives_the_same_bytes():
    def made():
        mesh = Mesh.of(*surfaces.torus(sections=(60, 30)))
        toolpath = make_toolpath(mesh, TOOL, RasterOptions(stepover=4e-3, region=UPPER))
        return [(s.kind, s.tips.tobytes(), s.axes.tobytes(), s.feed) for s in toolpath.segments]

    assert made() == made()


def test_strategies_are_found_by_name():
    mesh = Mesh.of(*surfaces.grid(waves))
    options = RasterOptions(stepover=4e-3)
    strategy = STRATEGIES["raster"]
    assert strategy_of(options) is strategy
    toolpath, report = toolpath_with_report(mesh, TOOL, options)
    assert (report.strategy, report.waypoints) == ("raster", len(toolpath))
    with pytest.raises(ToolpathError, match="no strategy takes these options"):
        make_toolpath(mesh, TOOL, PathOptions())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stepover": -1e-3}, "stepover: must be positive"),
        ({"stepover": None}, "stepover or scallop"),
        ({"scallop": 1e-5}, "stepover or scallop"),
        ({"feed": 0.0}, "feed: must be positive"),
        ({"chordal": float("nan")}, "chordal: must be positive"),
        ({"pattern": "spiral"}, "zigzag or one-way or uphill"),
        ({"entry": "side"}, "axis or straight or arc"),
        ({"hop": -1.0}, "hop: must not be negative"),
        ({"view": (0.0, 0.0, 0.0)}, "no length"),
        ({"direction": float("inf")}, "finite"),
        ({"shortest": -1.0}, "shortest"),
    ],
)
def test_options_that_make_no_sense(change, message):
    with pytest.raises(ToolpathError, match=message):
        RasterOptions(**{"stepover": 1e-3, **change})


def test_regions_and_tools_that_make_no_sense():
    for wrong in ({"direction": (0, 0, 0)}, {"angle": 0.0}, {"angle": 3.2}, {"box": ((0, 0, 0), (1, 0, 1))}):
        with pytest.raises(ToolpathError, match="region"):
            Region(**wrong)
    with pytest.raises(ToolpathError, match="radius"):
        BallCutter(0.0)
    with pytest.raises(ToolpathError, match="distance"):
        StandOff(-1e-3)


def test_errors_of_regions_and_steps_that_cannot_be_machined():
    mesh = Mesh.of(*surfaces.grid(waves, cells=20))
    with pytest.raises(ToolpathError, match=r"100 % of the surface faces away"):
        make_toolpath(mesh, TOOL, RasterOptions(stepover=1e-3, region=Region(direction=(0, 0, -1))))
    make_toolpath(mesh.flipped(), TOOL, RasterOptions(stepover=5e-3, region=Region(direction=(0, 0, -1))))
    with pytest.raises(ToolpathError, match="which spans"):
        make_toolpath(mesh, TOOL, RasterOptions(stepover=1e-3, region=Region(box=((1, 1, 1), (2, 2, 2)))))
    with pytest.raises(ToolpathError, match="too dense"):
        make_toolpath(mesh, TOOL, RasterOptions(stepover=1e-9))
    with pytest.raises(ToolpathError, match="leaves no scallop"):
        make_toolpath(mesh, StandOff(1e-3), RasterOptions(scallop=1e-5))
    with pytest.raises(ToolpathError, match="lower than the ball"):
        make_toolpath(mesh, BALL, RasterOptions(scallop=3e-3))
    with pytest.raises(ToolpathError, match="shorter than"):
        make_toolpath(mesh, TOOL, RasterOptions(stepover=1e-2, shortest=1.0))


@slow
def test_a_million_facets(tmp_path):
    vertices, faces = surfaces.grid(waves, cells=708)
    path = tmp_path / "million.stl"
    path.write_bytes(write_stl(1e3 * vertices[faces], "a million facets"))
    mesh = load_mesh(path, "mm")
    assert len(mesh.faces) == 2 * 708**2
    toolpath, report = toolpath_with_report(mesh, TOOL, RasterOptions(stepover=5e-4))
    # A hundred millimetres by half a millimetre, a little less on slopes, and lines for what is left at the border.
    assert 200 <= report.passes <= 215
    assert report.retracts == 1
    lines = [s for s in toolpath.segments if s.kind is SegmentKind.CUT]
    points, normals = surfaces.random_points(mesh, 20_000, Region())
    distance = surfaces.distance_to_lines(points, normals, [s.tips for s in lines], [s.axes for s in lines], 2e-5)
    assert (distance <= 1.05 * 0.5 * 5e-4).mean() >= 0.999
    cuts, _ = of_kind(toolpath, SegmentKind.CUT)
    assert np.abs(cuts[:, 2] - waves(cuts[:, 0], cuts[:, 1])).max() < 1e-6


@pytest.mark.parametrize(
    ("kind", "tool"),
    [
        pytest.param(RasterOptions, TOOL, id="raster-flat"),
        pytest.param(RasterOptions, BALL, id="raster-ball", marks=slow),
        pytest.param(CrossHatchOptions, TOOL, id="cross-hatch-flat", marks=slow),
        pytest.param(CrossHatchOptions, BALL, id="cross-hatch-ball", marks=slow),
    ],
)
def test_steep_areas_get_waterlines_in_place_of_passes(kind, tool):
    """A ridge along the passes, with flanks of 75° and a flat top, over a floor."""
    mesh = Mesh.of(*surfaces.grid(lambda x, y: np.clip(0.05 - 3.7 * np.abs(y), 0.0, 0.02) + 0.0 * x, 0.04, 74))
    options = kind(stepover=2e-3, region=Region(angle=np.radians(89.0)), steep=np.radians(60.0))
    toolpath, report = toolpath_with_report(mesh, tool, options)
    cuts = [s.tips + tool.tilt_centre * s.axes for s in toolpath.segments if s.kind is SegmentKind.CUT]
    slopes = [s.axes @ options.up for s in toolpath.segments if s.kind is SegmentKind.CUT]
    steep = [line for line, slope in zip(cuts, slopes, strict=True) if slope.max() < np.cos(np.radians(65.0))]
    assert any("steeper than 60 deg" in note for note in report.notes)
    assert len(steep) >= 2 * 8
    assert max(np.ptp(line[:, 2]) for line in steep) < 1e-4
    # No pass crosses the flanks: on them all motion is level.
    for line, slope in zip(cuts, slopes, strict=True):
        flank = slope < np.cos(np.radians(74.0))
        assert np.abs(np.diff(line[:, 2])[flank[1:] & flank[:-1]]).max(initial=0.0) < 1e-4
    without = make_toolpath(mesh, tool, replace(options, steep=None))
    assert len(without.segments) != len(toolpath.segments)


def test_narrow_steep_areas_go_with_what_is_around_them():
    step = Mesh.of(*surfaces.grid(lambda x, y: 0.001 * (y > 0.0) + 0.0 * x, 0.02, 40))
    options = RasterOptions(stepover=2e-3, region=Region(angle=np.radians(89.0)), steep=np.radians(60.0))
    assert toolpath_with_report(step, TOOL, options)[1].notes == ()
