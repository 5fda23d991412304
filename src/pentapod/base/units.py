"""Units: keys of files end with their unit; this module alone converts values to SI and back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

MM_MIN = 1e-3 / 60.0

_TO_SI: dict[str, Callable[[Any], Any]] = {
    **dict.fromkeys(("mm", "mm_s", "mm_s2", "mm_s3", "ms"), lambda x: x / 1000.0),
    **dict.fromkeys(("mm2", "um"), lambda x: x / 1e6),
    "mm_min": lambda x: x * MM_MIN,
    **dict.fromkeys(("deg", "deg_s", "deg_s2"), np.radians),
    "deg_mm": lambda x: np.radians(x) / 1e-3,
    "per_mm": lambda x: x * 1000.0,
    "n_um": lambda x: x * 1e6,
    "kn": lambda x: x * 1000.0,
    **dict.fromkeys(("s", "per_s", "kg", "n", "n_s_m", "m_s2"), lambda x: x),
}
_FROM_SI: dict[str, Callable[[Any], Any]] = {
    **dict.fromkeys(("mm", "mm_s", "mm_s2", "mm_s3", "ms"), lambda x: x * 1000.0),
    **dict.fromkeys(("mm2", "um"), lambda x: x * 1e6),
    "mm_min": lambda x: x / MM_MIN,
    **dict.fromkeys(("deg", "deg_s", "deg_s2"), np.degrees),
    "deg_mm": lambda x: np.degrees(x) * 1e-3,
    "per_mm": lambda x: x / 1000.0,
    "n_um": lambda x: x / 1e6,
    "kn": lambda x: x / 1000.0,
}
_LONGEST_FIRST = sorted(_TO_SI, key=len, reverse=True)


def split_key(key: str) -> tuple[str, str]:
    """Return the name and the unit of a key of a file: ("spacing", "mm") of "spacing_mm"; "" where it has no unit."""
    for unit in _LONGEST_FIRST:
        if key.endswith(f"_{unit}"):
            return key.removesuffix(f"_{unit}"), unit
    return key, ""


def to_si(value: Any, unit: str) -> Any:
    """Return a value of a file in SI units: numbers as float, tuples and lists of numbers as arrays.

    A value without a unit, and None, stay as they are. Lengths are divided by 1000, which rounds once.
    """
    if value is None or unit not in _TO_SI:
        return value
    if isinstance(value, int | float):
        return float(_TO_SI[unit](float(value)))
    return _TO_SI[unit](np.asarray(value, dtype=np.float64))


def from_si(value: Any, unit: str) -> Any:
    """Return an SI value (a number or an array) in a unit of files; None stays None."""
    return value if value is None or unit not in _FROM_SI else _FROM_SI[unit](value)
