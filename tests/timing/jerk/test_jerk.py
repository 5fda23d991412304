"""Jerk limits: closed forms, convergence of the passes, and limits at the interpolated setpoints."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_retime import PATHS
from timing_paths import Path, machine, straight

from pentapod.timing import Trajectory, certify, retime
from pentapod.timing.jerk.jerk_limited import JerkProblem, jerk_limited
from pentapod.timing.jerk.options import JerkOptions
from pentapod.timing.jerk.rows import JerkRows
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.topp.engine import fastest

FINE = 2.5e-4


def timed(path, m, **options):
    result = retime(path, m, **options)
    assert isinstance(result, Trajectory), str(result)
    return result


def seven_phases(distance, v, a, j):
    """Duration from rest to rest, in closed form, where the top speed is reached."""
    ramp = v / a + a / j if v * j >= a * a else 2 * np.sqrt(v / j)
    assert distance >= v * ramp
    return distance / v + ramp


@pytest.mark.parametrize(("v", "a", "j"), [(0.2, 5.0, 200.0), (0.1, 5.0, 100.0), (0.3, 2.0, 500.0)])
@pytest.mark.parametrize("slope", [1.0, 0.1])
def test_straight_path_takes_the_time_of_seven_phases(v, a, j, slope):
    m = machine(v=v, a=a, rapid=99.0, period=FINE)
    m.legs.max_jerk.flags.writeable = True
    m.legs.max_jerk[:] = j
    path = Path((straight([0, slope, 0, 0, 0], 0.2 / slope),))
    trajectory = timed(path, m)  # whose margins cost 0.3 %
    expected = seven_phases(0.2, v, a, j)
    assert expected < trajectory.duration < 1.01 * expected


@settings(max_examples=12, deadline=None)
@given(length=st.floats(-6, 1), j=st.floats(1, 4))
def test_short_straight_path_takes_the_time_of_four_phases(length, j):
    """Where neither speed nor acceleration is reached, T = 4 (D / 2 j)^(1/3)."""
    length, j = 10.0**length, 10.0**j
    m = machine(v=1e3, a=1e4, rapid=1e3, period=1e-3)
    m.legs.max_jerk.flags.writeable = True
    m.legs.max_jerk[:] = j
    expected = 4 * (length / 2 / j) ** (1 / 3)
    # Of so many periods that rounding setpoints takes no more than a hundredth of the jerk.
    count = min(2000, int((0.01 * 32 * length / 4e-11) ** (1 / 3)))
    m.controller = type(m.controller)(expected / count, "linear")
    trajectory = timed(
        Path((straight([0, 1, 0, 0, 0], length, start=0.0),)), m
    )  # third differences of 0.8 m would be rounding
    assert expected < trajectory.duration < (1.02 + 1.5 / count) * expected


@pytest.mark.parametrize("interpolation", [pytest.param("linear", marks=pytest.mark.slow), "cubic"])
@pytest.mark.parametrize("name", PATHS)
def test_sampled_program_keeps_every_limit(name, interpolation):
    m = machine(interpolation=interpolation)
    trajectory = timed(Path((PATHS[name](),)), m)
    use = {u.quantity: u.share for u in certify(trajectory, m)}
    assert use["leg jerk"] < 1.0
    assert max(use["leg velocity"], use["leg acceleration"], use["feed"]) < 1.0
    assert max(use.values()) > 0.97
    # By finite differences of the setpoints, which know nothing of splines: over three periods jerk is averaged.
    rows = trajectory(np.arange(round(trajectory.duration / 1e-3) + 1) * 1e-3)
    still = np.concatenate([np.repeat(rows[:1], 3, 0), rows, np.repeat(rows[-1:], 3, 0)])
    assert np.abs(np.diff(still, 3, axis=0)).max() / 1e-9 < 1.06 * m.legs.max_jerk[0]
    assert np.array_equal(trajectory([trajectory.duration])[0], PATHS[name]()(np.array([PATHS[name]().length]))[0])


def rows_of(piece, m):
    a, j = m.legs.max_acceleration, m.legs.max_jerk

    def at(s):
        q1, q2, q3 = (piece(s, k) for k in (1, 2, 3))
        ceiling = np.minimum(piece.section_feeds[0], (m.legs.max_velocity / np.abs(q1)).min(1)) ** 2
        jerks = np.stack([q3 / j, 1.5 * q2 / j, 0.5 * q1 / j], axis=-1)
        return JerkRows(q1 / a, q2 / a, np.zeros((1, 5)), jerks, ceiling)

    return at


@pytest.mark.parametrize("name", ["nod", "raster"])
def test_passes_shorten_the_law_and_keep_its_limits(name):
    m, piece = machine(), PATHS[name]()
    s = np.unique(np.concatenate([np.linspace(0, piece.length, 2000), piece.knots]))
    rows = rows_of(piece, m)
    here = rows(s)
    x = fastest(s, here.first, here.second, here.ceiling)
    laws = []
    for passes in (1, 2, 3, 8):
        p = jerk_limited(JerkProblem(s, x, rows, piece.knots, JerkOptions(passes=passes))).nodes
        law = p.law()
        laws.append(law)
        at = rows(p.s[1:-1])
        bend = np.gradient(p.slope, p.s)[1:-1]
        v = np.stack([p.x[1:-1], p.slope[1:-1], bend], axis=-1)
        jerk = np.sqrt(v[:, :1]) * np.einsum("nkd,nd->nk", at.jerks, v)
        assert np.quantile(np.abs(jerk).max(axis=1), 0.98) < 1.02  # x″ by differences is rough at knots
        push = at.first * 0.5 * v[:, 1:2] + at.second * v[:, :1]
        assert np.abs(push).max() < 1.005
        assert np.abs(push[::2]).max() < 1.0 + 1e-5  # at the gridpoints; the others are between them
    durations = [law.duration for law in laws]
    assert (np.diff(durations) <= 1e-5 * durations[-1]).all()
    assert durations[1] < 1.02 * durations[-1]
    below = MotionLaw.from_profile(s, x).duration
    assert below < durations[-1]


@pytest.mark.parametrize("seed", range(3))
def test_law_through_nodes_keeps_stations_speeds_and_slopes(seed):
    rng = np.random.default_rng(seed)
    s = np.concatenate([[0.0], np.cumsum(rng.uniform(0.01, 0.02, 40))])
    x = 1.0 + 0.3 * np.sin(6 * s)
    x[[0, -1]] = 0.0
    slopes = 1.8 * np.cos(6 * s)
    slopes[0] = 0.0
    slopes[-1] = 0.0
    law = MotionLaw.through(s, x, slopes)
    knots = law.times[::2]
    assert np.allclose(law(knots), s, rtol=1e-12)
    inner = law.times[1:-1]
    assert np.allclose(law(knots[1:-1], 1) ** 2, x[1:-1], rtol=1e-9)
    assert np.allclose(law(knots[1:-1], 2), 0.5 * slopes[1:-1], rtol=1e-9)
    h = 1e-9
    for order in (0, 1, 2):
        assert np.allclose(law(inner - h, order), law(inner, order), atol=1e-5)
    t = np.linspace(0, law.duration, 5001)[1:-1]
    away = np.abs(t[:, None] - law.times).min(1) > 2e-5
    for order in (0, 1):
        slope = (law(t + 1e-5, order) - law(t - 1e-5, order)) / 2e-5
        assert np.allclose(slope[away], law(t[away], order + 1), rtol=1e-5, atol=1e-6)
