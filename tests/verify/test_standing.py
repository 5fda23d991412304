"""Claims about stops, on a program whose standing is made and taken away by hand."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.verify import verify


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
