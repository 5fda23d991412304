"""Waypoints inserted where the axis turns by too much: what stays of the toolpath, and how a turn is divided."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.toolpath.axis.steps import stepped
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

STEP = np.radians(4.0)


def axis(lean, towards=0.0):
    return np.array([np.sin(lean) * np.cos(towards), np.sin(lean) * np.sin(towards), np.cos(lean)])


def turning(tilt_centre=3e-3):
    """A cut whose axis turns by 10° and then not at all, and a link that turns back; it waits, stands, and marks."""
    tips = np.array([[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [2e-3, 1e-3, 0.0]])
    axes = np.array([axis(0.0), axis(np.radians(10.0)), axis(np.radians(10.0))])
    cut = Segment(SegmentKind.CUT, tips, axes, 0.01, 0.6, 0.25)
    back = Segment(SegmentKind.LINK, tips[[2, 0]], axes[[2, 0]], 0.02, dwell=0.0)
    return Toolpath((cut, back), tilt_centre, wait=0.4)


def test_stepped_keeps_waypoints_and_properties_of_segments():
    before, after = turning(), stepped(turning(), STEP)
    assert (after.wait, after.tilt_centre) == (before.wait, before.tilt_centre)
    assert after.dwells == before.dwells == (0.4, 0.25, 0.0)
    for old, new in zip(before.segments, after.segments, strict=True):
        assert (new.kind, new.feed, new.power) == (old.kind, old.feed, old.power)
        for pose in np.hstack([old.tips, old.axes]):
            assert (np.hstack([new.tips, new.axes]) == pose).all(axis=1).any(), "a waypoint was lost"
    assert [len(segment.tips) for segment in after.segments] == [3 + 2, 2 + 2]


def test_stepped_returns_a_toolpath_that_keeps_the_step_itself():
    path = turning()
    assert stepped(path, np.radians(10.1)) is path


@settings(max_examples=40)
@given(
    st.lists(st.tuples(st.floats(0.0, 1.4), st.floats(-3.0, 3.0)), min_size=2, max_size=6),
    st.floats(0.02, 1.0),
    st.sampled_from([-5e-3, 0.0, 3e-3]),
)
def test_stepped_divides_turns_evenly_and_moves_the_tilt_centre_straight(leans, step, tilt_centre):
    axes = np.array([axis(*lean) for lean in leans])
    tips = np.linspace([0.0, 0.0, 0.0], [0.05, 0.02, 0.01], len(axes))
    path = stepped(Toolpath((Segment(SegmentKind.CUT, tips, axes, 0.01),), tilt_centre), step)
    at = [int(np.abs(path.tips - tip).max(axis=1).argmin()) for tip in tips]
    for a, b in pairwise(at):
        turns = np.arccos(np.clip((path.axes[a:b] * path.axes[a + 1 : b + 1]).sum(axis=1), -1.0, 1.0))
        assert turns.max() <= step * (1.0 + 1e-6) + 1e-7
        assert turns == pytest.approx(turns.mean(), abs=1e-6)
        share = np.linspace(0.0, 1.0, b - a + 1)[:, None]
        straight = path.tilt_centres[a] + share * (path.tilt_centres[b] - path.tilt_centres[a])
        np.testing.assert_allclose(path.tilt_centres[a : b + 1], straight, atol=1e-12)
