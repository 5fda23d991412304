"""Durations do not rise with looser limits, and setpoints keep the jerk limit as stated."""

from dataclasses import replace

import numpy as np
import pytest
from test_retime import PATHS
from timing_paths import Path, machine

from pentapod.timing import Trajectory, certify, retime

PERIOD = 1e-3


def timed(name, acceleration, jerk):
    m = machine(a=acceleration, interpolation="cubic")
    m.legs = replace(m.legs, max_jerk=np.full(5, float(jerk)))
    trajectory = retime(Path((PATHS[name](),)), m)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    shares = {use.quantity: use.share for use in certify(trajectory, m)}
    assert max(shares["leg jerk"], shares["leg acceleration"], shares["leg velocity"]) < 1.0
    return trajectory.duration


@pytest.mark.parametrize("name", ["nod", "raster"])
@pytest.mark.parametrize("jerk", [200.0, pytest.param(1000.0, marks=pytest.mark.slow)])
def test_durations_do_not_rise_with_the_acceleration_limit(name, jerk):
    durations = np.array([timed(name, a, jerk) for a in (5.0, 20.0, 50.0)])
    assert (np.diff(durations) <= 1e-3 * durations[:-1] + PERIOD).all()
