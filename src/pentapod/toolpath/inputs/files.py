"""Shared parts of the readers of drawings, points and pictures: size limits, optional packages, chords of curves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.display import load_extra
from pentapod.base.errors import ToolpathError
from pentapod.base.files import read_bytes


@dataclass(frozen=True)
class InputLimits:
    """Sizes beyond which a file is refused, before it takes hours or all memory.

    file_bytes, dxf_bytes: of a file. points: of all lines of a drawing. pixels: of a picture. reach: metres from the
    origin of a drawing. svg_elements, svg_numbers: of an SVG with all that its <use> elements repeat; numbers and
    letters of commands in its paths. svg_depth: of nested elements. svg_attributes: of an element. svg_transform,
    svg_style: characters.
    """

    file_bytes: int = 64_000_000
    dxf_bytes: int = 16_000_000
    points: int = 1_000_000
    pixels: int = 20_000_000
    reach: float = 1e4
    svg_elements: int = 20_000
    svg_numbers: int = 400_000
    svg_depth: int = 100
    svg_attributes: int = 100
    svg_transform: int = 1_000
    svg_style: int = 4_000


LIMITS = InputLimits()

FEWEST_CHORDS, MOST_CHORDS = 8, 4096
"""Into which a curve is divided."""


def small_file(path: Path) -> bytes:
    """Return a file's bytes. Raises ToolpathError where it is missing, empty, or too large."""
    data = read_bytes(path, ToolpathError, "a drawing or a picture", LIMITS.file_bytes)
    if not data.strip(b" \t\r\n\0"):
        raise ToolpathError("the file is empty", file=path)
    return data


def extra(module: str, package: str, path: Path) -> Any:
    """Return an optional module. Raises InputError that names the extra to install."""
    return load_extra(module, "drawings", f"reading this needs the package {package}", file=path)


def chord_count(curve: Callable[[Floats], Floats], tolerance: float) -> int:
    """Return the number of chords that deviate from a curve (0 to 1 → points) by at most `tolerance`."""
    count = FEWEST_CHORDS
    while count < MOST_CHORDS:
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
    """Raise ToolpathError where the lines of a drawing have too many points."""
    if count > LIMITS.points:
        what = "the drawing's lines have too many points"
        remedy = "remove what is not needed, or allow a larger tolerance"
        raise ToolpathError(what, file=path, expected=f"at most {LIMITS.points:,}", remedy=remedy)
