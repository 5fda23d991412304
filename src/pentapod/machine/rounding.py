"""Jerk caused by rounding setpoints to the resolution of programs."""

from __future__ import annotations

QUANTA_PER_M = 1e11
"""Leg lengths in programs are whole numbers of these: hundred-millionths of a millimetre."""

TIP_ROUNDING = 10.0
"""Largest jerk of the tip that rounding the rows can add, as a multiple of the largest added to a leg's."""

# What rounding each row by half a quantum can do to third differences, 8 / 2, and to the spline's third derivative,
# 24 / 2 (rows rounded up and down in turn), in quanta by the period cubed.
_ROUNDED = {"linear": 4.0, "cubic": 12.0}


def jerk_of_rounding(period: float, interpolation: str) -> float:
    """Return the jerk, m/s³, that rounding setpoints each `period` seconds can add to a leg's."""
    return _ROUNDED[interpolation] / QUANTA_PER_M / period**3
