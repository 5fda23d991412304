"""Shared parts of the readers of drawings, points and pictures: size limits, optional packages, chords of curves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.display import load_extra
from pentapod.base.errors import ToolpathError
from pentapod.base.files import read_bytes

MOST_BYTES = 64_000_000
MOST_POINTS = 1_000_000
"""Of all lines of a drawing."""

_LEAST_CHORDS, _MOST_CHORDS = 8, 4096


def small_file(path: Path, most: int = MOST_BYTES) -> bytes:
    """Return a file's bytes. Raises ToolpathError where it is not there, empty, or larger than `most`."""
    data = read_bytes(path, ToolpathError, "a drawing, points or a picture", most)
    if not data.strip(b" \t\r\n\0"):
        raise ToolpathError("the file is empty", file=path)
    return data


def extra(module: str, package: str, path: Path) -> Any:
    """Return an optional module. Raises InputError that names the extra to install."""
    return load_extra(module, "drawings", f"reading this needs the package {package}", file=path)


def chords(curve: Callable[[Floats], Floats], tolerance: float) -> int:
    """Return into how many chords a curve (0 to 1 → points) is cut so that it leaves none by more than `tolerance`."""
    count = _LEAST_CHORDS
    while count < _MOST_CHORDS:
        points = curve(np.linspace(0.0, 1.0, 2 * count + 1))
        sag = np.linalg.norm(points[1::2] - 0.5 * (points[:-2:2] + points[2::2]), axis=1).max()
        if sag <= tolerance:
            break
        count *= 2
    return count


def distinct(points: Floats) -> Floats:
    """Return points (n, 2) without those equal to the one before."""
    if len(points) < 2:
        return points
    return points[np.concatenate([[True], (np.diff(points, axis=0) != 0.0).any(axis=1)])]


def check_points(path: Path, count: int) -> None:
    """Raise ToolpathError where the lines of a drawing have more points than are taken."""
    if count > MOST_POINTS:
        what = "the drawing's lines have too many points"
        remedy = "take out what is not needed, or allow a larger tolerance"
        raise ToolpathError(what, file=path, expected=f"at most {MOST_POINTS:,}", remedy=remedy)
