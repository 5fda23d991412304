"""Paths with exact derivatives for the timing tests, and machines with limits to choose."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from types import SimpleNamespace

import numpy as np

from pentapod.machine.drives import DriveForces
from pentapod.machine.parts import ControllerSettings, LegLimits, ToolLimits
from pentapod.toolpath.toolpath import SegmentKind

BASE = np.array([[-0.5, -0.1], [-0.1, 0.45], [0.05, -0.5], [0.3, 0.3], [0.5, -0.2]])
OFFSETS = 0.4 * BASE[:, 0]


def machine(v=0.5, a=5.0, rapid=0.3, period=1e-3, interpolation="linear", **tool):
    legs = LegLimits(*(np.broadcast_to(np.asarray(x, float), (5,)) for x in (0.1, 2.0, v, a, 200.0)))
    controller = ControllerSettings(period, interpolation)
    limits = {"tool_limits": ToolLimits(**tool), "drive_forces": DriveForces()}
    return SimpleNamespace(legs=legs, rapid_velocity=rapid, controller=controller, **limits)


@dataclass
class Piece:
    """Legs from a function legs(s) -> (q, q', q''), with sections [(end, feed, kind, segment)]."""

    legs: object
    length: float
    feed: float = np.inf
    sections: list = field(default_factory=list)
    inner_knots: tuple = ()
    rate: object = np.ones_like

    def __post_init__(self):
        sections = self.sections or [
            (self.length, self.feed, SegmentKind.RAPID if np.isinf(self.feed) else SegmentKind.CUT, 0)
        ]
        self.section_ends = np.array([s[0] for s in sections], float)
        self.section_feeds = np.array([s[1] for s in sections], float)
        self.section_kinds = tuple(s[2] for s in sections)
        self.section_segments = np.array([s[3] for s in sections])
        self.knots = np.array([0.0, *self.inner_knots, self.length])
        self.waypoint_stations, self.waypoints = self.knots, np.arange(len(self.knots))

    def feed_rate(self, s):
        return np.broadcast_to(self.rate(np.asarray(s, float)), np.shape(s))

    def __call__(self, s, order=0):
        return self.derivative(self.legs, np.asarray(s, float), order)

    def derivatives(self, s, order):
        return [self(s, k) for k in range(order + 1)]

    def pose(self, s, order=0):
        return tuple(self.derivative(function, np.asarray(s, float), order) for function in self.legs.tool)

    def derivative(self, function, s, order):
        if order < 3:
            return function(s)[order]
        # The third derivative by differences of the exact second, well inside the interval between knots.
        k = np.clip(np.searchsorted(self.knots, s, side="right") - 1, 0, len(self.knots) - 2)
        h = 1e-4 * (self.knots[k + 1] - self.knots[k])
        middle = np.clip(s, self.knots[k] + h, self.knots[k + 1] - h)
        return (function(middle + h)[2] - function(middle - h)[2]) / (2 * h)[:, None]


@dataclass
class Path:
    pieces: tuple
    standing: tuple = ()

    @property
    def dwells(self):
        return np.array(self.standing or (0.0,) * (len(self.pieces) + 1))

    @property
    def starts(self):
        return np.concatenate([[0.0], np.cumsum([p.length for p in self.pieces])])


def straight(direction, length, feed=np.inf, start=0.8, **more):
    """Legs that change linearly with s."""
    d = np.asarray(direction, float)
    begin = np.broadcast_to(np.asarray(start, float), (5,))

    def legs(s):
        return begin + s[:, None] * d, np.broadcast_to(d, (len(s), 5)), np.zeros((len(s), 5))

    return Piece(legs, length, feed, **more)


def by_tip(tip, axis=None, tool=0.2):
    """Pentapod legs for tip(s) -> three (n, 3), axis(s) -> likewise (tip → spindle)."""

    def upright(s):
        z = np.zeros((len(s), 3))
        return z + np.array([0.0, 0.0, -1.0]), z, z

    def legs(s):
        t, a = tip(s), (axis or upright)(s)
        d0, d1, d2 = (t[k][:, None] + (tool - OFFSETS)[:, None] * a[k][:, None] for k in range(3))
        d0 = d0.copy()
        d0[..., :2] -= BASE
        q = np.linalg.norm(d0, axis=2)
        q1 = (d0 * d1).sum(2) / q
        return q, q1, ((d1 * d1).sum(2) + (d0 * d2).sum(2) - q1**2) / q

    legs.tool = tip, axis or upright
    return legs


def circle(radius=0.05, centre=(0.0, 0.0, 0.9)):
    def tip(s):
        w = s / radius
        c, k, z = np.cos(w), np.sin(w), 0.0 * w
        p = radius * np.stack([c, k, z], 1) + centre
        return p, np.stack([-k, c, z], 1), np.stack([-c, -k, z], 1) / radius

    return tip


def line(direction=(1.0, 0.0, 0.0), start=(-0.05, 0.02, 0.9)):
    u = np.asarray(direction, float) / np.linalg.norm(direction)

    def tip(s):
        z = np.zeros((len(s), 3))
        return s[:, None] * u + start, z + u, z

    return tip


def nodding(wavelength=0.02, amplitude=0.1):
    """A tool axis that nods in the xz plane: lively leg accelerations at little tip speed."""

    def axis(s):
        k = 2 * np.pi / wavelength
        f, f1, f2 = amplitude * np.sin(k * s), amplitude * k * np.cos(k * s), -amplitude * k * k * np.sin(k * s)
        c, n, o = np.cos(f), np.sin(f), 0.0 * f
        a = np.stack([n, o, -c], 1)
        a1 = np.stack([c, o, n], 1)
        return a, a1 * f1[:, None], a1 * f2[:, None] - a * (f1**2)[:, None]

    return axis


def raster(lines=6, width=0.04, pitch=0.003, feed=0.05, corner=0.0015):
    """One piece: a zigzag whose U-turns are half circles, curvature blended by clothoid-like ramps."""
    turn = np.pi * pitch / 2
    ramp = min(corner, 0.4 * turn)
    # Curvature profile per turn: up over `ramp`, flat, down over `ramp`; area π.
    flat = turn - ramp
    kappa = np.pi / (ramp + flat)
    knots, values, s = [0.0], [0.0], 0.0
    for k in range(lines):
        s += width
        knots.append(s)
        values.append(0.0)
        if k < lines - 1:
            sign = 1.0 if k % 2 == 0 else -1.0
            for step, value in ((ramp, kappa), (flat, kappa), (ramp, 0.0)):
                s += step
                knots.append(s)
                values.append(sign * value)
    knots, values = np.array(knots), np.array(values)
    # Integrate heading and position on a fine grid, then interpolate by exact derivatives (heading exact).
    heading_at = np.concatenate([[0.0], np.cumsum(np.diff(knots) * (values[:-1] + values[1:]) / 2)])

    def heading(x):
        i = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2)
        t = x - knots[i]
        slope = (values[i + 1] - values[i]) / (knots[i + 1] - knots[i])
        return heading_at[i] + values[i] * t + slope * t * t / 2

    fine = np.unique(np.concatenate([np.linspace(a, b, 60) for a, b in pairwise(knots)]))
    nodes, weights = np.polynomial.legendre.leggauss(6)

    def integral(a, b):
        x = (a + b)[:, None] / 2 + (b - a)[:, None] / 2 * nodes
        h = heading(x.ravel()).reshape(x.shape)
        w = weights * (b - a)[:, None] / 2
        return np.stack([(np.cos(h) * w).sum(1), (np.sin(h) * w).sum(1)], 1)

    at = np.concatenate([[[0.0, 0.0]], np.cumsum(integral(fine[:-1], fine[1:]), axis=0)])

    def tip(x):
        i = np.clip(np.searchsorted(fine, x, side="right") - 1, 0, len(fine) - 2)
        h, c = heading(x), np.interp(x, knots, values)
        o = 0.0 * x
        p = np.column_stack([at[i] + integral(fine[i], x), o]) + np.array([-width / 2, 0.0, 0.9])
        t = np.stack([np.cos(h), np.sin(h), o], 1)
        return p, t, c[:, None] * np.stack([-np.sin(h), np.cos(h), o], 1)

    return Piece(by_tip(tip), float(knots[-1]), feed, inner_knots=tuple(knots[1:-1]))


def used(trajectory, m, samples=200_001):
    """Largest shares of leg velocity and acceleration limits, on dense samples of the exact trajectory."""
    t = np.linspace(0.0, trajectory.duration, samples)
    v = np.abs(trajectory(t, 1)) / m.legs.max_velocity
    a = np.abs(trajectory(t, 2)) / m.legs.max_acceleration
    return v.max(), a.max()


def used_by_rows(trajectory, m):
    """Largest shares under linear interpolation between setpoints: first and second differences."""
    dt = m.controller.period
    t = np.minimum(np.arange(round(trajectory.duration / dt) + 1) * dt, trajectory.duration)
    q = trajectory(t)
    q = np.concatenate([q[:1], q, q[-1:]])
    v = np.abs(np.diff(q, axis=0)) / dt / m.legs.max_velocity
    a = np.abs(np.diff(q, 2, axis=0)) / dt**2 / m.legs.max_acceleration
    return v.max(), a.max(), np.diff(trajectory.station(t)).max() / dt
