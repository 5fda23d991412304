"""How hard a leg can be pushed at all by a law with bounded jerk, whatever its acceleration limit is.

A leg that accelerates by α with jerks up to J has changed its velocity by α² / 2J on either side of that moment, within
α / J. So α ≤ √(J Δv), where Δv is the spread of the velocities that the speed limits leave it within that reach. No law
within the jerk limits is lost by this; and above it a looser acceleration limit changes nothing.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.base.arrays import Floats

_ROUNDS = 2
_MOST_CELLS = 400_000
_LEAST = 1e-3
"""Share of an acceleration limit below which there is no cap: a leg that rests at gridpoints may move between them."""


def acceleration_caps(
    s: Floats, one: Floats, ceiling: Floats, acceleration: Floats, jerk: Floats, *, moving: bool
) -> Floats:
    """Return accelerations (N + 1, R), at most those given (R,), that a law within the jerks (R,) does not exceed.

    one (N + 1, R): the legs' derivatives by s; ceiling (N + 1,): bounds of ṡ². moving: whether the path goes on beyond
    an end, where only what is on one side of a moment counts.
    """
    velocities = one * np.sqrt(ceiling)[:, None]
    sides = 2.0 if moving else 1.0
    caps = np.broadcast_to(acceleration, one.shape).astype(np.float64)
    for _ in range(_ROUNDS):  # lower accelerations take less time to reach, in which less else is reached
        reach = float(np.sqrt(ceiling.max()) * (caps / jerk).max())
        caps = np.minimum(caps, np.sqrt(sides * jerk * _spread(s, velocities, reach)))
    return np.maximum(caps, _LEAST * acceleration)


def _spread(s: Floats, velocities: Floats, reach: float) -> Floats:
    """Return the spread (N + 1, R) of velocities between rest and these, within `reach` metres of each station."""
    length = float(s[-1])
    least = 20 * len(s) + 64
    cells = int(min(max(64.0, 4.0 * np.ceil(length / reach)), least, _MOST_CELLS))
    cell = np.minimum((s * (cells / length)).astype(np.intp), cells - 1)
    middles = (np.arange(cells) + 0.5) * (length / cells)
    width = 2 * int(min(np.ceil(reach * cells / length) + 1.0, cells)) + 1
    spread = np.empty_like(velocities)
    for leg, velocity in enumerate(velocities.T):
        total = np.zeros(len(s))
        for speed in (np.maximum(velocity, 0.0), np.maximum(-velocity, 0.0)):
            most = np.interp(middles, s, speed)
            np.maximum.at(most, cell, speed)
            total += maximum_filter1d(most, width, mode="nearest")[cell]
        spread[:, leg] = np.maximum(total, np.finfo(float).tiny)
    return spread
