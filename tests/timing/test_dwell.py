"""Dwells: the machine stands for as long as asked, where asked, in whole periods; everything else stays as it was."""

import numpy as np
import pytest
from timing_paths import Path, machine, raster, straight

from pentapod.timing import Trajectory, certify, explain, override, retime, slow_cuts
from pentapod.timing.explain import STANDSTILL

PERIOD = 1e-3
DWELLS = (0.2, 0.1504, 0.3)


def pieces():
    first = raster(lines=3, feed=0.1)
    return first, straight([0.4, 0.1, -0.3, 0.2, 0.1], 0.03, 0.1, start=first(np.array([first.length]))[0])


def timed(m, dwells=DWELLS, between=()):
    first, second = pieces()
    trajectory = retime(Path((first, *between, second), dwells), m)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    return trajectory


@pytest.fixture(scope="module", params=["linear", "cubic"])
def case(request):
    m = machine(interpolation=request.param)
    return m, timed(m, (0.0,) * 3), timed(m)


def test_dwell_stands_as_long_as_asked_and_changes_no_motion(case):
    m, free, standing = case
    np.testing.assert_allclose(standing.dwells, [0.2, 0.151, 0.3], atol=1e-12)
    assert standing.duration == pytest.approx(free.duration + 0.651, abs=1e-9)
    t = np.arange(round(standing.duration / PERIOD) + 1) * PERIOD
    rows = standing(t)
    still = np.abs(np.diff(rows, axis=0)).max(axis=1) <= 1e-12
    for begin, seconds in zip(np.append(0.0, standing.starts[1:] - standing.dwells[1:]), standing.dwells, strict=True):
        rows = slice(round(begin / PERIOD), round((begin + seconds) / PERIOD))
        assert still[rows].all()
        assert standing.dwelling(t[rows]).all()
    assert standing.dwelling(t).sum() == round(0.651 / PERIOD) + 1  # and the last moment
    moved = np.arange(round(free.starts[1] / PERIOD) + 1) * PERIOD
    # A cubic controller's spline feels a start out of standing, and easing answers to that.
    away = 1e-12 if m.controller.interpolation == "linear" else 1e-4
    np.testing.assert_allclose(standing(moved + 0.2), free(moved), atol=away)
    assert (standing(t[[0, -1]], 1) == 0.0).all()
    shares = {use.quantity: use.share for use in certify(standing, m)}
    assert max(shares["leg velocity"], shares["leg acceleration"], shares["feed"]) <= 1.0
    assert shares["leg jerk"] <= 1.05


def test_dwells_are_explained_and_are_no_slow_cut(case):
    m, free, standing = case
    told = explain(standing, m)
    assert told.duration == pytest.approx(standing.duration)
    assert told.lower_bound == pytest.approx(explain(free, m).lower_bound)
    stood = {cause.name: cause for cause in told.causes}[STANDSTILL]
    assert stood.time == stood.cost == pytest.approx(0.651)
    slow = [sum(u.seconds for u in slow_cuts(trajectory, PERIOD)) for trajectory in (free, standing)]
    assert slow[1] == pytest.approx(slow[0], abs=6 * PERIOD)


def test_dwells_around_a_piece_of_no_length_add_up():
    first, _ = pieces()
    end = first(np.array([first.length]))[0]
    spot = straight(np.zeros(5), 0.0, start=end)
    standing = timed(machine(), (0.0, 0.1, 0.2, 0.0), (spot,))
    np.testing.assert_allclose(standing.dwells, [0.0, 0.3, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("at", "share"), [("before", 0.5), ("inner", 0.5), ("inner", 0.0), ("after", 0.5), ("moving", 0.5)]
)
def test_an_override_leaves_dwells_as_they_are(case, at, share):
    """Turned while the machine stands: it stands out its time, then goes on by the new plan."""
    m, _, standing = case
    inner = standing.starts[1] - standing.dwells[1]
    time = {"before": 0.05, "inner": inner + 0.05, "after": standing.duration - 0.1, "moving": 0.4}[at]
    result = override(standing, m, time, share)
    assert isinstance(result, Trajectory), str(result)
    t = np.arange(round(time / PERIOD) + 1) * PERIOD
    np.testing.assert_allclose(result(t), standing(t), atol=1e-12)
    assert result.duration / PERIOD == pytest.approx(round(result.duration / PERIOD), abs=1e-6)
    count = 2 if share == 0.0 else 3
    np.testing.assert_allclose(result.dwells, standing.dwells[:count], atol=1e-12)
    assert result.profile.times[-1] == pytest.approx(result.duration, abs=1e-9)
    assert (np.diff(result.profile.times) >= -1e-9).all()
    if share == 0.0:
        resumed = override(result, m, result.duration + 0.1, 1.0)
        assert isinstance(resumed, Trajectory), str(resumed)
        assert resumed.duration == pytest.approx(standing.duration + 0.1, abs=2 * PERIOD)
