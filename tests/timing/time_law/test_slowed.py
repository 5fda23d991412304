"""Pieces that must be slower than their first law, so that their setpoints keep the limits, are told or refused."""

import numpy as np
import pytest
from timing_paths import Path, Piece, machine, straight

from pentapod.base.refusal import Refusal
from pentapod.timing import Trajectory, certify, explain, retime
from pentapod.toolpath.toolpath import SegmentKind

AT, OVER, LENGTH = 0.1, 0.01, 0.2


def bent(corner):
    """Leg 2 with a velocity that jumps between gridpoints: no derivative there says so."""

    def legs(s):
        rates = np.array([1.0, 0.1, 0.0, 0.0, 0.0])
        q, q1 = np.full((len(s), 5), 0.8) + s[:, None] * rates, np.tile(rates, (len(s), 1))
        q[:, 1] += corner * np.maximum(s - AT, 0.0)
        q1[:, 1] += corner * (s > AT)
        return q, q1, np.zeros((len(s), 5))

    return Piece(legs, LENGTH, sections=[(LENGTH, 0.1, SegmentKind.CUT, 7)], inner_knots=(AT, AT + OVER))


def two_pieces(corner):
    first = straight([1.0, 0.1, 0.0, 0.0, 0.0], 0.05, start=[0.75, 0.795, 0.8, 0.8, 0.8])
    return Path((first, bent(corner)))


def timed(corner):
    return retime(two_pieces(corner), machine(interpolation="cubic"))


def test_slowed_piece_is_reported_with_place_and_both_durations():
    trajectory = timed(0.01)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    (told,) = trajectory.slowed
    assert told.piece == 1
    assert told.duration == pytest.approx(trajectory.laws[1].duration, abs=1e-12)
    assert told.duration > 1.02 * told.first
    # The corner is waypoint 1, 150 mm along the path.
    assert (told.segment, told.waypoints) == (7, (0, 1) if told.station < 0.15 else (1, 2))
    assert 0.145 < told.station < 0.155
    words = (
        f"piece 1 lasts {told.duration:.3f} s, {100 * (told.duration / told.first - 1):.1f} % longer than its first law"
    )
    assert words in str(told)
    assert f"({told.first:.3f} s)" in str(told)
    assert "in segment 7, between waypoints {} and {}".format(*told.waypoints) in str(told)
    assert max(use.share for use in certify(trajectory, machine(interpolation="cubic"))) < 1.0


def test_slowed_piece_is_in_the_explanation():
    trajectory = timed(0.01)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    story = explain(trajectory, machine(interpolation="cubic"))
    assert story.slowed == trajectory.slowed
    assert str(trajectory.slowed[0]) in str(story).splitlines()
    (told,) = story.to_dict()["slowed"]
    assert told["piece"] == 1


def test_slowed_is_empty_where_pieces_keep_their_first_law():
    trajectory = timed(0.0)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    assert trajectory.slowed == ()


def test_piece_20_times_slower_than_its_first_law_is_refused_with_the_place():
    refusal = timed(400.0)
    assert isinstance(refusal, Refusal)
    assert "times slower than the first time law; piece 1, " in refusal.cause
    place = float(refusal.cause.split(" mm along the path")[0].rsplit(" ", 1)[1])
    assert place == pytest.approx(150.0, abs=2.0)
    assert "segment 7" in refusal.cause
    assert refusal.diagnosis[0].waypoints[0] in ((0, 1), (1, 1), (1, 2))
