"""Resolution of leg lengths in programs: 1e-8 mm.

A length is a count k of quanta of 1e-8 mm. In memory it is the float nearest to k · 1e-11 m, in a file the decimal
digits of k, so sampled, written and read lengths are the same bits. The quantum is that small because controllers and
the verdict take second differences: at a period of 0.1 ms half a quantum is 0.002 m/s².
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats
from pentapod.base.errors import ProgramError
from pentapod.machine.rounding import QUANTA_PER_M

QUANTA_PER_MM = 1e8
MM_DECIMALS = 8
LARGEST_M = 10_000.0
"""Beyond it counts approach 2^53 and are no longer exact."""


def quantised(legs: ArrayLike) -> Floats:
    """Return leg lengths (..., n_legs) in metres rounded to the resolution; idempotent. Raises ProgramError."""
    return _counts(as_floats(legs, "legs", (None,)), QUANTA_PER_M) / QUANTA_PER_M


def to_millimetres(legs: Floats) -> Floats:
    """Return the floats nearest to the decimal lengths in mm of `legs` (N, n_legs) in metres."""
    return _counts(legs, QUANTA_PER_M) / QUANTA_PER_MM


def from_millimetres(legs_mm: Floats) -> Floats:
    """Return lengths (N, n_legs) in metres from decimal lengths in mm; the inverse of `to_millimetres`."""
    return _counts(legs_mm, QUANTA_PER_MM) / QUANTA_PER_M


def _counts(values: Floats, quanta: float) -> Floats:
    counts = np.rint(values * quanta)
    if counts.size and np.abs(counts).max() > LARGEST_M * QUANTA_PER_M:
        worst = float(values.flat[int(np.argmax(np.abs(counts)))])
        raise ProgramError("a leg length is beyond any machine", value=worst, expected="less than 10 km")
    return counts
