"""The motion of the legs in blocks of rows, which the report draws, against one spline through all rows."""

from dataclasses import replace

import pytest
from replay_cases import good_case

import pentapod.verify.replay.row_forces as rows
from pentapod.geometry.interpolant import Interpolant
from pentapod.report import signals


@pytest.mark.parametrize("interpolation", ["cubic", "linear"])
@pytest.mark.parametrize("block", [1, 7, 1 << 20])
def test_the_motion_that_the_report_draws_is_that_of_one_spline(interpolation, block, monkeypatch):
    monkeypatch.setattr(rows, "ROWS_AT_ONCE", block)
    whole = good_case(interpolation=interpolation).program
    program = replace(whole, legs=whole.legs[:200])
    spline = Interpolant.through(program.legs, program.period, interpolation)
    rates, accelerations = signals._motion(program)
    assert rates.tolist() == spline.first.tolist()
    assert accelerations.tolist() == spline.second.tolist()
