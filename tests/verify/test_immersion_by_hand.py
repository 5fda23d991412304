"""How deep a tool goes into the corner of something: a motion along a line, whose depths can be told by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from pentapod.toolpath.mesh import Mesh
from pentapod.toolpath.mesh_distance import MeshDistance
from pentapod.toolpath.solids import Solid
from pentapod.toolpath.tools import BallCutter, FlatEnd
from pentapod.verify.immersion import _runs, _strays, _Stretches, immersion

RADIUS = 3e-3
CHORDS = 300
BOUND = 1e-4


def corner(x, z):
    """A tetrahedron that hangs down from its corner at (x, 0, z)."""
    foot = np.array([x, 0.0, z - 0.01])
    around = 1e-3 * np.array([[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0]])
    points = np.array([[x, 0.0, z], *(foot + around)])
    return MeshDistance.of(Mesh.of(points, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])))


def moving(pivot=RADIUS, away=0.0, turned=0.0, height=0.0):
    """Along x from −15 mm to 15 mm, upright, with so much that each chord may stray."""
    x = np.linspace(-0.015, 0.015, CHORDS + 1)
    return SimpleNamespace(
        pivots=np.stack([x, 0.0 * x, height + 0.0 * x], axis=1),
        axes=np.broadcast_to([0.0, 0.0, 1.0], (CHORDS + 1, 3)),
        survey=SimpleNamespace(away=np.full(CHORDS, away), turned=np.full(CHORDS, turned)),
        toolpath=SimpleNamespace(pivot=pivot),
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
    coarse.pivots, coarse.axes = coarse.pivots[::50], coarse.axes[::50]
    coarse.survey.away, coarse.survey.turned = np.zeros(6), np.zeros(6)
    surface = corner(-2.5e-3, -RADIUS + depth)
    found = immersion(coarse, surface, BallCutter(RADIUS).solids, np.ones(6, dtype=bool), bound=BOUND)
    assert found.met
    assert BOUND < found.most <= depth + 1e-9


@pytest.mark.parametrize("away", [1e-5, 3e-5])
def test_what_the_motion_strays_makes_it_deeper(away):
    found = ball(3e-5, away=away)
    assert 3e-5 + away <= found.most <= 3e-5 + away + slack(3e-5)


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
    found = immersion(moving(0.0, turned=turned), surface, (rounded,), np.ones(CHORDS, dtype=bool), bound=BOUND)
    assert 2e-5 + turned * lever <= found.most <= 2e-5 + turned * lever + slack(2e-5)


def test_a_stray_is_that_from_the_nearest_place():
    """Five samples on a line but one that is aside, one that lags, one that leans; and what is proven between."""
    pivots = np.array([[0.0, 0, 0], [1.0, 2e-3, 0], [1.5, 0, 0], [3.0, 0, 0], [4.0, 0, 0]])
    still = SimpleNamespace(
        pivots=pivots,
        axes=np.broadcast_to([0.0, 0.0, 1.0], (5, 3)),
        survey=SimpleNamespace(away=np.array([1e-5, 2e-5, 4e-5, 3e-5]), turned=np.array([1e-3, 4e-3, 2e-3, 1e-3])),
    )
    stretches = _Stretches(np.array([0, 2]), np.array([4, 4]))
    np.testing.assert_allclose(_strays(still, stretches, 0.0), [2e-3 + 4e-5, 4e-5], atol=1e-15)
    np.testing.assert_allclose(_strays(still, stretches, 0.5), [2e-3 + 4e-5 + 2e-3, 4e-5 + 1e-3], atol=1e-15)
    leaning = SimpleNamespace(**{**vars(still), "axes": still.axes.copy(), "pivots": np.zeros((5, 3))})
    leaning.axes[1] = [0.0, np.sin(0.1), np.cos(0.1)]
    found = _strays(leaning, stretches, 0.5)
    # The chord of that lean is as long as the sine of an angle that is a little larger.
    assert 0.5 * (0.1 + 4e-3) + 4e-5 <= found[0] <= 0.5 * (0.1 + 2e-4 + 4e-3) + 4e-5
    assert found[1] == pytest.approx(4e-5 + 1e-3)


@pytest.mark.parametrize(("turn", "bounded"), [(0.9, True), (1.1, False)])
def test_an_arc_beyond_a_radian_is_too_long(turn, bounded):
    lean = turn * np.linspace(0.0, 1.0, 5)
    turning = SimpleNamespace(
        pivots=np.zeros((5, 3)),
        axes=np.stack([np.sin(lean), 0.0 * lean, np.cos(lean)], axis=1),
        survey=SimpleNamespace(away=np.zeros(4), turned=np.zeros(4)),
    )
    assert np.isfinite(_strays(turning, _Stretches(np.array([0]), np.array([4])), 0.1)[0]) == bounded


def test_runs_begin_and_end_where_marks_do():
    runs = _runs(np.array([True, False, False, True, True]))
    assert (runs.starts.tolist(), runs.ends.tolist()) == ([0, 3], [1, 5])
    assert not len(_runs(np.zeros(4, dtype=bool)).starts)
