"""From a placement to margins along the path, and to colours."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pentapod.geometry import RigidTransform
from pentapod.planning import PlacedPath
from pentapod.toolpath import Segment, SegmentKind, Toolpath
from pentapod.view import Study

SHIFTS = st.tuples(*[st.floats(-0.4, 0.4)] * 3)


@pytest.fixture(scope="module")
def study(opened):
    return Study.of(opened)


def shifted(opened, shift):
    return RigidTransform(opened.placement.rotation, opened.placement.translation + shift)


def test_where_it_was_planned_the_margins_are_the_plans(planned, opened, study):
    placed = planned[1].find(PlacedPath)
    reach = study.at(opened.placement, thorough=True)
    assert np.array_equal(reach.rows, np.arange(len(placed.tips)))
    assert reach.margins.astype(np.float32) == pytest.approx(placed.margins.min(axis=1), abs=1e-9)
    assert reach.worst.limit == placed.active_limit
    assert np.float32(reach.worst.margin) == pytest.approx(placed.smallest_margin, abs=1e-9)
    assert reach.fits
    assert reach.beyond == 0.0


@given(SHIFTS)
def test_strokes_are_told_in_millimetres(opened, study, shift):
    """The legs' lengths by distances between points, nothing of the planner's formulas."""
    placement = shifted(opened, shift)
    reach = study.at(placement, thorough=True)
    machine = opened.machine
    tips = opened.toolpath.tilt_centres - opened.toolpath.tilt_centre * opened.axes
    tips, axes = tips @ placement.rotation.T + placement.translation, opened.axes @ placement.rotation.T
    joints = tips[:, None] + (machine.tool_length - machine.robot.offsets)[:, None] * axes[:, None]
    lengths = np.linalg.norm(joints - np.column_stack([machine.robot.base, np.zeros(5)]), axis=2)
    room = np.minimum(lengths - machine.legs.min_length, machine.legs.max_length - lengths).min(axis=1)
    assert (reach.margins[room < 0.0] < 0.0).all(), "a leg out of its stroke is a place beyond a limit"
    assert reach.beyond == pytest.approx((reach.margins < 0.0).mean())
    if reach.worst.limit.startswith("leg ") and reach.worst.limit.endswith(("too long", "too short")):
        leg = int(reach.worst.limit[4]) - 1
        long = machine.legs.max_length[leg] - lengths[reach.worst.waypoint, leg]
        short = lengths[reach.worst.waypoint, leg] - machine.legs.min_length[leg]
        own = long if reach.worst.limit.endswith("too long") else short
        assert reach.worst.room == pytest.approx(1e3 * own, abs=1e-6)


def test_of_fewer_places_the_worst_is_named_by_its_waypoint(opened, study):
    few = dataclasses.replace(study, shown=np.arange(2, len(opened.toolpath), 7))
    for shift in ((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, -0.2, 0.1)):
        placement = shifted(opened, shift)
        some, every = few.at(placement), study.at(placement, thorough=True)
        assert some.worst.waypoint in few.shown
        assert every.margins[some.worst.waypoint] == pytest.approx(some.worst.margin, abs=1e-12)
        assert some.worst.margin == some.margins.min()


def test_the_best_lean_is_no_worse_than_none(opened, study):
    """Moved to the edge of its reach, with nominal axes against a cone about them."""
    upright = dataclasses.replace(study, axes=opened.toolpath.axes)
    for shift in ((0.1, 0.0, 0.05), (-0.15, 0.1, 0.0), (0.0, 0.25, 0.0)):
        placement = shifted(opened, shift)
        leaning, standing = study.at(placement, tilted=True), upright.at(placement, thorough=True)
        assert (leaning.margins >= standing.margins[leaning.rows] - 1e-12).all()
        assert leaning.margins.min() > standing.margins.min()


def test_a_long_path_is_thinned_and_keeps_the_ends_of_its_passes():
    from pentapod.view.study import drawn_waypoints

    starts = np.concatenate([[0], np.cumsum(np.full(200, 500))])
    shown = drawn_waypoints(starts)
    assert len(shown) < 4_000
    assert np.isin(starts, shown).all()
    assert np.isin(np.arange(50), drawn_waypoints(np.array([0, 20, 49]))).all()


@pytest.mark.slow
def test_many_waypoints_are_judged_evenly(opened):
    count = 30_000
    turn = np.linspace(0.0, 60.0, count)
    tips = 0.02 * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    toolpath = Toolpath((Segment(SegmentKind.CUT, tips, np.tile([0.0, 0.0, 1.0], (count, 1)), 0.02),))
    run = dataclasses.replace(opened, toolpath=toolpath, axes=toolpath.axes)
    study = Study.of(run)
    quick, thorough = study.at(run.placement), study.at(run.placement, thorough=True)
    assert len(quick.rows) <= 1_501
    assert len(study.at(run.placement, tilted=True).rows) <= 401
    assert len(thorough.rows) == 20_000
    assert {quick.rows[0], quick.rows[-1]} == {thorough.rows[0], thorough.rows[-1]} == {0, count - 1}
    assert thorough.worst.margin <= quick.worst.margin + 1e-3
