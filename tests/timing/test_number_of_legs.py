"""`retime` with any number of legs: limits hold on the setpoints as scipy's spline joins them, for 3, 5 and 6 legs."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from timing_paths import Path, Piece, machine

from pentapod.timing import Trajectory, certify, explain, override, retime


def waving(legs):
    """Legs that are sums of two waves each, with sizes and phases of their own."""
    rng = np.random.default_rng(legs)
    size, phase = rng.uniform(0.005, 0.015, (2, legs)), rng.uniform(0.0, 6.0, (2, legs))
    wave = 2.0 * np.pi * rng.uniform(8.0, 20.0, (2, legs))

    def at(s):
        turns = wave[:, None] * s[:, None] + phase[:, None]
        return (
            0.8 + (size[:, None] * np.sin(turns)).sum(axis=0),
            ((size * wave)[:, None] * np.cos(turns)).sum(axis=0),
            -((size * wave**2)[:, None] * np.sin(turns)).sum(axis=0),
        )

    return Piece(at, 0.1, 0.2, inner_knots=tuple(np.linspace(0.0, 0.1, 42)[1:-1]))


def limited(legs, interpolation):
    """A machine whose legs have limits of their own."""
    m, share = machine(interpolation=interpolation), np.linspace(1.0, 0.6, legs)
    m.legs = SimpleNamespace(max_velocity=0.3 * share, max_acceleration=4.0 * share, max_jerk=300.0 * share)
    return m


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
@pytest.mark.parametrize("legs", [3, 5, 6])
def test_limits_of_any_number_of_legs_hold(legs, interpolation):
    m, path = limited(legs, interpolation), Path((waving(legs),))
    trajectory = retime(path, m)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    t = np.arange(round(trajectory.duration / 1e-3) + 1) * 1e-3
    rows = trajectory(t)
    assert rows.shape == (len(t), legs)
    if interpolation == "cubic":
        spline = CubicSpline(t, rows, bc_type="clamped")
        found = spline(np.linspace(0.0, t[-1], 10 * len(t)), 1), spline(t, 2), spline(t[:-1] + 5e-4, 3)
    else:
        steps = np.concatenate([0 * rows[:1], np.diff(rows, axis=0), 0 * rows[:1]])
        found = steps / 1e-3, np.diff(steps, axis=0) / 1e-6, np.diff(steps, 2, axis=0) / 1e-9
    limits = m.legs.max_velocity, m.legs.max_acceleration, m.legs.max_jerk
    shares = [np.abs(y / limit).max(axis=0) for y, limit in zip(found, limits, strict=True)]
    assert [share.shape for share in shares] == [(legs,)] * 3
    assert max(share.max() for share in shares) <= 1.001
    assert max(share.max() for share in shares) > 0.97
    uses = {use.quantity: use for use in certify(trajectory, m)}
    quantities = ("leg velocity", "leg acceleration", "leg jerk")
    assert [uses[name].share for name in quantities] == pytest.approx([share.max() for share in shares], rel=2e-3)
    assert [uses[name].leg for name in quantities] == [int(share.argmax()) + 1 for share in shares]
    names = {cause.name for cause in explain(trajectory, m).causes}
    assert names <= {
        *(f"leg {k + 1} {what}" for what in ("velocity", "acceleration", "jerk") for k in range(legs)),
        "feed",
    }


def test_an_override_of_six_legs_keeps_their_limits():
    m = limited(6, "cubic")
    trajectory = retime(Path((waving(6),)), m)
    slower = override(trajectory, m, 0.2, 0.5)
    assert isinstance(slower, Trajectory), str(slower)
    uses = {use.quantity: use.share for use in certify(slower, m)}
    assert max(uses["leg velocity"], uses["leg acceleration"]) <= 1.0 + 1e-6
