"""How deep a tool goes into the corner of something: a motion along a line, whose depths can be told by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from pentapod.cutters.ball import BallCutter
from pentapod.cutters.flat_end import FlatEnd
from pentapod.geometry.solids import Solid
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify.claims.gouge import CLAIMS, begins_inside, gouge
from pentapod.verify.replay.claim import Idle
from pentapod.verify.replay.gouge_bounds import immersion
from pentapod.verify.replay.stretches import Stretches, strays
from pentapod.verify.verdict.cutting import Cutting
from pentapod.verify.verdict.verdict import Place

RADIUS = 3e-3
CHORDS = 300
BOUND = 1e-4


def corner(x, z):
    """A tetrahedron that hangs down from its corner at (x, 0, z)."""
    foot = np.array([x, 0.0, z - 0.01])
    around = 1e-3 * np.array([[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0]])
    points = np.array([[x, 0.0, z], *(foot + around)])
    return MeshDistance.of(Mesh.of(points, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])))


def moving(tilt_centre=RADIUS, away=0.0, turned=0.0, height=0.0):
    """Along x from −15 mm to 15 mm, upright, with so much that each chord may stray."""
    x = np.linspace(-0.015, 0.015, CHORDS + 1)
    return SimpleNamespace(
        tilt_centres=np.stack([x, 0.0 * x, height + 0.0 * x], axis=1),
        axes=np.broadcast_to([0.0, 0.0, 1.0], (CHORDS + 1, 3)),
        interval_bounds=SimpleNamespace(away=np.full(CHORDS, away), turned=np.full(CHORDS, turned)),
        toolpath=SimpleNamespace(tilt_centre=tilt_centre),
    )


def ball(depth, where=5e-3, marked=slice(None), **options):
    """What is found of the ball above a corner of such a depth; negative is a gap."""
    chords = np.zeros(CHORDS, dtype=bool)
    chords[marked] = True
    surface = corner(where, -RADIUS + depth)
    return immersion(moving(**options), surface, BallCutter(RADIUS).solids, chords, bound=BOUND)


def slack(depth):
    """What is not improved on, and the resolution of the sweep."""
    return max(2e-6, 0.03 * (BOUND - depth)) + 1e-6 + 0.01 * max(depth, 0.0)


@pytest.mark.parametrize("where", [5e-3, 4.97e-3, -14.97e-3, 14.98e-3])
@pytest.mark.parametrize("depth", [-9e-4, -2e-4, 0.0, 3e-5, 9e-5])
def test_the_depth_of_a_corner_below_the_way(depth, where):
    found = ball(depth, where)
    assert not found.met
    assert depth <= found.most <= depth + slack(depth)
    assert abs(found.sample - CHORDS * (where + 0.015) / 0.03) <= 64


@pytest.mark.parametrize("where", [5e-3, 4.95e-3])
def test_a_corner_that_is_too_deep_is_met(where):
    """At a sample, or halfway between two."""
    found = ball(2e-4, where)
    assert found.met
    assert BOUND < found.most <= 2e-4 + 1e-9
    assert abs(found.sample - CHORDS * (where + 0.015) / 0.03) <= 64


def test_one_that_only_the_sweep_meets():
    """Slightly too deep, halfway between two samples of a coarse motion, at which it is not."""
    depth = 1.2e-4
    coarse = moving()
    coarse.tilt_centres, coarse.axes = coarse.tilt_centres[::50], coarse.axes[::50]
    coarse.interval_bounds.away, coarse.interval_bounds.turned = np.zeros(6), np.zeros(6)
    surface = corner(-2.5e-3, -RADIUS + depth)
    found = immersion(coarse, surface, BallCutter(RADIUS).solids, np.ones(6, dtype=bool), bound=BOUND)
    assert found.met
    assert BOUND < found.most <= depth + 1e-9


@pytest.mark.parametrize("away", [1e-5, 3e-5])
def test_what_the_motion_strays_makes_it_deeper(away):
    found = ball(3e-5, away=away)
    assert 3e-5 + away <= found.most <= 3e-5 + away + slack(3e-5)


def test_what_may_be_too_deep_is_not_told_as_met():
    """9.5e-5 m at the samples, and 1e-5 m that the chords may stray either way: too deep perhaps, but not surely."""
    found = ball(9.5e-5, away=1e-5)
    assert not found.met
    assert found.most >= 1.05e-4


def test_what_stands_above_the_ball_is_not_in_it():
    """A corner that hangs to half a millimetre above the ball, and reaches up from there."""
    mesh = corner(5e-3, 0.0).mesh
    above = Mesh.of(mesh.vertices * [1.0, 1.0, -1.0] + [0.0, 0.0, RADIUS + 5e-4], mesh.faces[:, ::-1])
    found = immersion(moving(), MeshDistance.of(above), BallCutter(RADIUS).solids, np.ones(CHORDS, bool), bound=BOUND)
    assert not found.met
    assert -5e-4 <= found.most <= -5e-4 + slack(-5e-4)


def test_only_the_chords_that_are_asked_for_count():
    """The corner at 5 mm is passed by the chords about number 200."""
    assert ball(5e-4, marked=slice(0, 120)).most <= -1e-3 + slack(-1e-3)
    assert ball(5e-4, marked=slice(190, 210)).met
    assert ball(3e-5, marked=slice(190, 210)).most == pytest.approx(3e-5, abs=slack(3e-5))


def test_a_tool_that_may_turn_swings_by_its_farthest_point():
    """A flat end of 1 mm about its tip: 4 mm up and half a millimetre out; a corner that looks up into its end."""
    tool = FlatEnd(1e-3, flute=4e-3)
    turned, lever = 1e-3, 4e-3 + tool.solids[0].low_radius
    surface = corner(5e-3, 2e-5)
    found = immersion(moving(0.0, turned=turned), surface, tool.solids, np.ones(CHORDS, dtype=bool), bound=BOUND)
    assert 2e-5 + turned * lever <= found.most <= 2e-5 + turned * lever + slack(2e-5)
    high = immersion(moving(3e-3, turned=turned, height=3e-3), surface, tool.solids, np.ones(CHORDS, bool), bound=BOUND)
    lever = 3e-3 + tool.solids[0].low_radius
    assert 2e-5 + turned * lever <= high.most <= 2e-5 + turned * lever + slack(2e-5)


def test_a_ball_that_turns_about_its_centre_goes_nowhere():
    assert ball(3e-5, turned=0.3).most <= 3e-5 + slack(3e-5)


def test_a_rounded_solid_reaches_as_far_as_its_rounding():
    rounded = Solid("cutter", 1e-3, 3e-3, 0.5e-3, 0.7e-3, rounding=1e-3)
    turned, lever = 1e-3, 3e-3 + 0.7e-3 + 1e-3
    surface = corner(5e-3, 2e-5)
    about = immersion(
        moving(2.8e-3, turned=1e-2, height=2.8e-3), surface, (rounded,), np.ones(CHORDS, bool), bound=1e-3
    )
    assert 2e-5 + 1e-2 * 3.5e-3 <= about.most <= 2e-5 + 1e-2 * 3.5e-3 + slack(2e-5) + 0.03 * 9e-4
    found = immersion(moving(0.0, turned=turned), surface, (rounded,), np.ones(CHORDS, dtype=bool), bound=BOUND)
    assert 2e-5 + turned * lever <= found.most <= 2e-5 + turned * lever + slack(2e-5)


def test_a_stray_is_that_from_the_nearest_place():
    """Five samples on a line but one that is aside, one that lags, one that leans; and what is proven between."""
    tilt_centres = np.array([[0.0, 0, 0], [1.0, 2e-3, 0], [1.5, 0, 0], [3.0, 0, 0], [4.0, 0, 0]])
    still = SimpleNamespace(
        tilt_centres=tilt_centres,
        axes=np.broadcast_to([0.0, 0.0, 1.0], (5, 3)),
        interval_bounds=SimpleNamespace(
            away=np.array([1e-5, 2e-5, 4e-5, 3e-5]), turned=np.array([1e-3, 4e-3, 2e-3, 1e-3])
        ),
    )
    stretches = Stretches(np.array([0, 2]), np.array([4, 4]))
    np.testing.assert_allclose(strays(still, stretches, 0.0), [2e-3 + 4e-5, 4e-5], atol=1e-15)
    np.testing.assert_allclose(strays(still, stretches, 0.5), [2e-3 + 4e-5 + 2e-3, 4e-5 + 1e-3], atol=1e-15)
    still.tilt_centres = tilt_centres - np.array([0.0, 2e-3, 0.0]) * (np.arange(5) == 1)[:, None]
    still.tilt_centres[1, 0], still.tilt_centres[2, 0] = -0.25, 4.5
    np.testing.assert_allclose(strays(still, Stretches(np.array([0]), np.array([4])), 0.0), [0.5 + 4e-5], atol=1e-15)
    still.tilt_centres[2, 0] = 2.0
    np.testing.assert_allclose(strays(still, Stretches(np.array([0]), np.array([4])), 0.0), [0.25 + 4e-5], atol=1e-15)
    leaning = SimpleNamespace(**{**vars(still), "axes": still.axes.copy(), "tilt_centres": np.zeros((5, 3))})
    leaning.axes[1] = [0.0, np.sin(0.1), np.cos(0.1)]
    found = strays(leaning, stretches, 0.5)
    # The chord of that lean is as long as the sine of an angle that is a little larger.
    assert 0.5 * (0.1 + 4e-3) + 4e-5 <= found[0] <= 0.5 * (0.1 + 2e-4 + 4e-3) + 4e-5
    assert found[1] == pytest.approx(4e-5 + 1e-3)


def test_the_nearest_place_weighs_tilt_centre_and_axis():
    """20 mm of way and 0.02 rad on a lever of 0.5 m: at 0.6 of the one and 0.4 of the other it is 0.56 of both."""
    lean = np.array([0.0, 0.4, 1.0]) * 0.02
    moment = SimpleNamespace(
        tilt_centres=np.array([[0.0, 0.0, 0.0], [0.012, 0.0, 0.0], [0.02, 0.0, 0.0]]),
        axes=np.stack([0.0 * lean, np.sin(lean), np.cos(lean)], axis=1),
        interval_bounds=SimpleNamespace(away=np.zeros(2), turned=np.zeros(2)),
    )
    found = strays(moment, Stretches(np.array([0]), np.array([2])), 0.5)
    height = 0.02**2 / 8.0
    assert found[0] == pytest.approx(0.04 * 0.02 + 0.5 * (0.16 * 0.02 + height), rel=1e-3)


@pytest.mark.parametrize(("turn", "bounded"), [(0.9, True), (1.1, False)])
def test_an_arc_beyond_a_radian_is_too_long(turn, bounded):
    lean = turn * np.linspace(0.0, 1.0, 5)
    turning = SimpleNamespace(
        tilt_centres=np.zeros((5, 3)),
        axes=np.stack([np.sin(lean), 0.0 * lean, np.cos(lean)], axis=1),
        interval_bounds=SimpleNamespace(away=np.zeros(4), turned=np.zeros(4)),
    )
    assert np.isfinite(strays(turning, Stretches(np.array([0]), np.array([4])), 0.1)[0]) == bounded
    assert strays(turning, Stretches(np.array([0]), np.array([4])), 0.0)[0] == 0.0


def test_runs_begin_and_end_where_marks_do():
    runs = Stretches.along(np.array([True, False, False, True, True]))
    assert (runs.starts.tolist(), runs.ends.tolist()) == ([0, 3], [1, 5])
    assert not len(Stretches.along(np.zeros(4, dtype=bool)).starts)


# The claims that are made of it.


def gouging(depth, *kinds):
    """The ball over a corner at 5 mm, on a straight toolpath whose segments are of these kinds and of one length."""
    ends, axes = np.linspace(-0.015, 0.015, len(kinds) + 1), np.array([[0.0, 0.0, 1.0]] * 2)
    segments = tuple(
        Segment(kind, np.array([[a, 0.0, -RADIUS], [b, 0.0, -RADIUS]]), axes, 0.1)
        for kind, a, b in zip(kinds, ends, ends[1:], strict=False)
    )
    replay = moving()
    replay.toolpath = Toolpath(segments, tilt_centre=RADIUS)
    replay.match = SimpleNamespace(arcs=np.linspace(0.0, 0.03, CHORDS + 1))
    replay.path_tolerance = 2e-5
    cutting = Cutting(corner(5e-3, -RADIUS + depth), BallCutter(RADIUS).solids, 5e-5)
    replay.specification = SimpleNamespace(cutting=cutting)
    replay.place = lambda sample: Place(sample, int(sample), 0)
    return replay


def test_cuts_may_gouge_by_what_counts_as_none_and_rapids_may_not():
    cut, rapid = SegmentKind.CUT, SegmentKind.RAPID
    on_cut = gouge(gouging(6e-5, cut), rapid=False)
    assert (on_cut.passed, on_cut.unit, on_cut.bound) == (True, "mm", pytest.approx(0.07))
    assert on_cut.value == pytest.approx(0.06, abs=3e-3)
    assert on_cut.method.endswith("; allowed: 0.02 mm off the toolpath, and 0.05 mm that count as none or are engraved")
    assert gouge(gouging(6e-5, cut), rapid=True) == Idle("no moment belongs to a rapid")
    on_rapid = gouge(gouging(6e-5, rapid), rapid=True)
    assert (on_rapid.passed, on_rapid.bound) == (False, pytest.approx(0.02))
    assert on_rapid.method.endswith("; allowed: 0.02 mm off the toolpath")
    # A cut, a rapid and a cut, which begins above the corner: within the path tolerance of it, nothing is rapid.
    both = gouging(6e-5, cut, rapid, cut)
    assert gouge(both, rapid=False).value == pytest.approx(0.06, abs=3e-3)
    before = gouge(both, rapid=True)
    assert (before.passed, before.where.row) == (False, 198)
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
    replay.cutting = Cutting(MeshDistance.of(mesh), BallCutter(RADIUS, flute=6.1e-3).solids, 5e-5)
    assert begins_inside(replay, replay.cutting.surface, replay.cutting.cutter) is not passed
