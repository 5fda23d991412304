"""How deep a tool goes into the corner of something: a motion along a line, whose depths can be told by hand."""

import numpy as np
import pytest
import replay_cases as cases

from pentapod.cutters.ball import BallCutter
from pentapod.cutters.flat_end import FlatEnd
from pentapod.geometry.solids import Solid
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify.claims.gouge import CLAIMS, begins_inside, gouge
from pentapod.verify.replay.claim import Idle
from pentapod.verify.replay.gouge_bounds import gouge_bound
from pentapod.verify.replay.stretches import Stretches, deviation_bounds
from pentapod.verify.verdict.cutting import Cutting

RADIUS = 3e-3
CHORDS = 300
BOUND = 1e-4


def corner(x, z):
    """A tetrahedron that hangs down from its corner at (x, 0, z)."""
    foot = np.array([x, 0.0, z - 0.01])
    around = 1e-3 * np.array([[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0]])
    points = np.array([[x, 0.0, z], *(foot + around)])
    return MeshDistance.of(Mesh.of(points, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])))


def upright(*kinds, tilt_centre=RADIUS, height=0.0):
    """A toolpath from −15 mm to 15 mm along x, whose tilt centre is at that height; segments of equal length."""
    ends, axes = np.linspace(-0.015, 0.015, len(kinds) + 1), np.array([[0.0, 0.0, 1.0]] * 2)
    tips = np.stack([ends, 0.0 * ends, 0.0 * ends + height - tilt_centre], axis=1)
    segments = (Segment(kind, tips[k : k + 2], axes, 0.1) for k, kind in enumerate(kinds))
    return Toolpath(tuple(segments), tilt_centre=tilt_centre)


def moving(tilt_centre=RADIUS, off=0.0, turned=0.0, height=0.0, chords=CHORDS):
    """Along that way, with proven deviations of each chord."""
    x = np.linspace(-0.015, 0.015, chords + 1)
    path = upright(SegmentKind.CUT, tilt_centre=tilt_centre, height=height)
    centres = cases.along_x(x) + np.array([0.0, 0.0, height])
    return cases.measured(path, centres, bounds={"deviations": off, "axis_deviations": turned})


def at_rest(tilt_centres, axes=None, off=0.0, turned=0.0):
    """A replay of these samples, with proven deviations of its chords."""
    bounds = {"deviations": off, "axis_deviations": turned}
    return cases.measured(upright(SegmentKind.CUT), tilt_centres, axes, bounds=bounds)


def ball(depth, where=5e-3, marked=slice(None), **options):
    """What is found of the ball above a corner of such a depth; negative is a gap."""
    chords = np.zeros(CHORDS, dtype=bool)
    chords[marked] = True
    surface = corner(where, -RADIUS + depth)
    return gouge_bound(moving(**options), surface, BallCutter(RADIUS).solids, chords, bound=BOUND)


def slack(depth):
    """What is not improved on, and the resolution of the sweep."""
    return max(2e-6, 0.03 * (BOUND - depth)) + 1e-6 + 0.01 * max(depth, 0.0)


@pytest.mark.parametrize("where", [5e-3, 4.97e-3, -14.97e-3, 14.98e-3])
@pytest.mark.parametrize("depth", [-9e-4, -2e-4, 0.0, 3e-5, 9e-5])
def test_the_depth_of_a_corner_below_the_way(depth, where):
    found = ball(depth, where)
    assert not found.attained
    assert depth <= found.depth <= depth + slack(depth)
    assert abs(found.sample - CHORDS * (where + 0.015) / 0.03) <= 64


@pytest.mark.parametrize("where", [5e-3, 4.95e-3])
def test_a_corner_that_is_too_deep_is_met(where):
    """At a sample, or halfway between two."""
    found = ball(2e-4, where)
    assert found.attained
    assert BOUND < found.depth <= 2e-4 + 1e-9
    assert abs(found.sample - CHORDS * (where + 0.015) / 0.03) <= 64


def test_one_that_only_the_sweep_meets():
    """Slightly too deep, halfway between two samples of a coarse motion, at which it is not."""
    depth = 1.2e-4
    coarse = moving(chords=CHORDS // 50)
    surface = corner(-2.5e-3, -RADIUS + depth)
    found = gouge_bound(coarse, surface, BallCutter(RADIUS).solids, np.ones(6, dtype=bool), bound=BOUND)
    assert found.attained
    assert BOUND < found.depth <= depth + 1e-9


def test_a_depth_that_only_the_sweep_meets_is_attained_less_the_deviation():
    """Too deep by less than the chords may deviate: too deep perhaps, but not surely."""
    depth, off = 1.05e-4, 1e-5
    coarse, surface = moving(off=off, chords=CHORDS // 50), corner(-2.5e-3, -RADIUS + 1.05e-4)
    found = gouge_bound(coarse, surface, BallCutter(RADIUS).solids, np.ones(6, dtype=bool), bound=BOUND)
    assert not found.attained
    assert found.depth >= depth + off


@pytest.mark.parametrize("off", [1e-5, 3e-5])
def test_the_deviation_of_the_motion_makes_it_deeper(off):
    found = ball(3e-5, off=off)
    assert 3e-5 + off <= found.depth <= 3e-5 + off + slack(3e-5)


def test_what_may_be_too_deep_is_not_said_to_be_attained():
    """9.5e-5 m at the samples, and chords that may deviate by 1e-5 m either way: too deep perhaps, but not surely."""
    found = ball(9.5e-5, off=1e-5)
    assert not found.attained
    assert found.depth >= 1.05e-4


def test_what_stands_above_the_ball_is_not_in_it():
    """A corner that hangs to half a millimetre above the ball, and reaches up from there."""
    mesh = corner(5e-3, 0.0).mesh
    above = Mesh.of(mesh.vertices * [1.0, 1.0, -1.0] + [0.0, 0.0, RADIUS + 5e-4], mesh.faces[:, ::-1])
    found = gouge_bound(moving(), MeshDistance.of(above), BallCutter(RADIUS).solids, np.ones(CHORDS, bool), bound=BOUND)
    assert not found.attained
    assert -5e-4 <= found.depth <= -5e-4 + slack(-5e-4)


def test_only_the_chords_that_are_asked_for_count():
    """The corner at 5 mm is passed by the chords about number 200."""
    assert ball(5e-4, marked=slice(0, 120)).depth <= -1e-3 + slack(-1e-3)
    assert ball(5e-4, marked=slice(190, 210)).attained
    assert ball(3e-5, marked=slice(190, 210)).depth == pytest.approx(3e-5, abs=slack(3e-5))


def test_a_tool_that_may_turn_swings_by_its_farthest_point():
    """A flat end of 1 mm about its tip: 4 mm up and half a millimetre out; a corner that looks up into its end."""
    tool = FlatEnd(1e-3, flute=4e-3)
    turned, lever = 1e-3, 4e-3 + tool.solids[0].low_radius
    surface = corner(5e-3, 2e-5)
    found = gouge_bound(moving(0.0, turned=turned), surface, tool.solids, np.ones(CHORDS, dtype=bool), bound=BOUND)
    assert 2e-5 + turned * lever <= found.depth <= 2e-5 + turned * lever + slack(2e-5)
    high = gouge_bound(
        moving(3e-3, turned=turned, height=3e-3), surface, tool.solids, np.ones(CHORDS, bool), bound=BOUND
    )
    lever = 3e-3 + tool.solids[0].low_radius
    assert 2e-5 + turned * lever <= high.depth <= 2e-5 + turned * lever + slack(2e-5)


def test_a_ball_that_turns_about_its_centre_goes_nowhere():
    assert ball(3e-5, turned=0.3).depth <= 3e-5 + slack(3e-5)


def test_a_rounded_solid_reaches_as_far_as_its_rounding():
    rounded = Solid("cutter", 1e-3, 3e-3, 0.5e-3, 0.7e-3, rounding=1e-3)
    turned, lever = 1e-3, 3e-3 + 0.7e-3 + 1e-3
    surface = corner(5e-3, 2e-5)
    about = gouge_bound(
        moving(2.8e-3, turned=1e-2, height=2.8e-3), surface, (rounded,), np.ones(CHORDS, bool), bound=1e-3
    )
    assert 2e-5 + 1e-2 * 3.5e-3 <= about.depth <= 2e-5 + 1e-2 * 3.5e-3 + slack(2e-5) + 0.03 * 9e-4
    found = gouge_bound(moving(0.0, turned=turned), surface, (rounded,), np.ones(CHORDS, dtype=bool), bound=BOUND)
    assert 2e-5 + turned * lever <= found.depth <= 2e-5 + turned * lever + slack(2e-5)


def test_a_deviation_is_that_from_the_nearest_place():
    """Five samples on a line but one that is aside, one that lags, one that leans; and what is proven between."""
    proven = {"off": np.array([1e-5, 2e-5, 4e-5, 3e-5]), "turned": np.array([1e-3, 4e-3, 2e-3, 1e-3])}
    aside = np.array([[0.0, 0, 0], [1.0, 2e-3, 0], [1.5, 0, 0], [3.0, 0, 0], [4.0, 0, 0]])
    both, whole = Stretches(np.array([0, 2]), np.array([4, 4])), Stretches(np.array([0]), np.array([4]))
    replay = at_rest(aside, **proven)
    np.testing.assert_allclose(deviation_bounds(replay, both, 0.0), [2e-3 + 4e-5, 4e-5], atol=1e-15)
    np.testing.assert_allclose(deviation_bounds(replay, both, 0.5), [2e-3 + 4e-5 + 2e-3, 4e-5 + 1e-3], atol=1e-15)
    for before, beyond, expected in ((-0.25, 4.5, 0.5), (-0.25, 2.0, 0.25)):
        replay = at_rest(cases.along_x([0.0, before, beyond, 3.0, 4.0]), **proven)
        np.testing.assert_allclose(deviation_bounds(replay, whole, 0.0), [expected + 4e-5], atol=1e-15)
    axes = np.tile([0.0, 0.0, 1.0], (5, 1))
    axes[1] = [0.0, np.sin(0.1), np.cos(0.1)]
    found = deviation_bounds(at_rest(np.zeros((5, 3)), axes, **proven), both, 0.5)
    # The chord of that lean is as long as the sine of an angle that is a little larger.
    assert 0.5 * (0.1 + 4e-3) + 4e-5 <= found[0] <= 0.5 * (0.1 + 2e-4 + 4e-3) + 4e-5
    assert found[1] == pytest.approx(4e-5 + 1e-3)


def test_the_nearest_place_weighs_tilt_centre_and_axis():
    """20 mm of way and 0.02 rad on a lever of 0.5 m: at 0.6 of the one and 0.4 of the other it is 0.56 of both."""
    lean = np.array([0.0, 0.4, 1.0]) * 0.02
    moment = at_rest(cases.along_x([0.0, 0.012, 0.02]), np.stack([0.0 * lean, np.sin(lean), np.cos(lean)], axis=1))
    found = deviation_bounds(moment, Stretches(np.array([0]), np.array([2])), 0.5)
    height = 0.02**2 / 8.0
    assert found[0] == pytest.approx(0.04 * 0.02 + 0.5 * (0.16 * 0.02 + height), rel=1e-3)


@pytest.mark.parametrize(("turn", "bounded"), [(0.9, True), (1.1, False)])
def test_an_arc_beyond_a_radian_is_too_long(turn, bounded):
    lean = turn * np.linspace(0.0, 1.0, 5)
    turning = at_rest(np.zeros((5, 3)), np.stack([np.sin(lean), 0.0 * lean, np.cos(lean)], axis=1))
    assert np.isfinite(deviation_bounds(turning, Stretches(np.array([0]), np.array([4])), 0.1)[0]) == bounded
    assert deviation_bounds(turning, Stretches(np.array([0]), np.array([4])), 0.0)[0] == 0.0


def test_runs_begin_and_end_where_marks_do():
    runs = Stretches.along(np.array([True, False, False, True, True]))
    assert (runs.starts.tolist(), runs.ends.tolist()) == ([0, 3], [1, 5])
    assert not len(Stretches.along(np.zeros(4, dtype=bool)).starts)


# The claims that are made of it.


def gouging(depth, *kinds):
    """The ball over a corner at 5 mm, on a straight toolpath whose segments are of these kinds and of one length."""
    arcs, centres = np.linspace(0.0, 0.03, CHORDS + 1), cases.along_x(np.linspace(-0.015, 0.015, CHORDS + 1))
    cutting = Cutting(corner(5e-3, -RADIUS + depth), BallCutter(RADIUS).solids, 5e-5)
    return cases.measured(upright(*kinds), centres, match={"arcs": arcs}, cutting=cutting)


def test_cuts_may_gouge_by_what_counts_as_none_and_rapids_may_not():
    cut, rapid = SegmentKind.CUT, SegmentKind.RAPID
    on_cut = gouge(gouging(6e-5, cut), rapid=False)
    assert (on_cut.passed, on_cut.unit, on_cut.bound) == (True, "mm", pytest.approx(0.07))
    assert on_cut.value == pytest.approx(0.06, abs=3e-3)
    assert on_cut.method.endswith(
        "; allowed: 0.02 mm of path tolerance and 0.05 mm of engraving depth or gouge tolerance"
    )
    assert gouge(gouging(6e-5, cut), rapid=True) == Idle("the program has no rapid")
    on_rapid = gouge(gouging(6e-5, rapid), rapid=True)
    assert (on_rapid.passed, on_rapid.bound) == (False, pytest.approx(0.02))
    assert on_rapid.method.endswith("; allowed: 0.02 mm of path tolerance")
    # A cut, a rapid and a cut, which begins above the corner: within the path tolerance of it, nothing is rapid.
    both = gouging(6e-5, cut, rapid, cut)
    assert gouge(both, rapid=False).value == pytest.approx(0.06, abs=3e-3)
    before = gouge(both, rapid=True)
    assert (before.passed, before.where.time_s) == (False, pytest.approx(198 * 0.5 * cases.PERIOD))
    assert before.value == pytest.approx(1e3 * (6e-5 - 2e-4**2 / (2.0 * RADIUS)), abs=2e-4)
    claims = {claim.name: claim.judge(gouging(6e-5, cut)) for claim in CLAIMS}
    assert claims["gouge on cuts and links"].passed
    assert isinstance(claims["gouge on rapids"], Idle)
    assert all(claim.needs_proof for claim in CLAIMS)


@pytest.mark.parametrize(("top", "passed"), [(6e-3, False), (3e-3, True)])
def test_a_cutter_whose_top_is_inside_begins_inside(top, passed):
    """A block about the middle of a ball with its flute, open to nobody: only the top of the flute is looked at."""
    replay = gouging(-1.0, SegmentKind.CUT)
    first = replay.tilt_centres[0] - [0.0, 0.0, RADIUS]
    block = np.array(
        [[-1.0, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
    )
    faces = [
        [0, 2, 1],
        [0, 3, 2],
        [4, 5, 6],
        [4, 6, 7],
        [0, 1, 5],
        [0, 5, 4],
        [1, 2, 6],
        [1, 6, 5],
        [2, 3, 7],
        [2, 7, 6],
    ]
    faces += [[3, 0, 4], [3, 4, 7]]
    mesh = Mesh.of(first + [0.0, 0.0, top] + 4e-4 * block, np.array(faces))
    cutter = BallCutter(RADIUS, flute=6.1e-3).solids
    assert begins_inside(replay, MeshDistance.of(mesh), cutter) is not passed
