"""Jerk-limited laws against collocation in time, solved by IPOPT, on short paths at every pair of limits."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from limit_matrix import ACCELERATIONS, JERKS, Known
from timing_paths import Path, machine

from pentapod.timing import Trajectory, retime
from pentapod.timing.limits.limits import Limits

pytestmark = pytest.mark.slow

INTERVALS = 120
PERIOD = 1e-3


class Sines:
    """Legs that are sums of two sines each, the same for numbers and for casadi's symbols."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.pulse = np.exp(rng.uniform(np.log(20.0), np.log(120.0), (5, 2)))
        self.phase = rng.uniform(0.0, 2.0 * np.pi, (5, 2))
        self.size = rng.uniform(0.2, 0.8, (5, 2)) / self.pulse * np.array([1.0, 0.4])
        self.slope = rng.uniform(-1.0, 1.0, 5)
        self.length = float(rng.uniform(0.05, 0.1))

    def legs(self, s, order):
        w = self.pulse * s[:, None, None] + self.phase + 0.5 * np.pi * order
        straight = 0.8 + np.outer(s, self.slope) if order == 0 else self.slope * (order == 1)
        return (self.size * self.pulse**order * np.sin(w)).sum(axis=2) + straight

    def leg(self, i, s, order):
        """Return a leg's derivative (order 1, 2, 3) by s at symbolic stations."""
        waves = (
            float(self.size[i, k] * self.pulse[i, k] ** order)
            * ca.sin(float(self.pulse[i, k]) * s + float(self.phase[i, k] + 0.5 * np.pi * order))
            for k in range(2)
        )
        return sum(waves) + float(self.slope[i]) * (order == 1)


def optimum(path, limits, feed, law):
    """The shortest time with a constant path jerk in each interval, limits kept at its ends and its middle."""
    n, (velocity, acceleration, jerk) = INTERVALS, limits
    s, v, a = (ca.MX.sym(name, n + 1) for name in "sva")
    j, total = ca.MX.sym("j", n), ca.MX.sym("T")
    h = total / n
    s0, v0, a0 = s[:-1], v[:-1], a[:-1]
    still = [
        s[1:] - (s0 + h * v0 + h**2 * a0 / 2 + h**3 * j / 6),
        v[1:] - (v0 + h * a0 + h**2 * j / 2),
        a[1:] - a0 - h * j,
    ]
    bounded = []
    for share in (0.0, 0.5, 1.0):
        t = share * h
        at, speed, push = s0 + t * v0 + t**2 * a0 / 2 + t**3 * j / 6, v0 + t * a0 + t**2 * j / 2, a0 + t * j
        for i in range(5):
            one, two, three = (path.leg(i, at, order) for order in (1, 2, 3))
            bounded.append(one * speed / float(velocity[i]))
            bounded.append((one * push + two * speed**2) / float(acceleration[i]))
            bounded.append((three * speed**3 + 3 * two * speed * push + one * j) / float(jerk[i]))
    g, rows = ca.vertcat(*still, *bounded), sum(x.numel() for x in still)
    solver = ca.nlpsol(
        "law", "ipopt", {"x": ca.vertcat(s, v, a, j, total), "f": total, "g": g},
        {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0, "ipopt.max_iter": 500, "expand": True},
    )  # fmt: skip
    t = np.linspace(0.0, law.duration, n + 1)
    known = [law(t), law(t, 1), law(t, 2), np.diff(law(t, 2)) * n / law.duration, [law.duration]]
    low = [np.zeros(n + 1), np.zeros(n + 1), np.full(n + 1, -np.inf), np.full(n, -np.inf), [0.3 * law.duration]]
    high = [np.full(n + 1, path.length), np.full(n + 1, feed), np.full(n + 1, np.inf), np.full(n, np.inf), [np.inf]]
    for k, begin, end in ((0, 0.0, path.length), (1, 0.0, 0.0), (2, 0.0, 0.0)):
        low[k][0] = high[k][0] = begin
        low[k][-1] = high[k][-1] = end
    side = np.concatenate([np.zeros(rows), np.ones(g.numel() - rows)])
    found = solver(x0=np.concatenate(known), lbx=np.concatenate(low), ubx=np.concatenate(high), lbg=-side, ubg=side)
    assert solver.stats()["success"], solver.stats()["return_status"]
    return float(found["f"])


@pytest.mark.parametrize("acceleration", ACCELERATIONS)
@pytest.mark.parametrize("jerk", JERKS)
@pytest.mark.parametrize("seed", [1, 2])
def test_laws_are_within_one_percent_of_collocation(seed, jerk, acceleration):
    path = Sines(seed)
    m = machine(a=acceleration, rapid=1e3, interpolation="cubic", period=PERIOD)
    m.legs = replace(m.legs, max_jerk=np.full(5, jerk))
    knots = np.linspace(0.0, path.length, 201)[1:-1]
    trajectory = retime(Path((Known(path.legs, path.length, inner_knots=knots),)), m)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    velocity, acceleration, jerk, _, rapid, *_ = Limits.of(m, 0.002, 0.005, 0.0).of_machine
    limits = velocity.limit, acceleration.limit, jerk.limit
    assert trajectory.duration <= 1.01 * optimum(path, limits, rapid.limit.item(), trajectory.laws[0]) + PERIOD
