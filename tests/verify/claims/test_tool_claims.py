"""Limits of the tool's own motion, judged from the program's rows: closed forms for a quintic cut that nods."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases
from scipy.interpolate import CubicSpline

from pentapod.machine.parts import ToolLimits
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify import verify

LENGTH, NOD, ROWS = 0.012, 0.3, 100
DURATION = ROWS * cases.PERIOD
# Of q(τ) = 10 τ³ − 15 τ⁴ + 6 τ⁵: largest first to third derivative.
RATE, PUSH, JOLT = 1.875, 10.0 / np.sqrt(3.0), 60.0
TRUE = {
    "tip acceleration": ("max_tip_acceleration", LENGTH * PUSH / DURATION**2, 1e3),
    "tip jerk": ("max_tip_jerk", LENGTH * JOLT / DURATION**3, 1e3),
    "axis velocity": ("max_axis_velocity", NOD * RATE / DURATION, np.degrees(1.0)),
    "axis acceleration": ("max_axis_acceleration", NOD * PUSH / DURATION**2, np.degrees(1.0)),
}


def poses(f):
    """Tips on a straight line, axes that turn by NOD about y, both in proportion to f."""
    angle = NOD * (f - 0.5)
    axes = np.stack([np.sin(angle), 0.0 * f, np.cos(angle)], axis=-1)
    return np.stack([LENGTH * (f - 0.5), 0.0 * f, 0.0 * f], axis=-1), axes


def judged(good, **limits):
    machine = replace(good.machine, tool_limits=ToolLimits(**limits))
    toolpath = Toolpath((Segment(SegmentKind.CUT, *poses(np.linspace(0.0, 1.0, 241)), 1.0),), tilt_centre=0.0)
    rows = poses(cases.quintic(np.arange(ROWS + 1) / ROWS))
    program = cases.program_of(machine, *rows, interpolation=good.program.interpolation)
    return {c.claim: c for c in verify(program, machine, toolpath, **cases.TOLERANCES, job_digest="job-1").certificates}


@pytest.fixture(params=["cubic", "linear"])
def good(request):
    return request.getfixturevalue(request.param)


def largest_jerk(interpolation):
    """Of the tip as it is joined: the true jerk begins with a step, at which splines ring and differences average."""
    t = np.arange(ROWS + 1) * cases.PERIOD
    x = LENGTH * cases.quintic(t / DURATION)
    if interpolation == "cubic":
        return np.abs(CubicSpline(t, x, bc_type="clamped")(t[:-1] + 0.5 * cases.PERIOD, 3)).max()
    return np.abs(np.diff(np.concatenate([[0.0], x, [LENGTH]]), 3)).max() / cases.PERIOD**3


@pytest.mark.parametrize("claim", TRUE)
def test_the_true_value_decides(good, claim):
    name, value, factor = TRUE[claim]
    if claim == "tip jerk":
        joined = largest_jerk(good.program.interpolation)
        assert joined == pytest.approx(value, rel=0.3)
        value = joined
    above, below = judged(good, **{name: 1.1 * value})[claim], judged(good, **{name: 0.9 * value})[claim]
    assert (above.passed, below.passed) == (True, False)
    assert below.value == pytest.approx(factor * value, rel=0.02)
    assert below.bound == pytest.approx(factor * 0.9 * value)
    assert below.allowed == pytest.approx(1.001 * below.bound, rel=1e-9)


def test_without_limits_there_are_no_claims(good):
    assert not set(judged(good)) & set(TRUE)
