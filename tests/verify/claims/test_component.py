"""Claims on component, feed and rest, on measurements that are given."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.kinematics import Component, LinearPentapod
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify.claims.component import kept
from pentapod.verify.claims.speed import feed, rest
from pentapod.verify.replay.interval_bounds import ComponentFindings

PERIOD = 0.002
UP = [0.0, 0.0, 1.0]


BASE = [[-0.552, -0.229], [-0.312, 0.510], [0.155, 0.577], [0.429, -0.417], [-0.078, -0.563]]


def replay_of(upright=-0.5, away=-0.3, delta=1.0, **found):
    component = ComponentFindings()
    component.lower.update(np.array([[upright, -np.inf]]), 7)
    component.lower.update(np.array([[-np.inf, away]]), 9)
    for name, value in found.items():
        setattr(component, name, value)
    machine = replace(cases.STAND, robot=LinearPentapod.quadratic(BASE, delta), tool_length=3.0)
    return cases.measured(
        Toolpath((Segment(SegmentKind.CUT, np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([UP, UP]), 0.1),), 0.0),
        cases.along_x(np.zeros(21)),
        bounds={"component": component},
        machine=machine,
        component=Component.parse("+-"),
        period=PERIOD,
    )


@pytest.mark.parametrize(("upright", "angle"), [(-0.5, 30.0), (-1.0, 90.0), (-1.5, 90.0), (0.0, 0.0), (0.5, -30.0)])
def test_the_angle_is_that_of_the_least_w(upright, angle):
    finding = kept(measure="w", replay=replay_of(upright=upright))
    assert finding.value == pytest.approx(angle, abs=1e-12)
    assert finding.passed == (angle > 0.0)
    assert (finding.bound, finding.unit, finding.where.row) == (0.0, "deg", 7)
    assert "least angle between platform line and base plane," in finding.method


@pytest.mark.parametrize(("delta", "millimetres"), [(1.0, 150.0), (2.0, 100.0), (-2.0, 100.0), (0.5, 200.0)])
def test_the_distance_is_bounded_by_the_largest_root(delta, millimetres):
    finding = kept(measure="S", replay=replay_of(delta=delta))
    assert finding.passed
    assert finding.value == pytest.approx(millimetres)
    assert (finding.unit, finding.where.row) == ("mm", 9)
    assert finding.method.startswith("proven; component +-: lower bound of the position's distance to S = 0, for all")
    assert finding.method.endswith("even if each leg is off by 0.02 mm at any time")


def test_a_refuted_interval_is_named_before_an_undecided_one():
    doubts = {"first_refuted": (4, 0.25, 0.5), "first_undecided": (2, 0.0, 1.0), "refuted": 3, "undecided": 6}
    finding = kept(measure="S", replay=replay_of(away=np.inf, **doubts))
    assert not finding.passed
    assert finding.where.row == 4
    assert finding.method.startswith(
        "refuted: the leg lengths have no pose, first from 0.008500 to 0.009000 s; 3 intervals refuted, 6 undecided; c"
    )


def test_an_undecided_interval_is_named():
    finding = kept(measure="w", replay=replay_of(upright=0.0, first_undecided=(5, 0.5, 1.0), undecided=2))
    assert not finding.passed
    assert finding.where.row == 5
    assert finding.method.startswith(
        "undecided: too near a singularity, first from 0.011000 to 0.012000 s; 0 intervals refuted, 2 undecided;"
    )


def test_without_a_doubtful_interval_the_least_place_is_named():
    finding = kept(measure="w", replay=replay_of(upright=0.1))
    assert finding.where.row == 7
    assert finding.method.startswith("undecided: too near a singularity; component +-")


@pytest.mark.parametrize(("at_end", "leg", "row"), [(False, 2, 0), (True, 4, 3)])
def test_rest_is_judged_by_the_leg_nearest_to_its_own_limit(at_end, leg, row):
    limits = np.array([1.0, 8.0, 2.0, 4.0, 0.5])
    first, last = np.array([1.0, 6.0, 3.0, 4.0, 0.4]), np.array([1.0, -9.0, 1.0, 4.0, -0.7])
    rows = np.cumsum([np.zeros(5), first, np.zeros(5), last], axis=0) * 1e-6
    machine = replace(cases.STAND, legs=replace(cases.STAND.legs, max_acceleration=limits))
    path = feeds_of([0.0], [0.0, 0.001]).toolpath
    replay = cases.measured(path, cases.along_x(np.zeros(7)), machine=machine, legs=rows, period=PERIOD)
    finding = rest(replay, at_end=at_end)
    step = abs((last if at_end else first)[leg]) * 1e-6
    assert finding.value == pytest.approx(1e3 * step / PERIOD)
    assert finding.bound == pytest.approx(1e3 * limits[leg] * PERIOD)
    assert finding.where.row == row
    assert finding.method.startswith(f"speed of leg {leg + 1} over the {'last' if at_end else 'first'} period;")
    assert finding.passed == (finding.value <= finding.bound * 1.001)


def feeds_of(speeds, arcs, feeds=(0.01, 0.04), rapid=0.1):
    """A replay of cuts of 10 mm each along x; speeds (M − 1,) of the chords, arcs (M,) where their ends belong."""
    cuts = tuple(
        Segment(SegmentKind.CUT, np.array([[0.01 * k, 0.0, 0.0], [0.01 * (k + 1), 0.0, 0.0]]), np.array([UP, UP]), f)
        for k, f in enumerate(feeds)
    )
    return replay_along(Toolpath(cuts, 0.003), speeds, arcs, rapid)


def replay_along(toolpath, speeds, arcs, rapid=0.1):
    return cases.measured(
        toolpath,
        cases.along_x(arcs),
        match={"arcs": arcs},
        bounds={"speeds": np.array(speeds)[:, None] * [1.0, 9.0, 9.0]},
        machine=replace(cases.STAND, rapid_velocity=rapid),
        path_tolerance=1e-4,
    )


def test_feed_is_judged_against_each_segments_own():
    finding = feed(feeds_of([0.009, 0.009, 0.012, 0.03], [0.001, 0.002, 0.004, 0.008, 0.019]), SegmentKind.CUT)
    # The last chord reaches across the corner, so the faster feed is its limit; the one before is a fifth too fast.
    assert (finding.value, finding.bound) == (pytest.approx(720.0), pytest.approx(600.0))
    assert (finding.where.row, finding.where.time_s) == (1, cases.PERIOD)
    assert not finding.passed


@pytest.mark.parametrize(("stop", "bound"), [(0.00995, 2400.0), (0.0098, 600.0)])
def test_within_the_tolerance_of_a_corner_the_faster_feed_counts(stop, bound):
    finding = feed(feeds_of([0.009], [0.009, stop]), SegmentKind.CUT)
    assert finding.bound == pytest.approx(bound)


def test_no_feed_is_faster_than_rapids():
    assert feed(feeds_of([0.02], [0.012, 0.018], rapid=0.03), SegmentKind.CUT).bound == pytest.approx(1800.0)


@pytest.mark.parametrize(
    ("tilt_centre", "words"),
    [(0.003, "where the matched place of the toolpath is on a rapid"), (-0.1, "on every segment")],
)
def test_rapids_are_judged_everywhere_only_where_feeds_are_of_a_spot(tilt_centre, words):
    way = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0]])
    toolpath = Toolpath((Segment(SegmentKind.RAPID, way, np.array([UP, UP]), np.inf),), tilt_centre)
    finding = feed(replay_along(toolpath, [0.02], [0.012, 0.018]), SegmentKind.RAPID)
    assert (finding.value, finding.bound) == (pytest.approx(1200.0), pytest.approx(6000.0))
    assert f", {words}; within" in finding.method
