"""The numbers beside a value: what is allowed, where it is, how far the work is; each by its own arithmetic."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify import CLAIMS, verify
from pentapod.verify.claims.speed import speed_limits


@pytest.fixture(scope="module", params=["cubic", "linear"])
def good(request):
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="module")
def found(good):
    verdict = verify(good.program, good.machine, good.toolpath, **cases.TOLERANCES, job_digest="job-1")
    return {c.claim: c for c in verdict.certificates}


@pytest.mark.parametrize(
    ("claim", "share"),
    [
        ("leg rates", 1e-3),
        ("leg accelerations", 1e-3),
        ("starts at rest", 1e-3),
        ("ends at rest", 1e-3),
        ("feed on cuts", 1e-3),
        ("feed on links", 1e-3),
        ("rapid rate", 1e-3),
        ("tip deviation", 1e-3),
        ("toolpath covered", 1e-3),
        ("starts at the toolpath's start", 1e-3),
        ("ends at the toolpath's end", 1e-3),
    ],
)
def test_a_share_of_the_bound_is_allowed(found, claim, share):
    assert found[claim].allowed == pytest.approx(found[claim].bound * (1.0 + share), rel=1e-9)


def test_what_is_allowed_of_jerks_and_of_the_axis(found):
    jerk = found["leg jerks"]
    assert jerk.allowed == pytest.approx(1.001 * jerk.bound, rel=1e-9)
    assert found["axis deviation"].allowed == pytest.approx(5.1 + 1e-3 * 0.1, rel=1e-9)


def test_bounds_of_feeds_are_those_asked_for(found):
    for claim, feed in (("feed on cuts", cases.FEED), ("feed on links", cases.LINK_FEED), ("rapid rate", cases.RAPID)):
        assert found[claim].bound == pytest.approx(feed * 1000.0 * 60.0, rel=1e-9)


def test_the_feed_of_lines_between_rows_is_that_of_the_tips(linear):
    """The fastest step between two tips of either cut, at the pace of the rows."""
    verdict = verify(linear.program, linear.machine, linear.toolpath, **cases.TOLERANCES)
    (found,) = (c for c in verdict.certificates if c.claim == "feed on cuts")
    position, direction = linear.machine.robot.pose(linear.program.legs, linear.program.component)
    tips = position + linear.machine.tool_length * direction
    speeds = np.linalg.norm(np.diff(tips, axis=0), axis=1) / cases.PERIOD
    parts = cases.strokes()
    ends = [len(cases.timed(parts[:count])[0]) - 1 for count in (1, 2, 3, 4)]
    fastest = max(speeds[ends[0] : ends[1]].max(), speeds[ends[2] : ends[3]].max())
    assert found.value == pytest.approx(6e4 * fastest, rel=1e-9)
    assert speeds[found.where.row] == pytest.approx(found.value / 6e4, rel=1e-9)


def test_the_ends_are_where_the_program_begins_and_ends(good, found):
    last = len(good.program.legs) - 1
    for claim, row in (
        ("starts at rest", 0),
        ("ends at rest", last),
        ("starts at the toolpath's start", 0),
        ("ends at the toolpath's end", last),
    ):
        where = found[claim].where
        assert (where.row, where.time_s) == (row, pytest.approx(row * cases.PERIOD, abs=1e-12))
        assert where.segment == (0 if row == 0 else len(good.toolpath.segments) - 1)


def test_times_of_places_are_those_of_their_rows(good, found):
    """A place is in the period that begins with its row."""
    for certificate in found.values():
        if (where := certificate.where).row is not None:
            assert -1e-9 <= where.time_s - where.row * cases.PERIOD < cases.PERIOD - 1e-9


def path_of(*pieces):
    """Straight on along x: pieces of (kind, metres, feed)."""
    axis, segments, x = np.array([[0.0, 0.0, 1.0]] * 2), [], 0.0
    for kind, length, feed in pieces:
        segments.append(Segment(kind, np.array([[x, 0.0, 0.0], [x + length, 0.0, 0.0]]), axis, feed))
        x += length
    return Toolpath(tuple(segments), tilt_centre=0.0)


def test_which_segment_sets_the_limit():
    """The fastest of those that a chord comes nearer to, along the path, than the tolerance."""
    cut, link, rapid = SegmentKind.CUT, SegmentKind.LINK, SegmentKind.RAPID
    path = path_of((cut, 1.0, 0.03), (link, 0.2, 0.05), (cut, 1.0, 0.02), (cut, 1.0, 0.5), (rapid, 1.0, np.inf))
    ends = np.array([0.0, 0.5, 0.8, 0.95, 1.05, 1.15, 1.35, 1.5, 2.05, 2.11, 3.05, 3.15, 3.5, 4.2])
    machine = replace(cases.STAND, rapid_velocity=0.4)
    replay = cases.measured(path, cases.along_x(ends), match={"arcs": ends}, machine=machine, path_tolerance=0.1)
    limits, governing = speed_limits(replay)
    #  chord to:            0.5 0.8 .95 1.05 1.15 1.35 1.5 2.05 2.11 3.05 3.15 3.5 4.2
    assert governing.tolist() == [0, 0, 1, 1, 1, 1, 2, 2, 3, 3, 3, 3, 4]
    expected = [0.03, 0.03, 0.05, 0.05, 0.05, 0.05, 0.02, 0.02, 0.4, 0.4, 0.4, 0.4, 0.4]
    np.testing.assert_allclose(limits, expected)


@pytest.mark.parametrize("fastest", range(5))
def test_a_chord_over_many_segments_may_go_as_fast_as_the_fastest(fastest):
    cut = SegmentKind.CUT
    path = path_of(*((cut, 1.0, 0.03 if k == fastest else 0.01 + 0.002 * k) for k in range(5)))
    ends, machine = [0.0, 0.5, 4.5, 5.0], replace(cases.STAND, rapid_velocity=1.0)
    replay = cases.measured(path, cases.along_x(ends), match={"arcs": ends}, machine=machine, path_tolerance=1e-3)
    limits, governing = speed_limits(replay)
    assert governing.tolist() == [0, fastest, 4]
    assert limits[1] == 0.03


def test_progress_goes_evenly_through_the_claims(linear):
    told = []
    verify(
        linear.program,
        linear.machine,
        linear.toolpath,
        **cases.TOLERANCES,
        progress=lambda stage, share, note="": told.append((stage, share, note)),
    )
    assert {stage for stage, _, _ in told} == {"verify"}
    shares = [share for _, share, _ in told]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    between = [share for _, share, note in told if note == "between the rows"]
    np.testing.assert_allclose(between, [0.0, 0.6 * 4096 / (len(linear.program.legs) - 1)])
    of_claims = [(share, note) for _, share, note in told if note in {claim.name for claim in CLAIMS}]
    assert [note for _, note in of_claims] == [claim.name for claim in CLAIMS]
    np.testing.assert_allclose([share for share, _ in of_claims], 0.6 + 0.4 * np.arange(len(CLAIMS)) / len(CLAIMS))
