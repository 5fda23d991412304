"""A dense path is planned with the waypoints that shape it; what the plan says holds at all of them."""

import importlib

import numpy as np
import pytest
from domes import dome

from pentapod.geometry.directions import angle_between
from pentapod.planning import PlacedPath, plan
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

TILT = np.radians(15.0)
NO_ROWS = np.zeros(0, dtype=np.intp)


@pytest.fixture(scope="module")
def dense() -> Toolpath:
    """A small cap with waypoints 0.15 mm apart."""
    return dome(0.03, 35.0, 6000)


@pytest.fixture(scope="module")
def every_fifth(dense) -> Toolpath:
    (cut,) = dense.segments
    rows = np.unique(np.append(np.arange(0, len(dense), 5), len(dense) - 1))
    return Toolpath((Segment(SegmentKind.CUT, cut.tips[rows], cut.axes[rows], cut.feed),), dense.tilt_centre)


def samples_of(centres, axes=None) -> ToolpathSamples:
    axes = np.tile([0.0, 0.0, 1.0], (len(centres), 1)) if axes is None else axes
    return ToolpathSamples(np.asarray(centres, dtype=float), axes, 0.003, TILT)


def line(count, length=0.1):
    return np.c_[np.linspace(0.0, length, count), np.zeros(count), np.zeros(count)]


def test_a_straight_dense_path_keeps_a_waypoint_each_millimetre():
    rows = samples_of(line(2001)).shaping(NO_ROWS)
    gaps = np.diff(line(2001)[rows, 0])
    assert rows[0] == 0
    assert rows[-1] == 2000
    assert gaps.max() <= 1.1e-3
    assert len(rows) <= 110


def test_a_small_part_keeps_them_closer():
    path = line(2001, 0.01)
    assert np.diff(path[samples_of(path).shaping(NO_ROWS), 0]).max() <= 1.1e-4


def test_paths_that_are_not_dense_keep_every_waypoint():
    np.testing.assert_array_equal(samples_of(line(51)).shaping(NO_ROWS), np.arange(51))


def test_waypoints_asked_for_are_kept():
    assert {17, 1003} <= set(samples_of(line(2001)).shaping(np.array([17, 1003])).tolist())


@pytest.mark.parametrize("what", ["place", "axis"])
def test_a_bump_between_is_kept(what):
    centres, axes = line(2001), np.tile([0.0, 0.0, 1.0], (2001, 1))
    if what == "place":
        centres[1007, 2] = 30e-6
    else:
        axes[1007] = [np.sin(0.01), 0.0, np.cos(0.01)]
    assert 1007 in samples_of(centres, axes).shaping(NO_ROWS)


def test_leans_between_are_linear_along_the_path():
    path = samples_of(line(2001))
    rows = path.shaping(NO_ROWS)
    leans = np.c_[0.1 * path.tilt_centres[rows, 0], np.zeros((len(rows), 2))]
    np.testing.assert_allclose(path.spread(leans, rows)[:, 0], 0.1 * path.tilt_centres[:, 0], atol=1e-15)


@pytest.mark.slow
def test_the_plan_holds_at_every_waypoint(desk, dense, every_fifth):
    """Legs from the robot's own kinematics; no margin is lost beside the same path with a fifth of the waypoints."""
    assert len(ToolpathSamples.of(dense, TILT).shaping(dense.starts)) < 0.5 * len(dense)
    placed, coarse = plan(dense, desk, tilt=TILT), plan(every_fifth, desk, tilt=TILT)
    assert isinstance(placed, PlacedPath), str(placed)
    p = placed.tips + desk.tool_length * placed.axes
    legs = desk.robot.leg_lengths(p, -placed.axes)
    assert (legs > desk.legs.min_length).all()
    assert (legs < desk.legs.max_length).all()
    assert angle_between(placed.axes, placed.placement.transform.rotate(dense.axes)).max() <= TILT
    np.testing.assert_allclose(
        placed.tilt_centres, placed.placement.transform.apply(dense.tilt_centres), rtol=0.0, atol=1e-12
    )
    assert placed.smallest_margin >= 0.97 * coarse.smallest_margin
    step = np.linalg.norm(np.diff(dense.tilt_centres, axis=0), axis=1)
    nominal = angle_between(dense.axes[1:], dense.axes[:-1]) / step
    assert (angle_between(placed.axes[1:], placed.axes[:-1]) / step).max() <= 1.5 * nominal.max()


def test_where_another_waypoint_is_out_of_limits_all_are_planned_with(desk, monkeypatch):
    """With every waypoint but the middle ones left out of the search, the first plan cannot hold at the rest."""
    wide = dome(0.24, 35.0, 400)
    kept = np.arange(150, 250)
    seen = []
    module = importlib.import_module("pentapod.planning.plan")
    searched = module._searched

    def counted(problem, *rest):
        seen.append(len(problem.samples.nominal))
        return searched(problem, *rest)

    monkeypatch.setattr(module, "_searched", counted)
    monkeypatch.setattr(ToolpathSamples, "shaping", lambda self, rows: kept)
    answer = plan(wide, desk, tilt=TILT)
    assert seen == [100, len(wide)]
    assert not isinstance(answer, PlacedPath) or answer.smallest_margin > 0.0
