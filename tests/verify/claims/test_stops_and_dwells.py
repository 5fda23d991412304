"""Claims about stops, on a program whose standing is made and taken away by hand."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify import verify
from pentapod.verify.claims.stops_and_dwells import CLAIMS, dwells, exact_stops, required_stops
from pentapod.verify.replay.claim import Idle


@pytest.fixture(scope="module")
def linear():
    return cases.good_case(interpolation="linear")


def stood(case, stroke, rows, dwell):
    """The case with so many rows of standing at the end of a stroke, and a toolpath that asks for `dwell` there."""
    parts = cases.strokes()
    before = len(cases.timed(parts[: stroke + 1])[0]) - 1
    segments = list(case.toolpath.segments)
    segments[stroke] = replace(segments[stroke], dwell=dwell)
    legs = np.insert(case.program.legs, before, np.repeat(case.program.legs[before : before + 1], rows, 0), axis=0)
    return replace(case.toolpath, segments=tuple(segments)), replace(case.program, legs=legs), before


def judged(case, toolpath, program):
    verdict = verify(program, case.machine, toolpath, **cases.TOLERANCES)
    return {c.claim: c for c in verdict.certificates}


def test_nothing_is_claimed_where_no_stop_is_asked_for(linear):
    assert not {"exact stops", "dwells"} & set(judged(linear, linear.toolpath, linear.program))


@pytest.mark.parametrize("stroke", [1, 4, 8])
# Next to its stop the quintic itself moves a leg by less than counts, for a row or two.
@pytest.mark.parametrize(("rows", "passed"), [(40, True), (37, False)])
def test_a_dwell_is_held_to_its_time(linear, stroke, rows, passed):
    toolpath, program, before = stood(linear, stroke, rows, 0.040)
    found = judged(linear, toolpath, program)["dwells"]
    assert found.passed is passed
    assert found.bound == 0.040
    assert found.value == pytest.approx(rows * cases.PERIOD, abs=3e-3)
    assert abs(found.where.row - before) < 100
    assert judged(linear, toolpath, program)["exact stops"].passed


def test_of_several_dwells_the_one_that_falls_short_is_named(linear):
    toolpath, program, _ = stood(linear, 1, 60, 0.040)
    both, _, before = stood(linear, 4, 0, 0.040)
    segments = [b if a.dwell is None else a for a, b in zip(toolpath.segments, both.segments, strict=True)]
    legs = np.insert(program.legs, before + 60, np.repeat(program.legs[before + 60 : before + 61], 20, 0), axis=0)
    found = judged(linear, replace(toolpath, segments=tuple(segments)), replace(program, legs=legs))["dwells"]
    assert not found.passed
    assert found.value == pytest.approx(0.020, abs=3e-3)
    assert abs(found.where.row - before - 60) < 100


def test_a_dwell_elsewhere_does_not_count(linear):
    _, program, _ = stood(linear, 4, 60, None)
    toolpath, _, _ = stood(linear, 1, 0, 0.040)
    assert not judged(linear, toolpath, program)["dwells"].passed


def test_a_program_that_passes_on_has_no_exact_stop(linear):
    """Through the end of the first cut at the feed, by leaving out the rows about the stop."""
    toolpath, program, before = stood(linear, 1, 0, 0.0)
    assert judged(linear, toolpath, program)["exact stops"].passed
    gap = replace(program, legs=np.delete(program.legs, np.arange(before - 200, before + 200), axis=0))
    assert not judged(linear, toolpath, gap)["exact stops"].passed


@pytest.mark.parametrize("tolerances", [1.5, 5.0])
def test_a_stop_behind_the_place_is_none(linear, tolerances):
    """At full speed over the place, and standing only where the path tolerance has been left."""
    toolpath, program, before = stood(linear, 1, 0, 0.020)
    away = np.linalg.norm(linear.tips[before:] - linear.tips[before], axis=1)
    beyond = before + int(np.argmax(away > tolerances * cases.TOLERANCES["path_tolerance"]))
    legs = program.legs
    late = np.concatenate([legs[: before - 200], np.repeat(legs[beyond : beyond + 1], 60, axis=0), legs[beyond:]])
    found = judged(linear, toolpath, replace(program, legs=late))
    assert not found["exact stops"].passed
    assert found["exact stops"].value > 10.0 * found["exact stops"].bound
    assert not found["dwells"].passed


# Which rows are near a stop, on eleven rows along a line.

ARCS = (0.0, 0.1, 0.5, 0.98, 1.0, 1.02, 1.5, 1.9, 2.1, 2.9, 3.0)


def leaning(angle):
    return [0.0, np.sin(angle), np.cos(angle)]


def along(
    arcs=ARCS,
    turned=(0.0,) * 11,
    ends=(0.0, 1.0, 2.0, 3.0),
    leans=(0.0,) * 4,
    dwells=(0.2, 0.4, 0.3),
    wait=0.1,
    legs=None,
):
    """What the claims look at, of a toolpath along x with so long dwells; 0.05 m and 0.05 rad are near."""
    segments = tuple(
        Segment(
            SegmentKind.CUT,
            np.array([[ends[k], 0.0, 0.0], [ends[k + 1], 0.0, 0.0]]),
            np.array([leaning(leans[k]), leaning(leans[k + 1])]),
            0.1,
            dwell=dwells[k],
        )
        for k in range(3)
    )
    legs = np.cumsum(np.arange(11.0))[:, None] * np.array([1.0, 2.0, 1.0, 1.0, 1.0]) * 1e-3 if legs is None else legs
    acceleration = np.array([1.0, 10.0, 1.0, 1.0, 1.0])
    return cases.measured(
        Toolpath(segments, tilt_centre=0.0, wait=wait),
        cases.along_x(np.zeros(21)),
        match={"arcs": np.repeat(arcs, 2)[:-1], "turned": np.repeat(turned, 2)[:-1]},
        machine=replace(cases.STAND, legs=replace(cases.STAND.legs, max_acceleration=acceleration)),
        legs=legs,
        period=0.1,
        path_tolerance=0.05,
        axis_tolerance=0.05,
    )


def test_the_steps_near_a_stop():
    """Three rows at 1 m: both steps between; none at 2 m: the step over it; one at either end: the step beside it."""
    assert required_stops(along()) == [(0, 1, 0.1), (3, 5, 0.2), (7, 8, 0.4), (9, 10, 0.3)]
    two = (*ARCS[:4], 1.02, 1.3, *ARCS[6:])
    assert required_stops(along(two))[1] == (3, 4, 0.2)
    one = (*ARCS[:3], 0.9, 1.0, 1.1, *ARCS[6:])
    assert required_stops(along(one))[1] == (3, 5, 0.2)
    assert required_stops(along(dwells=(None, 0.4, None), wait=0.0)) == [(7, 8, 0.4)]


def test_a_turn_on_the_spot_divides_the_rows_of_one_place():
    arcs = (0.0, 0.2, 0.6, 1.0, 1.0, 1.0, 1.0, 1.0, 1.4, 1.8, 2.0)
    turned = (0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 0.6, 0.6, 0.6, 0.6, 0.6)
    stops = required_stops(along(arcs, turned, (0.0, 1.0, 1.0, 2.0), (0.0, 0.0, 0.6, 0.6)))
    assert stops == [(0, 1, 0.1), (3, 4, 0.2), (6, 7, 0.4), (9, 10, 0.3)]


def test_the_slowest_step_near_a_stop_is_its_speed():
    """The steps are k + 1 mm in row k, twice as long in the second leg, whose limit is ten times as high."""
    found = exact_stops(along())
    # Slowest near each: 1, 4, 8 and 10 mm; the last is worst: 10 mm in 0.1 s, where 1 m/s² changes 100 mm/s.
    assert (found.value, found.bound, found.unit) == (pytest.approx(100.0), pytest.approx(100.0), "mm/s")
    assert found.allowed == pytest.approx(100.1)
    assert (found.passed, found.where.row, found.where.time_s) == (True, 9, pytest.approx(0.9))
    assert found.method.startswith("largest leg speed at 4 exact stops")
    assert "of leg 1 at" in found.method
    assert not exact_stops(along(legs=along().program.legs * 1.002)).passed
    assert exact_stops(along(dwells=(None,) * 3, wait=0.0)) == Idle("the toolpath has no exact stop")


@pytest.mark.parametrize(("dwell", "passed"), [(0.2, True), (0.2 + 1e-6, False)])
def test_a_dwell_lasts_as_long_as_no_leg_moves(dwell, passed):
    """Two steps of 0.1 s about the row at 1 m; a nanometre is no movement, two are."""
    legs = along().program.legs.copy()
    legs[4:6] = legs[3] + 1e-9 * np.array([[0.5], [0.0]])
    found = dwells(along(dwells=(dwell, 0.0, None), wait=0.0, legs=legs))
    assert (found.passed, found.bound, found.unit) == (passed, dwell, "s")
    assert found.value == pytest.approx(0.2)
    assert (found.where.row, found.where.time_s) == (3, pytest.approx(0.3))
    assert found.method.startswith("dwell with the largest shortfall, of 1: ")
    assert "more than 1e-06 mm" in found.method
    moved = legs.copy()
    moved[4] += 2e-9
    assert dwells(along(dwells=(dwell, 0.0, None), wait=0.0, legs=moved)).value == 0.0
    assert dwells(along(dwells=(0.0, 0.0, 0.0), wait=0.0)) == Idle("the toolpath has no dwell")


@pytest.mark.parametrize(("asked", "value", "row"), [((0.1, 0.2), 0.0, 7), ((0.5, 0.2), 0.2, 3)])
def test_the_dwell_with_the_largest_shortfall_is_named(asked, value, row):
    """At 1 m the robot is at rest for 0.2 s, at 2 m not at all; shares of what is asked for do not count."""
    legs = along().program.legs.copy()
    legs[4:6] = legs[3]
    found = dwells(along(dwells=(*asked, None), wait=0.0, legs=legs))
    assert (found.value, found.bound, found.where.row) == (pytest.approx(value), asked[row == 7], row)


def test_stops_need_poses_but_no_proof():
    assert [(claim.name, claim.needs_pose, claim.needs_proof) for claim in CLAIMS] == [
        ("exact stops", True, False),
        ("dwells", True, False),
    ]
