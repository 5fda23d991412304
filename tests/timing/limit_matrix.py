"""Paths and pairs of limits at which durations must not rise: lines, corners, raster turns, sums of sines."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.interpolate import make_interp_spline
from timing_paths import Piece

ACCELERATIONS = (5.0, 7.0, 10.0, 20.0, 50.0)
JERKS = (200.0, 400.0, 1000.0, 5000.0)

ANGLES = np.radians([0, 72, 144, 216, 288])
BASE = np.column_stack([0.9 * np.cos(ANGLES), 0.9 * np.sin(ANGLES), [0.9, 1.0, 0.8, 0.95, 0.85]])
HEIGHT = np.array([0.15, 0.25, 0.35, 0.45, 0.55])


class Known(Piece):
    """A piece whose derivatives are known up to the third: legs(s, order) -> (n, 5)."""

    def __call__(self, s, order=0):
        return self.legs(np.asarray(s, float), order)


def line(length):
    rate = np.array([1.0, 0.8, -0.6, 0.3, -0.9])

    def legs(s, order):
        return 0.8 + np.outer(s, rate) if order == 0 else np.tile(rate * (order == 1), (len(s), 1))

    return Known(legs, length)


def through(tip, axis, feed):
    """Return the legs' spline of degree 7 through tips and axes (n, 3)."""
    axis = axis / np.linalg.norm(axis, axis=1)[:, None]
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tip, axis=0), axis=1))])
    lengths = np.linalg.norm(tip[:, None] + HEIGHT[:, None] * axis[:, None] - BASE, axis=2)
    spline = make_interp_spline(s, lengths, k=7)
    known = [spline, *(spline.derivative(order) for order in (1, 2, 3))]
    return Known(lambda at, order: known[order](np.clip(at, 0.0, s[-1])), float(s[-1]), feed, inner_knots=s[1:-1])


def step(u):
    u = np.clip(u, 0.0, 1.0)
    return u**4 * (35.0 - 84.0 * u + 70.0 * u**2 - 20.0 * u**3)


def walked(stations, heading):
    """Return x and y (n,) of a way with these headings (n,) in radians."""
    middle, ds = (heading[1:] + heading[:-1]) / 2.0, np.diff(stations)
    return (np.concatenate([[0.0], np.cumsum(ds * f(middle))]) for f in (np.cos, np.sin))


def corner(radius, arm=0.02):
    """A line, a corner of 90° rounded over a few radii, an arc of 20 mm radius."""
    width = 2.0 * radius
    ends = (arm - 3.0 * width, arm + 4.0 * width)
    rows = np.concatenate(
        [np.arange(0.0, ends[0], 4e-4), np.arange(*ends, width / 12.0), np.arange(ends[1], 2.0 * arm, 4e-4)]
    )
    fine = np.unique(np.concatenate([np.linspace(a, b, 41) for a, b in pairwise(rows)]))
    beyond = np.maximum(fine - arm - width, 0.0)
    x, y = walked(fine, np.pi / 2.0 * step((fine - arm) / width) + beyond**4 / (beyond**3 + 2e-9) / 0.02)
    at = np.searchsorted(fine, rows - 1e-12)
    tip = np.column_stack([x, y, 0.0 * x])[at]
    return through(tip, np.column_stack([0.2 * np.sin(8 * x), 0.1 * np.cos(5 * y), 1.0 + 0.0 * x])[at], 0.2)


def turns(radius, row=0.02, count=2):
    """Rows on a wavy surface, joined by turns whose curvature rises and falls smoothly."""
    half = np.pi * radius * 1.6
    fine = np.arange(0.0, count * (row + half) + row, radius / 128.0)
    sign = np.where(np.arange(count) % 2 == 0, np.pi, -np.pi)
    x, y = walked(fine, sum(sign[k] * step((fine - row - k * (row + half)) / half) for k in range(count)))
    wave = 2.0 * np.pi * x / 0.03
    tip = np.column_stack([x, y, 0.003 * np.sin(wave)])[::8]
    return through(tip, np.column_stack([-0.1 * np.cos(wave), 0.0 * x, 1.0 + 0.0 * x])[::8], 0.1)


def waves(seed):
    """Legs that are sums of three sines each, lengths 20 mm to 1.3 m."""
    rng = np.random.default_rng(seed)
    pulse, phase = np.exp(rng.uniform(np.log(5.0), np.log(300.0), (5, 3))), rng.uniform(0.0, 2.0 * np.pi, (5, 3))
    size = rng.uniform(0.2, 0.8, (5, 3)) / pulse * np.array([1.0, 0.5, 0.3])
    slope, length = rng.uniform(-1.0, 1.0, 5), float(rng.uniform(0.1, 0.4))
    feed = float(rng.choice([np.inf, 0.1, 0.3]))

    def legs(s, order):
        w = pulse * s[:, None, None] + phase + 0.5 * np.pi * order
        straight = 0.8 + np.outer(s, slope) if order == 0 else slope * (order == 1)
        return (size * pulse**order * np.sin(w)).sum(axis=2) + straight

    knots = np.linspace(0.0, length, 401)[1:-1]
    return Known(legs, length, feed, inner_knots=knots)


MATRIX = {
    **{f"line {1e3 * length:g} mm": lambda length=length: line(length) for length in (0.05, 0.001)},
    **{f"corner {1e6 * radius:g} µm": lambda radius=radius: corner(radius) for radius in (1e-3, 1e-4, 2e-5)},
    **{f"turns {1e3 * radius:g} mm": lambda radius=radius: turns(radius) for radius in (1e-3, 2e-4)},
    **{f"waves {seed}": lambda seed=seed: waves(seed) for seed in range(1, 21)},
}
