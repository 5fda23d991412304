"""What a ball must leave in corners, told apart from what its motion leaves there: closed forms, and brute force."""

import numpy as np
import pytest
import trimesh
from raster_cases import UP, along, judged, pocket, raster

from concave_parts import mesh
from left_material import Reachable
from pentapod.cutters.ball import BallCutter
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.flat_end import FlatEnd
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.mesh.region import Region
from pentapod.verify.surface.reachable import nearest_centres

slow = pytest.mark.slow
R, SIZE = 3e-3, 0.02
FLOOR = Region(angle=0.5)
INNER = {"low": R, "high": SIZE - R}
BALL = BallCutter(R)


def floor_raster(*ys):
    """Lines along x over the pocket's floor, from wall to wall."""
    return along(*(line for y in ys for line in raster(1.0, y0=y, y1=y, **INNER)), tool=BALL)


def shaped(finding):
    """Share of the region, per cent, where the shape leaves more than is allowed; the most that it leaves, metres."""
    share, rest = finding.method.split(" %, where the cutter's shape leaves up to ")
    return float(share.split("; ")[-1]), 1e-3 * float(rest.split(" mm")[0])


def test_limit_at_the_foot_of_a_wall_and_in_a_corner_is_that_of_the_ball_there():
    """On the floor, d < R from a wall, the nearest centre is R from both; in a corner R from three."""
    away = np.linspace(5e-5, R, 7)
    points = np.concatenate(
        [
            np.stack([away, 0.5 * SIZE + 0 * away, 0 * away], axis=1),
            np.stack([away, away, 0 * away], axis=1),
        ]
    )
    normals = np.tile(UP, (len(points), 1))
    levels = np.array([0.0, 5e-4, 1e-3, 2e-3, 4e-3])
    found = nearest_centres(MeshDistance.of(pocket(size=SIZE)), points, normals, R, UP, levels)
    expected = np.concatenate([np.hypot(R - away, R), np.sqrt(2.0 * (R - away) ** 2 + R**2)])
    np.testing.assert_allclose(np.linalg.norm(found - points, axis=1), expected, atol=8e-6)


@pytest.mark.parametrize(
    "name", ["fillet_below_the_ball", *(pytest.param(n, marks=slow) for n in ("inward_cone", "ribs"))]
)
def test_nearest_centres_are_as_near_as_those_of_a_drop_cutter(name):
    """The oracle lets a ball down at many places."""
    part = mesh(name)
    samples = Reachable(part, R, 2e-4).samples(400)
    tree = MeshDistance.of(part)
    points, normals = samples.points, part.facet_normals[tree.feet(samples.points).facets]
    levels = np.array([0.0, 2e-4, 4e-4, 8e-4, 1.6e-3, 3.2e-3, 6.4e-3, 0.012])
    found = nearest_centres(tree, points, normals, R, UP, levels)
    off = np.linalg.norm(found - points, axis=1) - samples.gap
    assert np.isfinite(off).all()
    # In deep gaps the oracle counts what is behind thin walls, and the search may end farther away.
    off = off[samples.gap < 1.5 * R]
    assert off.min() > -1.5e-4  # half the pitch of the oracle, at the tip of the cone
    assert np.quantile(np.abs(off), 0.95) < 1e-5


def test_a_ball_behind_a_thin_wall_says_nothing_of_this_side():
    """Beside a sheet that stands on the floor; the nearest centre is on the point's own side."""
    wall = np.array([[0.01, 0.0, 0.0], [0.01, SIZE, 0.0], [0.01, SIZE, 0.01], [0.01, 0.0, 0.01]])
    flat = pocket(size=SIZE)
    facets = len(flat.vertices) + np.array([[0, 1, 2], [0, 2, 3]])
    part = Mesh.of(np.concatenate([flat.vertices, wall]), np.concatenate([flat.faces, facets]))
    points = np.array([[0.01 + side * 2e-4, 0.5 * SIZE, 0.0] for side in (-1.0, 1.0)])
    found = nearest_centres(
        MeshDistance.of(part), points, np.tile(UP, (2, 1)), R, UP, np.array([0.0, 5e-4, 1e-3, 2e-3])
    )
    np.testing.assert_allclose(found[:, 0], [0.01 - R, 0.01 + R], atol=1e-4)


def test_a_ridge_that_is_allowed_is_allowed_at_the_foot_of_a_wall():
    """Passes that run into a wall leave the same ridge on the ball's arc there: height and arc must not be added."""
    replay = floor_raster(*np.linspace(R, SIZE - R, 6))
    ridge = R - np.sqrt(R**2 - (0.1 * (SIZE - 2.0 * R)) ** 2)
    found = judged(replay, pocket(size=SIZE), BALL, 1.03 * ridge, region=FLOOR)
    assert found.value == 0.0
    share, most = shaped(found)
    assert 0.8 < most / ((np.sqrt(3.0) - 1.0) * R) < 1.0  # in the corners
    assert 25.0 < share < 60.0
    assert "out of reach" not in found.method
    assert judged(replay, pocket(size=SIZE), BALL, 0.97 * ridge, region=FLOOR).value > 1.0


def test_what_the_ball_leaves_at_walls_is_told_and_is_not_missed():
    """On the floor, d < R from a wall, the ball leaves √((R − d)² + R²) − R at best; R − √(…) along the normal."""
    left = 0.5e-3
    whole = floor_raster(*np.arange(R, SIZE - R + 1e-9, 1e-3))
    found = judged(whole, pocket(size=SIZE), BALL, left, region=FLOOR)
    assert found.value == 0.0
    strip = R - np.sqrt(R**2 - (R - left) ** 2)
    assert shaped(found)[0] == pytest.approx(100.0 * (1.0 - (SIZE - 2.0 * strip) ** 2 / SIZE**2), rel=0.06)


@pytest.mark.parametrize("first", [pytest.param(1.5e-3, marks=slow), 2e-3])
def test_a_corner_whose_pass_is_left_out_is_missed_with_the_floor_beside_it(first):
    """The next pass, `first` farther from the wall, reaches the floor from √(R² − (R − left)²) beside it on."""
    left, ys = 0.25e-3, np.arange(R, SIZE - R + 1e-9, 0.5e-3)
    short = floor_raster(*ys[ys >= R + first - 1e-9])
    found = judged(short, pocket(size=SIZE), BALL, left, region=FLOOR, share=0.01)
    assert not found.passed
    strip = R + first - np.sqrt(R**2 - (R - left) ** 2)
    assert found.value == pytest.approx(100.0 * strip / SIZE, rel=0.05)


def test_a_fillet_narrower_than_the_ball_must_be_cut_along():
    """A fillet of 1.5 mm between floor and wall: the ball that touches both leaves (√2 − 1) (R − 1.5 mm) in it."""
    part, fillet = mesh("fillet_below_the_ball"), Region(box=((0.02, 0.015, 0.0), (0.0215, 0.0154, 0.0095)))
    lines = [np.array([[x, -0.005, 0.008], [x, 0.035, 0.008]]) for x in 1e-3 * np.array([23.0, 24.0, 25.0, 26.0, 27.0])]
    lines = [line[:: (-1) ** k] for k, line in enumerate(lines)]  # to and fro
    left = 0.25e-3
    found = judged(along(*lines, tool=BALL), part, BALL, left, region=fillet)
    assert found.value == 0.0
    assert shaped(found)[1] == pytest.approx((np.sqrt(2.0) - 1.0) * (R - 1.5e-3), rel=0.02)
    assert judged(along(*lines[2:], tool=BALL), part, BALL, left, region=fillet).value > 60.0
    assert judged(along(*lines[3:], tool=BALL), part, BALL, left, region=fillet).value == pytest.approx(100.0)


def ledge(out=2e-3, height=0.01):
    """A floor of 40 × 30 mm with a wall at x = 0 and a ledge above that stands out from it, 5 mm thick."""
    blocks = [
        [(0.0, 0.0, -5e-3), (0.04, 0.03, 0.0)],
        [(-5e-3, 0.0, -5e-3), (0.0, 0.03, height)],
        [(-5e-3, 0.0, height), (out, 0.03, height + 5e-3)],
    ]
    parts = [trimesh.creation.box(bounds=b) for b in blocks]
    first = np.cumsum([0] + [len(part.vertices) for part in parts])
    faces = [part.faces + k for part, k in zip(parts, first, strict=False)]
    return Mesh.of(np.concatenate([part.vertices for part in parts]), np.concatenate(faces))


def floor_lines(first):
    """Lines along y over the floor of `ledge`, the tips at z = 0, from x = first on; from above, where it is free."""
    xs = np.arange(first, 0.036, 1e-3)
    return along(*(np.array([[x, -5e-3, 0.0], [x, 0.035, 0.0]])[:: (-1) ** k] for k, x in enumerate(xs)), tool=BALL)


def test_a_floor_that_the_view_sees_must_be_cut_up_to_a_ledge_and_no_farther():
    """From above the ball stands 5 mm from the wall: 2 mm of ledge and its radius. It could go on under the ledge."""
    left, floor = 0.25e-3, Region(box=((0.0, 0.0145, -1e-3), (0.02, 0.0155, 1e-3)), angle=0.5)
    up_to_it = judged(floor_lines(2e-3 + R), ledge(), BALL, left, region=floor)
    assert up_to_it.value == 0.0
    hidden = float(up_to_it.method.split(" % more is hidden by overhangs")[0].split("; ")[-1])
    assert hidden == pytest.approx(10.0, rel=0.03)  # 2 of 20 mm
    assert judged(floor_lines(R), ledge(), BALL, left, region=floor).value == 0.0
    # A pass too few leaves all from the ledge's edge to where the ball on the next one reaches down.
    short = judged(floor_lines(2e-3 + R + 2e-3), ledge(), BALL, left, region=floor)
    reached = R + 4e-3 - np.sqrt(R**2 - (R - left) ** 2)
    assert short.value == pytest.approx(100.0 * (reached - 2e-3) / 0.02, rel=0.1)


def test_what_a_leaning_tool_might_reach_under_a_ledge_is_told_where_the_tool_stays_upright():
    """Under a ledge of 12 mm, 4 mm above the floor, a lean of 45 degrees leads out of the outer 4 mm alone."""
    left, floor = 0.25e-3, Region(box=((0.0, 0.0145, -1e-3), (0.02, 0.0155, 1e-3)), angle=0.5)
    part, out = ledge(12e-3, 4e-3), 12e-3
    told = judged(floor_lines(out + R), part, BALL, left, region=floor, leans=np.radians(45.0))
    assert told.passed
    assert told.value == 0.0
    share = float(told.method.split(" deg might reach ")[1].split(" %")[0])
    assert share == pytest.approx(100.0 * (4e-3 - left) / 0.02, rel=0.1)
    assert "might reach" not in judged(floor_lines(out + R), part, BALL, left, region=floor).method
    # A pass that is taken away where the upright tool reaches is missed as ever.
    short = judged(floor_lines(out + R + 2e-3), part, BALL, left, region=floor, leans=np.radians(45.0))
    assert not short.passed
    assert short.value > 5.0


@pytest.mark.parametrize(
    ("kept", "turned", "tilt", "missed"),
    [(True, 0.0, 0.0, 0.0), (True, 0.0, 0.2, 100.0), (True, 1e-3, 0.0, 100.0), (False, 0.0, 0.0, 100.0)],
)
def test_a_flat_end_that_must_keep_one_direction_answers_for_no_wall_under_a_ledge(kept, turned, tilt, missed):
    """Between floor and ledge there is room for the tool along the wall's normal; an upright one finds none."""
    wall, tool = Region(box=((-1e-4, 0.0145, 4e-3), (1e-4, 0.0155, 6e-3)), direction=(1.0, 0.0, 0.0)), FlatEnd(R)
    lines = [np.array([[x, -5e-3, 0.0], [x, 0.035, 0.0]]) for x in (0.016, 0.018)]
    axes = [np.array([[np.sin(angle), 0.0, np.cos(angle)]] * 2) for angle in (0.0, turned)]
    replay = along(*lines, tool=tool, axes=axes)
    found = judged(replay, ledge(12e-3), tool, 0.25e-3, region=wall, tilt=tilt, one_direction=kept)
    assert found.value == pytest.approx(missed)
    assert ("100 % more is hidden by overhangs" in found.method) == (missed == 0.0)


@pytest.mark.parametrize(("above", "missed"), [pytest.param(0.0, 0.0, marks=slow), (1.5e-3, 0.4)])
def test_a_bull_end_leaves_its_fillet_at_the_foot_of_an_outer_wall_and_no_more(above, missed):
    """A tip at the part's lowest point leaves corner − √(corner² − (corner − z)²) beside a wall at a height of z."""
    corner, left, high = 3e-3, 0.25e-3, 3e-3
    tool, block = BullNose(5e-3, corner), trimesh.creation.box(bounds=[(0.0, 0.0, 0.0), (0.02, 0.02, 0.01)])
    part = Mesh.of(block.vertices, block.faces)
    wall = Region(box=((-1e-4, 8e-3, 0.0), (1e-4, 12e-3, high)), direction=(-1.0, 0.0, 0.0))
    lines = [np.array([[x, -8e-3, above], [x, 0.028, above]])[:: (-1) ** k] for k, x in enumerate((-6e-3, -5e-3))]
    found = judged(along(*lines, tool=tool), part, tool, left, region=wall, tilt=0.0, one_direction=True)
    assert found.value == pytest.approx(100.0 * missed, rel=0.05, abs=0.2)
    fillet = corner - np.sqrt(corner**2 - (corner - left) ** 2)
    share = float(found.method.split(" % more is hidden by overhangs")[0].split("; ")[-1])
    assert share == pytest.approx(100.0 * fillet / high, rel=0.05)


def test_a_wall_that_leans_under_must_be_cut_as_far_down_as_a_ball_from_above_comes_near():
    """It leans by 3 degrees under its upper edge; a quarter of what may be left hides nothing."""
    high, left = 0.01, 0.2e-3
    under = high * np.tan(np.radians(3.0))
    corners = [(x, y, z) for y in (0.0, 0.03) for x, z in ((under, 0.0), (0.0, high), (0.02, high), (0.02, 0.0))]
    block = trimesh.convex.convex_hull(np.array(corners))
    part = Mesh.of(block.vertices, block.faces)
    wall = Region(box=((-1e-3, 5e-3, 0.5e-3), (0.019, 0.025, 0.0095)), angle=np.radians(100.0))
    assert part.diagnosis.watertight
    found = judged(along(np.array([[-0.01, 0.0, 0.02], [-0.01, 0.01, 0.02]]), tool=BALL), part, BALL, left, region=wall)
    # From 0.5 mm below the edge to where the wall is a quarter of that behind it.
    seen = 0.25 * left / np.tan(np.radians(3.0)) - 0.5e-3
    assert found.value == pytest.approx(100.0 * seen / 9e-3, rel=0.15)
