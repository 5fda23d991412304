"""Drive surface: lines of centres against closed forms, chords and links against densely sampled distances."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from pentapod import Mesh, RasterOptions, Region
from pentapod.cutters.ball import BallCutter
from pentapod.geometry.directions import angle_between
from pentapod.mesh.passes import Passes
from pentapod.toolpath import PencilOptions, SegmentKind, make_toolpath
from pentapod.toolpath.strategies.raster import raster_paths
from pentapod.toolpath.surfaces.ball_centres import smoothed
from pentapod.toolpath.surfaces.drive_surface import DriveSurface
from pentapod.toolpath.surfaces.options import DriveOptions, OverhangOptions
from pentapod.toolpath.surfaces.part_surface import PartSurface
from slotted_parts import slotted
from toolpath_surfaces import grid

SLOTS = [(0.0, 0.0), (0.05, 0.0), (0.05, 0.5), (0.3, 0.0), (0.3, 0.5)]
R, CHORDAL, UP = 3e-3, 5e-6, np.array([0.0, 0.0, 1.0])


def blocks(*bounds):
    return trimesh.util.concatenate([trimesh.creation.box(bounds=b) for b in bounds])


def part(shape):
    return Mesh.of(np.asarray(shape.vertices), np.asarray(shape.faces))


def gaps(mesh, points):
    """Distances from the part by another library."""
    return trimesh.proximity.closest_point(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False), points)[1]


def dense(lines, count=8):
    t = np.linspace(0.0, 1.0, count)[:, None]
    return np.concatenate([a + t * (b - a) for line in lines for a, b in pairwise(line)])


@pytest.fixture(scope="module")
def pocket():
    """A block of 40 × 30 × 12 mm with a pocket 6 mm deep that is open above."""
    walls = [[(0, 0, 0), (40, 30, 6)], [(0, 0, 0), (8, 30, 12)], [(32, 0, 0), (40, 30, 12)],
             [(0, 0, 0), (40, 7, 12)], [(0, 23, 0), (40, 30, 12)]]  # fmt: skip
    return DriveSurface.of(part(blocks(*(1e-3 * np.array(b, dtype=float) for b in walls))), R, UP)


@pytest.fixture(scope="module")
def passes(pocket):
    """Raster passes over the pocket, put onto the offset."""
    options = RasterOptions(stepover=2e-3, region=Region(angle=np.radians(89.0)))
    drawn = raster_paths(PartSurface(pocket.mesh, BallCutter(1e-6), options.up), options).passes
    return pocket.centres.exact(drawn, CHORDAL, 1e-5)


def lines_of(passes):
    return [passes.points[passes.rows(k)] for k in range(len(passes))]


def test_centres_lie_on_the_offset_and_chords_are_clear(pocket, passes):
    np.testing.assert_allclose(gaps(pocket.part, passes.points), R, atol=1e-9)
    assert gaps(pocket.part, dense(lines_of(passes))).min() >= R - CHORDAL


def test_a_pass_ends_where_no_centre_is_found_and_another_begins():
    """A line dips deep into a gap narrower than the ball: nothing there is a place for its centre."""
    walls = [[(0, 0, 0), (20, 30, 40)], [(20 + 5.6, 0, 0), (40, 30, 40)], [(0, 0, 0), (40, 30, 2)]]
    ribs = DriveSurface.of(part(blocks(*(1e-3 * np.array(b, dtype=float) for b in walls))), R, UP)
    x = 1e-3 * np.array([10.0, 15.0, 22.8, 22.8, 22.8, 30.0, 35.0])
    z = 1e-3 * np.array([43.0, 43.0, 30.0, 25.0, 30.0, 43.0, 43.0])
    line = np.stack([x, np.full(7, 0.015), z], axis=1)
    both = Passes(np.concatenate([line, line[:2]]), np.tile(UP, (9, 1)), np.array([0, 7, 9]), np.array([3, 8]))
    found = ribs.centres.exact(both, CHORDAL, 1e-5)
    assert found.levels.tolist() == [3, 3, 8]
    np.testing.assert_allclose(gaps(ribs.part, found.points), R, atol=1e-9)
    assert gaps(ribs.part, dense(lines_of(found))).min() >= R - CHORDAL


def test_passes_reach_the_floor_and_the_feet_of_the_walls(passes):
    """Centres over the floor are R above it and up to R from the walls."""
    floor = passes.points[np.abs(passes.points[:, 2] - (6e-3 + R)) < 1e-8]
    np.testing.assert_allclose(floor[:, 0].min(), 8e-3 + R, atol=1e-5)
    np.testing.assert_allclose(floor[:, 0].max(), 32e-3 - R, atol=1e-5)


def test_links_follow_the_surface_and_are_clear(pocket):
    rng = np.random.default_rng(3)
    vertices = pocket.mesh.vertices[pocket.mesh.vertices[:, 2] > 7e-3]
    starts = pocket.centres.on_level(vertices[rng.integers(len(vertices), size=60)])
    ends = pocket.centres.on_level(starts + rng.normal(size=starts.shape) * 2e-3)
    found = pocket.centres.ways(starts, ends, 5e-4, CHORDAL, 1e-5)
    links = [link for link in found if link is not None]
    assert len(links) > 40
    assert gaps(pocket.part, dense(links)).min() >= R - CHORDAL
    for link, start, end in zip(found, starts, ends, strict=True):
        if link is not None:
            np.testing.assert_array_equal(link[[0, -1]], [start, end])
            assert np.linalg.norm(np.diff(link, axis=0), axis=1).sum() <= 2.6 * np.linalg.norm(end - start) + 1e-3


@pytest.mark.slow
def test_passes_over_a_region_are_those_of_the_whole_part():
    """A slot beside a wall and a roof over a part of it: both are beyond the region's box, but bear on its passes."""
    walls = [[(0, 0, 0), (60, 12, 3)], [(0, 0, 3), (8, 12, 6)], [(11, 0, 3), (60, 12, 6)],
             [(8, 8.5, 6), (60, 12, 8)], [(12, 0, 9), (60, 12, 11)]]  # fmt: skip
    shape = part(blocks(*(1e-3 * np.array(b, dtype=float) for b in walls)))
    region = Region(box=1e-3 * np.array([(2, 1, 1), (14, 8, 7)]))
    options = RasterOptions(stepover=1.5e-3, region=region)
    own, whole = (DriveSurface.of(shape, 1e-3, UP, region=each) for each in (region, None))
    assert len(own.mesh.faces) < 0.6 * len(whole.mesh.faces)
    found, expected = (surface.waypoints(raster_paths(surface, options).passes, options) for surface in (own, whole))
    assert len(found) > 4
    for field in ("points", "normals", "starts"):
        np.testing.assert_array_equal(getattr(found, field), getattr(expected, field))


@pytest.mark.slow
def test_a_small_region_of_a_large_part_is_machined():
    """A plate of 3 m: the drive surface of all of it would be too fine. A wall beside the region keeps the ball off."""
    shape = part(blocks([(-1.5, -1.5, -0.02), (1.5, 1.5, 0.0)], [(0.031, -0.1, -0.001), (0.05, 0.1, 0.03)]))
    region = Region(box=[(-0.03, -0.03, -0.001), (0.03, 0.03, 0.001)])
    made = make_toolpath(shape, BallCutter(R), RasterOptions(stepover=6e-3, region=region))
    cut = np.unique([k for k in made.segment_of_interval if made.segments[k].kind is SegmentKind.CUT])
    rows = np.flatnonzero(np.isin(made.segment_of_interval, cut))
    centres = made.tilt_centres[np.union1d(rows, rows + 1)]
    np.testing.assert_allclose(centres.min(axis=0), [-0.03, -0.03, R], atol=3e-3)
    assert centres[:, 0].max() == pytest.approx(0.031 - R, abs=1e-5)
    assert centres[:, 1].max() == pytest.approx(0.03, abs=3e-3)


def contacts_at(surface, centres):
    """Passes of two points that begin and end at centres (N, 3)."""
    normals = surface.centres.normals(centres)
    return [(np.stack([c - R * n] * 2), np.stack([n] * 2)) for c, n in zip(centres, normals, strict=True)]


@pytest.fixture(scope="module")
def post():
    """A disc of 20 mm with a round post of 5 mm, 20 mm high; both are upright."""
    both = [trimesh.creation.cylinder(20e-3, 5e-3, sections=64), trimesh.creation.cylinder(5e-3, 40e-3, sections=256)]
    return DriveSurface.of(part(trimesh.util.concatenate(both)), R, UP)


def test_a_link_leads_around_a_post_by_the_shortest_way(post):
    """Tangents to the circle of the centres, and an arc; its chords are clear."""
    options = RasterOptions(stepover=2e-3, chordal=CHORDAL)
    level, away, inner = 2.5e-3 + R, 15e-3, 5e-3 + R
    ends = contacts_at(post, np.array([[-away, 0.0, level], [away, 0.4e-3, level]]))
    (link,) = post.links({1: (ends[0], ends[1])}, options, 2e-3).values()
    np.testing.assert_array_equal(link[0][[0, -1]], [ends[0][0][-1], ends[1][0][0]])
    centres = link[0] + R * link[1]
    assert gaps(post.part, dense([centres])).min() >= R - CHORDAL
    reach = np.hypot(away, 0.4e-3), away
    turn = np.pi - np.arctan2(0.4e-3, away) - sum(np.arccos(inner / a) for a in reach)
    shortest = sum(np.sqrt(a**2 - inner**2) for a in reach) + inner * turn
    assert shortest - 1e-5 <= np.linalg.norm(np.diff(centres, axis=0), axis=1).sum() <= 1.03 * shortest


def test_no_link_leaves_the_region_or_is_too_long(post):
    ends = contacts_at(post, np.array([[-15e-3, 0.0, 2.5e-3 + R], [0.0, 0.0, 20e-3 + R]]))
    pair = {1: (ends[0], ends[1])}
    assert post.links(pair, RasterOptions(stepover=2e-3), 2e-3)
    assert not post.links(pair, RasterOptions(stepover=2e-3, region=Region(angle=np.radians(80.0))), 2e-3)
    lazy = replace(post, options=replace(post.options, around=0.5))
    assert not lazy.links(pair, RasterOptions(stepover=2e-3), 2e-3)


@pytest.fixture(scope="module")
def bridge():
    """A floor of 40 × 20 mm, and above it a slab from x = 15 to 25 mm: 12 mm of room below it."""
    both = [[(0, 0, -4), (40, 20, 0)], [(15, -5, 12), (25, 25, 14)]]
    return part(blocks(*(1e-3 * np.array(b, dtype=float) for b in both)))


def test_no_link_leads_under_what_hides_the_surface(bridge):
    """The straight way is clear of the part, but the tool above the ball has no room there."""
    surface = DriveSurface.of(bridge, R, UP)
    ends = contacts_at(surface, np.array([[8e-3, 10e-3, R], [32e-3, 10e-3, R]]))
    straight = surface.centres.ways(*(contacts + R * normals for contacts, normals in ends), 5e-4, CHORDAL, 1e-5)
    assert straight[0] is not None
    found = surface.links({1: (ends[0], ends[1])}, RasterOptions(stepover=2e-3, chordal=CHORDAL), 2e-3)
    for contacts, normals in found.values():
        x, _, z = (contacts + R * normals).T
        assert (z[(x > 14e-3) & (x < 26e-3)] > 12e-3).all()


@pytest.mark.parametrize("under", [None, 0.0, 0.3e-3])
def test_passes_go_on_to_where_the_part_begins_to_hide_them(bridge, under):
    """As seen from above a ball is hidden from a radius beside the slab on; walls that lean under a little are not."""
    tool, edge = BallCutter(R), 15e-3 - R
    leans = {None: OverhangOptions().sideways * R, 0.0: OverhangOptions().upright * R, 0.3e-3: 0.3e-3}[under]
    options = RasterOptions(stepover=2e-3, region=Region(angle=np.radians(30.0)), spacing=4e-3, under=under)
    cuts = [s.tips + R * s.axes for s in make_toolpath(bridge, tool, options).segments if s.kind is SegmentKind.CUT]
    last = np.array([cut[cut[:, 0].argmax()] for cut in cuts])
    ends = last[(np.abs(last[:, 2] - R) < 1e-6) & (last[:, 0] < 20e-3), 0]
    assert len(ends) >= 10
    assert np.ptp(ends) <= 4e-3 / 2**6 + 1e-6
    assert edge + 0.7 * leans - 4e-3 / 2**6 < ends.max() <= edge + leans


def test_region_box_bounds_the_contacts_not_the_centres(pocket):
    box = ((0.0, 0.0, 0.0), (20e-3, 30e-3, 12e-3))
    patch = pocket.patch(Region(box=box, angle=np.radians(89.0)))
    contacts = pocket.contacts(patch.vertices)
    assert contacts[:, 0].max() <= 20e-3 + 1e-5
    assert patch.vertices[:, 0].max() == pytest.approx(20e-3, abs=1e-4)


def test_a_region_that_ends_at_the_foot_of_walls_ends_in_a_corner_there(pocket):
    """Upper faces end at convex edges, the floor at the feet of its walls: these alone are corners."""
    patch = pocket.patch(Region(angle=np.radians(50.0)))
    sides, beyond = pocket.rising(patch)
    middles = patch.vertices[patch.side_ends(sides)].mean(axis=1)
    np.testing.assert_allclose(middles[:, 2], 9e-3, atol=1e-5)
    np.testing.assert_allclose(np.abs(beyond).max(axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(beyond[:, 2], 0.0, atol=1e-6)
    around = np.linalg.norm(np.diff(patch.vertices[patch.side_ends(sides)], axis=1)[:, 0], axis=1).sum()
    assert around == pytest.approx(2.0 * (18e-3 + 10e-3), rel=0.05)
    assert pocket.feet(patch).sum() == len(sides)
    assert not pocket.feet(pocket.patch(Region(angle=np.radians(90.0)))).any()
    # Walls that lean over a little are corners, too: by 1.7° here, then by 4.6°.
    for angle, below, some in ((50.0, 0.0, True), (50.0, 0.15, True), (50.0, 0.4, False), (90.0, 0.4, False)):
        wide = DriveSurface.of(part(slotted(14.0, below=below)), R, UP)
        assert wide.feet(wide.patch(Region(angle=np.radians(angle)))).any() == some


def pocketed(*corners):
    """A block 10 mm high with an upright, convex pocket, 6 mm deep, of these corners in millimetres, anticlockwise."""
    corners = np.array(corners, dtype=float)
    along = np.roll(corners, -1, axis=0) - corners
    out = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    far = corners + 10.0 * (out + np.roll(out, 1, axis=0))
    rims = [np.concatenate([np.roll(q, -k, axis=0)[:2] for q in (corners, far)]) for k in range(len(corners))]
    columns = [(rim, 4.0, 10.0) for rim in rims] + [(far, 0.0, 4.0)]
    solids = [
        trimesh.convex.convex_hull(np.array([[x, y, z] for x, y in base for z in (low, high)]))
        for base, low, high in columns
    ]
    return part(trimesh.util.concatenate(solids).apply_scale(1e-3))


FLOOR = Region(angle=np.radians(30.0))
BOX = Region(box=np.array([(-5e-3, 8.5e-3, 0.0), (35e-3, 11e-3, 20e-3)]))


@pytest.mark.parametrize("region", [FLOOR, BOX], ids=["angle", "box"])
def test_over_a_pocket_narrower_than_the_ball_it_goes_along_the_middle_as_low_as_its_rims_allow(region):
    """The rims, 4 mm apart, are steeper than the region, or beyond its box; between them lies a floor of it."""
    options = RasterOptions(stepover=2e-3, region=region)
    toolpath = make_toolpath(pocketed((0, 8), (30, 8), (30, 12), (0, 12)), BallCutter(R), options)
    lines = [s.tips + R * s.axes for s in toolpath.segments if s.kind is SegmentKind.CUT]
    points = dense([line for line in lines if line[:, 2].min() < 12.4e-3])
    inside = (points[:, 0] > 4e-3) & (points[:, 0] < 26e-3)
    lowest = 10e-3 + np.sqrt(R**2 - 2e-3**2)
    np.testing.assert_allclose(points[inside, 1:], np.tile([10e-3, lowest], (inside.sum(), 1)), atol=2e-5)
    covered, _ = np.histogram(points[inside, 0], bins=11, range=(4e-3, 26e-3))
    assert covered.all()


@pytest.mark.parametrize(("width", "degrees", "turn"), [(4.9, 40.0, 0.0), (4.9, 54.0, 0.3), (4.0, 30.0, 0.7)])
def test_a_pass_leads_along_the_middle_of_narrow_pockets_however_they_lie_in_the_grid(width, degrees, turn):
    """In the middle the ball touches both rims at 55 deg, 55 deg and 42 deg: within a third of a stepover."""
    along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    middle = np.array([0.13, 0.07])
    ways = [(-12.0, -0.5), (12.0, -0.5), (12.0, 0.5), (-12.0, 0.5)]
    mesh = pocketed(*(middle + a * along + b * width * across for a, b in ways))
    options = RasterOptions(stepover=3e-3, region=Region(angle=np.radians(degrees)))
    toolpath = make_toolpath(mesh, BallCutter(R), options)
    cuts = dense([s.tips + R * s.axes for s in toolpath.segments if s.kind is SegmentKind.CUT], 10)
    height = 10e-3 + np.sqrt(R**2 - (0.5e-3 * width) ** 2)
    line = np.array([[*1e-3 * (middle + a * along), height] for a in np.linspace(-8.0, 8.0, 50)])
    assert KDTree(cuts).query(line)[0].max() < 1e-3


def test_beyond_the_border_of_a_sheet_the_ball_does_not_come_nearer():
    """At the ends of a ridge's feet, where it could roll over the border."""
    ridge = Mesh.of(*grid(lambda x, y: np.clip(0.05 - 3.7 * np.abs(y), 0.0, 0.02) + 0.0 * x, 0.04, 74))
    surface = DriveSurface.of(ridge, R, UP)
    assert not len(surface.nearest_to_unreached(Region(angle=np.radians(89.0))).faces)


def test_a_valley_without_a_floor_of_the_region_is_left_alone():
    """The bottom of a groove between two flanks of 45° is no place of a region of 30°."""
    groove = Mesh.of(*grid(lambda x, y: np.minimum(np.abs(x), 6e-3), 20e-3, 20))
    surface = DriveSurface.of(groove, R, UP)
    assert not len(surface.nearest_to_unreached(Region(angle=np.radians(30.0))).faces)


def test_passes_reach_into_the_tips_of_a_floor_whose_walls_are_not_machined():
    """A triangle with sides of 30 mm: its floor's tips are 6 mm from its corners, where the ball touches both walls."""
    corners = np.array([(0.0, 0.0), (30.0, 0.0), (15.0, 15.0 * np.sqrt(3.0))])
    options = RasterOptions(stepover=2e-3, region=Region(angle=np.radians(30.0)))
    toolpath = make_toolpath(pocketed(*corners), BallCutter(R), options)
    middle, size = corners.mean(axis=0), 10.0 * np.sqrt(3.0)
    tips = middle + (1.0 - 6.0 / size) * (corners - middle)
    cuts = dense([s.tips + R * s.axes for s in toolpath.segments if s.kind is SegmentKind.CUT], 20)
    away = np.linalg.norm(cuts[None] - 1e-3 * np.array([*tips.T, np.full(3, 7.0)]).T[:, None], axis=2).min(axis=1)
    assert (away < 1e-4).all()


@pytest.mark.parametrize("degrees", [50.0, 80.0])
def test_no_more_than_a_ridge_is_left_at_the_foot_of_walls_that_are_not_machined(pocket, degrees):
    """On the floor up to its walls, beyond what the ball forbids: its limit and its swept balls are known."""
    step = 3e-3
    options = RasterOptions(stepover=step, direction=np.radians(90.0), region=Region(angle=np.radians(degrees)))
    toolpath = make_toolpath(pocket.part, BallCutter(R), options)
    lines = [s.tips + R * s.axes for s in toolpath.segments if s.kind is SegmentKind.CUT]
    centres = np.concatenate([dense([line], 40) for line in lines])
    x, y = np.meshgrid(np.linspace(8e-3, 32e-3, 121), np.linspace(7e-3, 23e-3, 81))
    floor = np.stack([x.ravel(), y.ravel(), np.full(x.size, 6e-3)], axis=1)
    nearest = np.clip(floor, [11e-3, 10e-3, 9e-3], [29e-3, 20e-3, 9e-3])
    towards = (nearest - floor) / np.linalg.norm(nearest - floor, axis=1)[:, None]
    allowed = 1.25 * (R - np.sqrt(R**2 - 0.25 * step**2)) + 3e-5
    places = nearest - (R - allowed) * towards
    missed = KDTree(centres).query(places)[0] > R
    assert missed.mean() < 1e-3


@pytest.mark.parametrize(
    ("play", "turn"),
    [(0.0, 0.5), *(pytest.param(*each, marks=pytest.mark.slow) for each in SLOTS)],
)
def test_a_slot_hardly_wider_than_the_ball_is_machined_at_its_bottom(play, turn):
    """A slot as wide as the cutter is what most drawings ask for."""
    mesh = part(slotted(6.0 + play, turn))
    toolpath = make_toolpath(mesh, BallCutter(R), RasterOptions(stepover=3e-3))
    lines = [s.tips + R * s.axes for s in toolpath.segments if s.kind is SegmentKind.CUT]
    centres = dense(lines, 40)
    assert gaps(mesh, centres[::20]).min() >= R - 1e-5 - 1e-6
    along = np.linspace(-0.029, 0.029, 100)
    bottom = np.stack([np.cos(turn) * along, np.sin(turn) * along, np.full(100, 10e-3 + R)], axis=1)
    assert KDTree(centres).query(bottom)[0].max() < 0.6 * 3e-3


@pytest.mark.parametrize("play", [0.0, 0.04, 0.12])
def test_a_round_bore_hardly_wider_than_the_ball_is_machined_at_its_bottom(play):
    """The inscribed circle of its 40 sides is as wide as the ball, and by `play` mm wider."""
    width = (R + 0.5e-3 * play) / np.cos(np.pi / 40.0)
    ring = trimesh.creation.annulus(width, 12e-3, 12e-3, sections=40)
    floor = trimesh.creation.cylinder(12e-3, 4e-3, sections=40)
    floor.apply_translation([0.0, 0.0, -7e-3])
    mesh = part(trimesh.util.concatenate([ring, floor]))
    surface = DriveSurface.of(mesh, R, UP)
    inside = surface.patch(Region()).vertices
    inside = inside[np.linalg.norm(inside[:, :2], axis=1) < 1e-3]
    assert not surface.hides(inside, 1e-5).any()
    toolpath = make_toolpath(mesh, BallCutter(R), RasterOptions(stepover=3e-3))
    centres = dense([s.tips + R * s.axes for s in toolpath.segments if s.kind is SegmentKind.CUT], 40)
    assert gaps(mesh, centres[::20]).min() >= R - 1e-5 - 1e-6
    axis = np.stack([np.zeros(30), np.zeros(30), np.linspace(-5e-3 + R, 6e-3, 30)], axis=1)
    assert KDTree(centres).query(axis)[0].max() < 1e-3


def test_only_channels_with_parallel_walls_make_the_surface_nearer_to_the_part():
    """A round groove of the ball's own radius does not, nor does a slot with more play, or one that it does not fit."""

    def nearest(mesh):
        surface = DriveSurface.of(mesh, R, UP)
        return gaps(mesh, surface.mesh.vertices).min() / R

    assert nearest(part(slotted(6.0))) == pytest.approx(0.97, abs=1e-3)
    assert nearest(part(slotted(6.5))) > 0.999
    assert nearest(part(slotted(5.9))) > 0.999
    x = 0.5 * np.pi + np.linspace(-0.4 * np.pi, 0.4 * np.pi, 25)
    groove = np.stack([R * np.cos(x), -R * np.sin(x)], axis=1)
    assert nearest(sheet_along_x(groove)) > 0.995


def sheet_along_x(profile):
    """An open sheet over a profile (n, 2) in y and z, between flat shoulders."""
    rim = profile[0, 1]
    ends = np.array([[0.02, rim]])
    line = np.concatenate([ends * [np.sign(profile[0, 0]), 1.0], profile, ends * [np.sign(profile[-1, 0]), 1.0]])
    n = len(line)
    corners = np.concatenate([np.c_[np.full(n, x), line] for x in (-0.02, 0.02)])
    k = np.arange(n - 1)
    faces = np.concatenate([np.c_[k, k + n, k + 1 + n], np.c_[k, k + 1 + n, k + 1]])
    mesh = Mesh.of(corners, faces)
    return mesh if mesh.facet_normals[:, 2].mean() > 0.0 else mesh.flipped()


def test_the_ball_does_not_roll_around_an_open_border_but_bridges_a_small_hole():
    x, y = (k.ravel() for k in np.meshgrid(np.linspace(0.0, 0.04, 41), np.linspace(0.0, 0.03, 31), indexing="ij"))
    cell = np.array(
        [[i * 31 + j, (i + 1) * 31 + j, (i + 1) * 31 + j + 1, i * 31 + j + 1] for i in range(40) for j in range(30)]
    )
    faces = np.concatenate([cell[:, [0, 1, 2]], cell[:, [0, 2, 3]]])
    middle = np.stack([x, y], axis=1)[faces].mean(axis=1)
    faces = faces[np.abs(middle - [0.02, 0.015]).max(axis=1) > 1e-3]
    sheet = DriveSurface.of(Mesh.of(np.stack([x, y, 0.0 * x], axis=1), faces), R, UP)
    patch = sheet.patch(Region(angle=np.radians(90.0)))
    assert patch.areas.sum() == pytest.approx(0.04 * 0.03, rel=0.02)
    assert patch.topology.border_loops == 1
    np.testing.assert_allclose(patch.vertices[:, :2].max(axis=0), [0.04, 0.03], atol=0.05 * R)


def bumps(holes):
    """A sheet of 40 mm with bumps as narrow as the ball; holes: with six ragged ones in it."""
    vertices, faces = grid(lambda x, y: 1.6e-3 * np.sin(x / 2.2e-3) * np.cos(y / 2.6e-3), width=0.04, cells=160)
    if holes:
        centres = np.random.default_rng(3).uniform(-15e-3, 15e-3, (6, 2))
        aside = vertices[faces].mean(axis=1)[:, None, :2] - centres
        angle = np.arctan2(aside[..., 1], aside[..., 0])
        wild = 3.5e-3 * (1.0 + 0.35 * np.sin(5.0 * angle) + 0.25 * np.sin(11.0 * angle + 1.0))
        faces = faces[(np.linalg.norm(aside, axis=2) > wild).all(axis=1)]
    return Mesh.of(vertices, faces)


@pytest.mark.parametrize("holes", [True, False])
def test_hollows_at_a_ragged_border_are_cut_by_a_ball_that_rests_on_it(holes):
    """Elsewhere it stays where it was. A ball cuts what is within its radius, here 0.2 mm above the part."""
    mesh = bumps(holes)
    sheets = [DriveSurface.of(mesh, R, UP, DriveOptions(rolls=share)) for share in (0.0, DriveOptions().rolls)]
    patches = [sheet.patch(Region()) for sheet in sheets]
    assert (len(patches[1].faces) > len(patches[0].faces)) == holes
    above = mesh.vertices[mesh.faces].mean(axis=1) + 0.2e-3 * mesh.facet_normals
    reached = [KDTree(patch.vertices).query(above)[0] < R for patch in patches]
    assert not (reached[0] & ~reached[1]).any()
    hollows = above[reached[1] & ~reached[0]]
    assert (len(hollows) >= 10) == holes
    if holes:
        lines = raster_paths(sheets[1], RasterOptions(stepover=1e-3)).passes
        centres = sheets[1].centres.exact(lines, CHORDAL, CHORDAL)
        assert gaps(mesh, centres.points).min() > R - 1e-6
        rows = np.flatnonzero(centres.within)
        between = dense(list(np.stack([centres.points[rows], centres.points[rows + 1]], axis=1)))
        assert np.mean(KDTree(between).query(hollows)[0] < R) > 0.9


def test_normals_turn_evenly_where_the_offset_has_a_crease():
    """Along a line over a corner of 90° the smoothed normal turns over the window, not at once."""
    t = np.linspace(-0.01, 0.01, 201)
    points = np.stack([np.minimum(t, 0.0), 0.0 * t, np.maximum(t, 0.0)], axis=1)
    normals = np.where(t[:, None] < 0.0, [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0])
    turned = smoothed(Passes(points, normals, np.array([0, 201]), np.array([0])), 4e-3)
    steps = np.arccos(np.clip((turned[1:] * turned[:-1]).sum(axis=1), -1.0, 1.0))
    assert steps.max() < np.radians(4.0)
    np.testing.assert_allclose(turned[np.abs(t) > 2.1e-3], normals[np.abs(t) > 2.1e-3], atol=1e-12)


def test_a_pass_is_not_closed_where_both_ends_touch_one_corner_of_the_part():
    """The contacts are the same, but the ball turned about the corner in between: its centre is elsewhere."""
    contacts = np.array([[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [1e-3, 1e-3, 0.0], [0.0, 0.0, 0.0]])
    upright = np.tile(UP, (4, 1))
    turned = np.concatenate([upright[:-1], [[0.6, 0.0, 0.8]]])
    assert Passes.of([(contacts, upright), (contacts, turned)]).closed.tolist() == [True, False]


def valley(count, seed):
    """A strip with a valley of 50° flanks along x, whose facets are uneven."""
    random = np.random.default_rng(seed)
    x = np.concatenate([[-20.0], np.sort(random.uniform(-19.5, 19.5, count)), [20.0]])
    y = np.array([-10.0, -6.0, -1.7, 0.0, 0.9, 4.0, 10.0])
    i, j = np.meshgrid(np.arange(len(x) - 1), np.arange(len(y) - 1), indexing="ij")
    a, b = (i * len(y) + j).ravel(), ((i + 1) * len(y) + j).ravel()
    points = np.stack([np.repeat(x, len(y)), np.tile(y, len(x)), np.tile(np.abs(y), len(x))], axis=1)
    return Mesh.of(1e-3 * points, np.concatenate([np.stack([a, b, b + 1], 1), np.stack([a, b + 1, a + 1], 1)]))


@pytest.mark.parametrize("lean", [0.0, 0.35])
def test_axes_along_a_corner_are_midway_between_its_walls(lean):
    """A straight valley turned about its own line: its axis does not change along it."""
    mesh = valley(count=14, seed=2)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(lean), -np.sin(lean)], [0.0, np.sin(lean), np.cos(lean)]])
    mesh = Mesh.of(mesh.vertices @ turn.T, mesh.faces)
    toolpath = make_toolpath(mesh, BallCutter(R), PencilOptions())
    axes = np.concatenate([s.axes for s in toolpath.segments if s.kind is SegmentKind.CUT])
    assert len(axes) > 10
    away = angle_between(axes, turn @ UP)
    assert np.degrees(away).max() < 0.5


def test_a_part_in_use_has_one_drive_surface_however_far_passes_go_under(pocket):
    again = DriveSurface.of(pocket.part, R, UP, DriveOptions(overhangs=OverhangOptions().leaning(1.0)))
    assert again.mesh is pocket.mesh
    assert DriveSurface.of(pocket.part, R, UP, replace(DriveOptions(), step=0.5)).mesh is not pocket.mesh


@pytest.mark.parametrize("radius", [2.25e-3, 3e-3, 4.1e-3])
def test_a_region_of_walls_ends_at_their_very_feet(radius):
    """It ended up to a facet above them, a quarter of the radius, and the lowest ring left material there."""
    block = DriveSurface.of(part(trimesh.creation.box(bounds=[(0.0, 0.0, 0.0), (0.04, 0.03, 0.02)])), radius, UP)
    patch = block.patch(Region(angle=0.5 * np.pi))
    border = patch.vertices[patch.topology.edges[patch.topology.facets_at_edge == 1]].reshape(-1, 3)
    assert len(border) > 100
    # A right angle has a slack of half a degree.
    assert -0.01 * radius < border[:, 2].min()
    assert border[:, 2].max() < 1e-3 * radius
