"""Programs that are slower than they have to be, or stand where nothing asks for it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.base.errors import ArrayError
from pentapod.geometry.polyline import arc_length
from pentapod.machine.parts import ToolLimits
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify import Specification, verify
from pentapod.verify.claims import slowness, speed
from pentapod.verify.claims.slowness import unasked_stop
from pentapod.verify.replay.replay import Replay

FEED, STOP = "lowest feed", "no unasked stop"


@pytest.fixture(scope="module")
def linear():
    return cases.good_case(interpolation="linear")


def judged(case, program=None, **changes):
    asked = {**cases.ASKED, **changes}
    verdict = verify(program or case.program, changes.pop("machine", case.machine), case.toolpath, **asked)
    return {c.claim: c for c in verdict.certificates}


def standing(case, row, seconds):
    rows = round(seconds / cases.PERIOD)
    legs = np.insert(case.program.legs, row, np.repeat(case.program.legs[row : row + 1], rows, axis=0), axis=0)
    return replace(case.program, legs=legs)


def ends_of_strokes():
    """The row at which each stroke ends."""
    parts = cases.strokes()
    return [len(cases.timed(parts[: k + 1])[0]) - 1 for k in range(len(parts))]


@pytest.mark.parametrize("lowest_share", [None, 0.5])
def test_a_pass_at_a_tenth_of_the_feed_fails(linear, lowest_share):
    slow = cases.program_of(linear.machine, *cases.timed(cases.strokes(), feed_factor=0.098))
    found = judged(linear, slow, lowest_share=lowest_share)[FEED]
    assert not found.passed
    assert found.value < 10.0
    assert found.bound == (90.0 if lowest_share is None else 50.0)
    assert "in all" in found.method


def test_slowness_that_a_limit_explains_passes(linear):
    """The same program on a machine whose legs can hardly do more."""
    legs = linear.machine.legs
    tight = replace(linear.machine, legs=replace(legs, max_jerk=np.full(5, 1e-3)))
    assert not judged(linear, lowest_share=None)[FEED].passed
    replayed = replace(linear.program, provenance=replace(linear.program.provenance, machine_digest=tight.digest))
    found = {
        c.claim: c
        for c in verify(replayed, tight, linear.toolpath, **{**cases.ASKED, "lowest_share": None}).certificates
    }
    assert found[FEED].passed
    assert not found["leg jerks"].passed


def test_no_lowest_feed_is_judged_where_the_job_asks_for_none(linear):
    assert FEED not in judged(linear)


@pytest.mark.parametrize("share", [-0.1, 1.1, float("nan")])
def test_a_lowest_share_is_a_share(linear, share):
    with pytest.raises(ArrayError, match="lowest_share"):
        judged(linear, lowest_share=share)


@pytest.mark.parametrize("seconds", [0.1, 10.0])
def test_standing_amid_a_cut_fails(linear, seconds):
    begin, end = ends_of_strokes()[:2]
    found = judged(linear, standing(linear, (begin + end) // 2, seconds))[STOP]
    assert not found.passed
    assert found.value == pytest.approx(seconds, abs=2e-3)
    assert abs(found.where.row - (begin + end) // 2) <= 2
    assert found.where.segment == 1
    assert judged(linear)[STOP].passed


def resting_amid(case):
    """Not for long: the motion slows down to rest and goes on."""
    parts = cases.strokes()
    forth = parts[1]
    halves = [
        replace(forth, pose=lambda f: forth.pose(0.5 * f), count=31),
        replace(forth, pose=lambda f: forth.pose(0.5 + 0.5 * f), count=31),
    ]
    tips, axes = cases.timed([parts[0], *halves, *parts[2:]])
    return cases.program_of(case.machine, tips, axes, interpolation="linear")


@pytest.mark.parametrize(("stop_angle", "passed"), [(None, False), (1e-3, True), (0.1, False), (2.0, False)])
def test_coming_to_rest_amid_a_cut_fails_where_the_toolpath_does_not_turn_enough(linear, stop_angle, passed):
    """At the hill's crest: the toolpath turns there by some milliradians from waypoint to waypoint."""
    assert judged(linear, resting_amid(linear), stop_angle=stop_angle)[STOP].passed is passed


@pytest.mark.parametrize("angle", [0.0, -0.1, 4.0, float("nan")])
def test_a_stop_angle_is_an_angle(linear, angle):
    with pytest.raises(ArrayError, match="stop_angle"):
        judged(linear, stop_angle=angle)


@pytest.mark.parametrize(("dwell", "passed"), [(None, False), (0.3, False), (0.5, True), (10.0, True)])
def test_a_dwell_is_as_long_as_it_is_asked(linear, dwell, passed):
    segments = list(linear.toolpath.segments)
    segments[1] = replace(segments[1], dwell=dwell)
    asked = replace(linear, toolpath=replace(linear.toolpath, segments=tuple(segments)))
    assert judged(asked, standing(linear, ends_of_strokes()[1], 0.5))[STOP].passed is passed


REVERSAL = 6
"""The stroke that goes down to where the next one turns back."""

SLOW_ROWS = 12
"""Rows after a stop that count as rest, too."""


def turning_back(short, seconds):
    """A program that turns back `short` metres before the reversal, and rests there; and its rows at rest."""
    parts = cases.strokes()
    (above, there), axes = parts[REVERSAL].pose(np.array([0.0, 1.0]))
    low = there + short * (above - there) / np.linalg.norm(above - there)
    back = parts[REVERSAL + 1].pose(np.array([0.0, 1.0]))[0][1]
    parts[REVERSAL] = cases.straight(parts[REVERSAL].kind, np.inf, above, low, axes[1])
    parts[REVERSAL + 1] = cases.straight(parts[REVERSAL].kind, np.inf, low, back, axes[1])
    row = len(cases.timed(parts[: REVERSAL + 1])[0]) - 1
    program = cases.program_of(cases.STAND, *cases.timed(parts), interpolation="linear")
    rows = round(seconds / cases.PERIOD)
    legs = np.insert(program.legs, row, np.repeat(program.legs[row : row + 1], rows, axis=0), axis=0)
    return replace(program, legs=legs), np.arange(row, row + rows + 1)


def lagging(case, program, rows, lag):
    """The replay of a program whose matching holds its rows `lag` metres before the reversal."""
    replay = cases.replay_of(case, program)
    end = arc_length(case.toolpath.tilt_centres)[case.toolpath.starts[REVERSAL + 1]]
    match = replay.match
    arcs = match.arcs[:].copy()
    still = 2 * (rows[-1] + SLOW_ROWS)
    arcs[:still] = np.minimum(arcs[:still], end - lag)
    replay.__dict__["match"] = SimpleNamespace(**(vars(match) | {"arcs": arcs, "turned": match.turned}))
    return replay


def test_a_rest_at_a_reversal_is_asked_for_however_far_the_matching_lags(linear):
    """A matching may hold any row a little farther from its place than the path tolerance."""
    tolerance = cases.TOLERANCES["path_tolerance"]
    program, rows = turning_back(tolerance, 0.03)
    assert judged(linear, program)[STOP].passed
    assert unasked_stop(lagging(linear, program, rows, 1.0005 * tolerance)).passed
    beyond = unasked_stop(lagging(linear, program, rows, 3.0 * tolerance))
    assert not beyond.passed
    assert beyond.value == pytest.approx(0.03, abs=8e-3)


def test_a_rest_above_a_reversal_is_an_unasked_stop(linear):
    program, _ = turning_back(0.0, 0.0)
    row = ends_of_strokes()[REVERSAL - 1] + 20
    found = judged(linear, standing(replace(linear, program=program), row, 0.03))[STOP]
    assert not found.passed
    assert found.value == pytest.approx(0.03, abs=5e-3)


ROCK = np.radians(3.0)
"""Angle of a turn about the ball's centre, there and back, amid a cut."""


@pytest.fixture(scope="module")
def rocking(linear):
    """A case whose tool rocks amid its only cut, and the rows at which it begins to, turns back, and ends."""
    up, flat = np.array([0.0, 0.0, 1.0]), SegmentKind.CUT
    leaning = np.array([0.0, np.sin(ROCK), np.cos(ROCK)])
    begin, amid, end = (np.array([x, 0.0, 0.0]) for x in (-0.01, 0.0, 0.01))
    parts = [
        cases.straight(flat, cases.FEED, begin, amid, up, count=11),
        cases.turn(amid, up, leaning, 4),
        cases.turn(amid + cases.BALL * (up - leaning), leaning, up, 4),
        cases.straight(flat, cases.FEED, amid, end, up, count=11),
    ]
    tips, axes = (
        np.concatenate([part.pose(np.linspace(0.0, 1.0, part.count))[k][min(n, 1) :] for n, part in enumerate(parts)])
        for k in range(2)
    )
    toolpath = Toolpath((Segment(flat, tips, axes, cases.FEED),), tilt_centre=cases.BALL)
    program = cases.program_of(linear.machine, *cases.timed(parts), interpolation="linear")
    rows = [len(cases.timed(parts[: k + 1])[0]) - 1 for k in range(3)]
    return replace(linear, toolpath=toolpath, program=program), rows


def test_a_rest_where_only_the_legs_have_a_corner_has_a_reason(rocking):
    """The path of the ball's centre goes straight on, and the axis turns by 6 degrees in all."""
    case, _ = rocking
    assert unasked_stop(cases.replay_of(case)).passed


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
@pytest.mark.parametrize("turn", [0, 1])
def test_a_rest_amid_a_turn_on_the_spot_is_an_unasked_stop(rocking, turn, share):
    """The ball's centre is at the corner, but the legs go on as they came."""
    case, rows = rocking
    row = round(rows[turn] + share * (rows[turn + 1] - rows[turn]))
    found = unasked_stop(cases.replay_of(case, standing(case, row, 0.1)))
    assert not found.passed
    assert found.value == pytest.approx(0.1, abs=3e-3)


@pytest.mark.parametrize("short", [0.06e-3, 0.2e-3, 2e-3])
def test_a_rest_just_before_or_behind_a_corner_of_the_legs_is_an_unasked_stop(rocking, short):
    case, rows = rocking
    tips = cases.replay_of(case).tilt_centres[::2]
    away = np.linalg.norm(tips - tips[rows[0]], axis=1)
    for row in (int(np.flatnonzero(away[: rows[0]] >= short)[-1]), int(np.argmax(away[rows[2] :] >= short)) + rows[2]):
        found = unasked_stop(cases.replay_of(case, standing(case, row, 0.1)))
        assert not found.passed
        assert found.value >= 0.09


def test_a_rest_at_a_corner_of_the_legs_is_short(rocking):
    case, rows = rocking
    for row in rows:
        assert not unasked_stop(cases.replay_of(case, standing(case, row, 1.0))).passed


@pytest.mark.parametrize("steps", [1, 2, 7])
def test_motion_from_row_to_row_is_judged_alike_in_parts_and_at_once(linear, steps, monkeypatch):
    tool = ToolLimits(max_tip_acceleration=3.0, max_tip_jerk=50.0, max_axis_velocity=1.0, max_axis_acceleration=9.0)
    for machine in (linear.machine, replace(linear.machine, tool_limits=tool)):
        replay = Replay(linear.program, Specification(machine, linear.toolpath, 0.0, 2e-5, 1e-2))
        whole, speeds, stop = slowness._used(replay), speed.row_speeds(replay, 0.0), unasked_stop(replay)
        limits, governing = speed.speed_limits(replay)
        assert len(np.unique(governing)) > 3
        assert len(whole) == len(speeds) == len(linear.program.legs) - 1
        monkeypatch.setattr(slowness, "STEPS_AT_ONCE", steps)
        monkeypatch.setattr(speed, "STEPS_AT_ONCE", steps)
        assert slowness._used(replay).tolist() == whole.tolist()
        assert speed.row_speeds(replay, 0.0).tolist() == speeds.tolist()
        assert [each.tolist() for each in speed.speed_limits(replay)] == [limits.tolist(), governing.tolist()]
        assert unasked_stop(replay) == stop
        monkeypatch.undo()
    position, direction = replay.pose
    tips = (position + machine.tool_length * direction)[::2]
    by_hand = np.linalg.norm(np.diff(tips, axis=0), axis=1) / cases.PERIOD
    np.testing.assert_allclose(speeds, by_hand, rtol=1e-12, atol=1e-15)
