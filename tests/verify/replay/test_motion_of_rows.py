"""What is computed in blocks of rows: the motion of the legs that the report draws, and vectors of samples."""

from dataclasses import replace

import numpy as np
import pytest
from replay_cases import good_case

import pentapod.verify.replay.row_forces as rows
from pentapod.geometry.interpolant import Interpolant
from pentapod.report import signals
from pentapod.verify.replay.replay import OfSamples
from pentapod.verify.replay.row_forces import ROWS_AT_ONCE


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


def test_vectors_of_samples_are_those_of_all_however_they_are_asked_for():
    """Slices of many samples are computed in blocks."""
    values = np.random.default_rng(0).normal(size=(2 * ROWS_AT_ONCE + 5, 3))
    of = OfSamples(len(values), lambda asked: 2.0 * values[asked])
    assert len(of) == len(values)
    few = np.array([7, 1, len(values) - 1])
    for asked in (slice(None), slice(3, None, 2), slice(10, 20), slice(len(values), None), few, 4, -1):
        np.testing.assert_array_equal(of[asked], 2.0 * values[asked])
