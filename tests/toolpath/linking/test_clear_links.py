"""Links that are clear for the final axes: ways out from under ledges, and cuts that nothing can leave."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import concave_parts
import toolpath_surfaces as surfaces
from pentapod.base.errors import ToolpathError
from pentapod.cutters.ball import BallCutter
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.flat_end import FlatEnd
from pentapod.geometry.solids import Cone
from pentapod.mesh.query.swept_depth import RESOLUTION_M, sweep
from pentapod.mesh.query.tree import FacetTree
from pentapod.mesh.region import Region
from pentapod.toolpath import (
    STRATEGIES,
    EdgeOptions,
    Fixed,
    GougeOptions,
    LinkStyle,
    Mesh,
    OffsetOptions,
    Orientation,
    PencilOptions,
    RasterOptions,
    Remedy,
    Segment,
    SegmentKind,
    SpiralOptions,
    TextOptions,
    Toolpath,
    WaterlineOptions,
    load_mesh,
    make_toolpath,
    oriented,
    stepped,
    without_gouges,
)
from pentapod.toolpath.strategies.cross_hatch import CrossHatchOptions

UP = np.array([0.0, 0.0, 1.0])
STYLE = LinkStyle(UP, level=0.06, approach=3e-3, spacing=2e-3, feed=0.05)
BALL, STEM = BallCutter(3e-3), BallCutter(3e-3).with_stem(0.06)


def boxes(*sizes):
    """A mesh of boxes: low and high corners, mm."""
    vertices, faces, count = [], [], 0
    for low, high in 1e-3 * np.array(sizes):
        corners, facets = surfaces.box(tuple(high - low))
        corners = corners - corners.min(axis=0) + low
        vertices.append(corners)
        faces.append(facets + count)
        count += len(corners)
    return Mesh.of(np.concatenate(vertices), np.concatenate(faces))


def cut_along(start, end, count=21):
    """A cut between two tips, mm, with a rapid down to it and one up from it, along z."""
    tips = 1e-3 * np.linspace(start, end, count)
    axes = np.tile(UP, (count, 1))
    down = np.stack([tips[0] + 0.06 * UP, tips[0]])
    up = np.stack([tips[-1], tips[-1] + 0.06 * UP])
    return Toolpath((
        Segment(SegmentKind.RAPID, down, axes[:2], np.inf),
        Segment(SegmentKind.CUT, tips, axes, 0.02),
        Segment(SegmentKind.RAPID, up, axes[:2], np.inf),
    ), 3e-3)  # fmt: skip


def deepest(path, tool, mesh, kind):
    tree = FacetTree.of(mesh)
    found = [sweep(tree, tool, s.tips, s.axes).deepest.max() for s in path.segments if s.kind is kind]
    return max(found, default=-np.inf)


def check(found, report, tool, mesh):
    assert report.unclear == 0
    assert deepest(found, tool, mesh, SegmentKind.LINK) <= 50e-6 + RESOLUTION_M
    assert deepest(found, tool, mesh, SegmentKind.RAPID) <= RESOLUTION_M


FLOOR = ((-40, -40, -10), (40, 40, 0))
LEDGE = ((-40, -40, 12), (0, 40, 20))


def test_a_ball_leaves_a_cut_under_a_ledge_sideways_or_back_on_the_cut():
    mesh = boxes(FLOOR, LEDGE)
    path = cut_along((-20, 0, 0), (20, 0, 0))
    found, report = without_gouges(path, BALL, mesh, GougeOptions((Remedy.DROP,), links=STYLE))
    check(found, report, BALL, mesh)
    assert (report.relinked, report.dropped, report.stuck) == (1, 0, 0)
    (cut,) = [s for s in found.segments if s.kind is SegmentKind.CUT]
    np.testing.assert_array_equal(cut.tips, path.segments[1].tips)
    assert found.segments[-1] is path.segments[-1]  # the link that is clear stays


def test_ways_out_to_places_that_differ_by_rounding_are_joined():
    """A rapid of no length, on which nothing turns, once asked for 10^15 points."""
    mesh = boxes(FLOOR, LEDGE)
    first, second = cut_along((20, 0, 0), (-20, 0, 0)), cut_along((np.nextafter(-20.0, 0.0), 0, 0), (20, 0, 0))
    both = Toolpath((*first.segments, *second.segments), 3e-3)
    found, report = without_gouges(both, BALL, mesh, GougeOptions((Remedy.DROP,), links=STYLE))
    check(found, report, BALL, mesh)
    assert report.relinked >= 1
    assert len(found) < 1000


def test_a_tool_along_a_wall_leaves_it_without_a_rapid_that_touches():
    mesh = boxes(FLOOR, ((2.98, -40, 0), (40, 40, 30)))  # the cut may be 50 µm deep, a rapid not at all
    path = cut_along((0, -20, 0), (0, 20, 0))
    found, report = without_gouges(path, STEM, mesh, GougeOptions((Remedy.DROP,), links=STYLE))
    check(found, report, STEM, mesh)
    assert report.relinked == 2
    assert report.stuck == 0


def test_a_ball_leaves_the_lower_rim_of_a_hole_upwards():
    """Below the plate it has more room, but no tool comes from there."""
    plate = trimesh.creation.annulus(r_min=4e-3, r_max=30e-3, height=5e-3, sections=96)
    plate.apply_translation([0.0, 0.0, 2.5e-3])
    mesh = Mesh.of(plate.vertices, plate.faces)
    turn = np.linspace(0.0, np.pi, 40)
    around = np.c_[np.cos(turn), np.sin(turn), np.zeros(40)]
    below = 0.5e-3
    centres = (4e-3 * np.cos(np.pi / 96) - np.sqrt(9e-6 - below**2) - 1e-6) * around - below * UP
    tips, axes = centres + 3e-3 * around, -around
    first, last = (np.stack([tips[k], tips[k] - 0.03 * around[k]]) for k in (0, -1))
    path = Toolpath((
        Segment(SegmentKind.RAPID, first[::-1], axes[[0, 0]], np.inf),
        Segment(SegmentKind.CUT, tips, axes, 0.02),
        Segment(SegmentKind.RAPID, last, axes[[-1, -1]], np.inf),
    ), 3e-3)  # fmt: skip
    found, report = without_gouges(path, BALL, mesh, GougeOptions((Remedy.DROP,), links=STYLE))
    check(found, report, BALL, mesh)
    assert (report.relinked, report.dropped, report.stuck) == (2, 0, 0)
    assert found.tilt_centres[:, 2].min() > -2.0 * below


@pytest.mark.slow
def test_a_cut_in_a_closed_chamber_is_dropped_and_told():
    walls = [((-40, -40, 0), (-30, 40, 20)), ((30, -40, 0), (40, 40, 20)), ((-30, -40, 0), (30, -30, 20))]
    walls += [((-30, 30, 0), (30, 40, 20)), ((-40, -40, 20), (40, 40, 30))]
    mesh = boxes(FLOOR, *walls)
    inside, above = cut_along((-20, 0, 0), (20, 0, 0)), cut_along((-20, 0, 30), (20, 0, 30))
    back = Segment(SegmentKind.RAPID, np.stack([inside.tips[-1], above.tips[0]]), np.tile(UP, (2, 1)), np.inf)
    both = Toolpath((*inside.segments, back, *above.segments), 3e-3)
    found, report = without_gouges(both, BALL, mesh, GougeOptions((Remedy.DROP,), links=STYLE))
    check(found, report, BALL, mesh)
    assert report.stuck == 20
    assert "cannot leave" in str(report)
    (cut,) = [s for s in found.segments if s.kind is SegmentKind.CUT]
    np.testing.assert_array_equal(cut.tips, above.segments[1].tips)
    kept, report = without_gouges(both, BALL, mesh, GougeOptions((Remedy.REPORT,), links=STYLE))
    assert report.unclear > 0  # nothing may be dropped: it is reported
    assert sum(s.kind is SegmentKind.CUT for s in kept.segments) == 2


SIZE = 0.05
PARTS = {
    "octagonal_pocket.stl": (0, 0, 1),
    "fandisk.obj": (0, 0, 1),
    "teapot.stl": (0, 0, 1),
    "facade_infill_open_mid_res.stl": (1, 0, 0),
    "torus.STL": (0, 0, 1),
    "busted.STL": (0, 0, 1),
}
WAYS = {
    "raster": lambda **more: RasterOptions(stepover=5e-3, **more),
    "cross-hatch": lambda **more: CrossHatchOptions(stepover=7e-3, **more),
    "waterline": lambda **more: WaterlineOptions(stepover=5e-3, **more),
    "offset": lambda **more: OffsetOptions(stepover=5e-3, **more),
    "spiral": lambda **more: SpiralOptions(stepover=5e-3, **more),
    "edges": EdgeOptions,
    "pencil": PencilOptions,
    "text": lambda **more: TextOptions(text="AB", height=0.02, **more),
}


def random_tool(rng):
    radius = rng.choice([1.5e-3, 3e-3])
    holder = (Cone(rng.uniform(5e-3, 0.03), radius, radius),), (Cone(0.02, 0.01, 0.012),)
    tools = (
        BallCutter(radius).with_stem(0.06),
        BallCutter(radius, shank=holder[0], holder=holder[1]),
        BullNose(2 * radius, radius).with_stem(0.06),
        FlatEnd(radius, flute=0.01, holder=holder[1]),
    )
    return tools[rng.integers(len(tools))]


def links_of_part(mesh, direction, seed):
    """Each strategy on a part, with random tools and fixed axes up to 60 degrees from the view: how many were made."""
    rng, made, view = np.random.default_rng(seed), 0, np.array(direction, dtype=float)
    for name, options_of in WAYS.items():
        tool, lean = random_tool(rng), rng.uniform(0.0, np.tan(np.radians(60.0)))
        across = np.cross(view, rng.standard_normal(3))
        mode = Fixed(view + lean * across / np.linalg.norm(across))
        options = options_of(region=Region(direction=direction, angle=np.radians(80.0)))
        try:
            path = make_toolpath(mesh, tool, options)
        except ToolpathError:  # no waterline on a flat part, no edge or corner on a smooth one, no pencil but a ball
            continue
        path = stepped(oriented(path, tool, Orientation(mode=mode)), options.axis_step)
        top = max(float((mesh.vertices @ view).max()), float((path.tips @ view).max()))
        style = LinkStyle(view, top + 0.01, 3e-3, spacing=2e-3, feed=0.05)
        found, report = without_gouges(path, tool, mesh, GougeOptions((Remedy.DROP,), links=style))
        if not any(segment.kind is SegmentKind.CUT for segment in found.segments):
            continue
        made += 1
        assert (report.left, report.unclear) == (0, 0), (name, tool, mode)
        check(found, report, tool, mesh)
    return made


@pytest.mark.slow
@pytest.mark.parts
@pytest.mark.parametrize("name", PARTS)
@pytest.mark.parametrize("seed", range(3))
def test_no_link_or_rapid_touches_a_part_by_others(parts, name, seed):
    assert set(WAYS) <= set(STRATEGIES)
    mesh = load_mesh(parts / name, "mm")
    mesh = load_mesh(parts / name, "mm", scale=SIZE / max(mesh.diagnosis.extents))
    assert links_of_part(mesh, PARTS[name], seed) >= 3


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pocket_boss", "drafted_pocket"])
def test_no_link_or_rapid_touches_a_concave_part(name):
    assert links_of_part(concave_parts.mesh(name), (0, 0, 1), 5) >= 3


def test_clear_links_are_not_touched():
    mesh = Mesh.of(*surfaces.grid(lambda x, y: 2 * x * y, width=0.06, cells=12))
    path = make_toolpath(mesh, STEM, RasterOptions(stepover=8e-3))
    found, report = without_gouges(path, STEM, mesh, GougeOptions((Remedy.DROP,), links=STYLE))
    assert found is path
    assert report.relinked == 0
