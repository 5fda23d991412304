"""Shared parts of the readers of mesh files: numbers, lines, polygons, and marks of a truncated file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pentapod.base.arrays import Ints
from pentapod.base.errors import MeshError

NUMBER = rb"[-+]?(?:(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d++)?|[nN][aA][nN]|[iI][nN][fF](?:[iI][nN][iI][tT][yY])?)"
"""A number as a pattern; nan and inf are told from words, for the mesh says which facet has them.

No text matches it in two ways: else a line that is not understood could take for ever.
"""

AGAIN = "export the mesh again; the file may have been cut off on its way"


def line_of(data: bytes, position: int) -> int:
    """Return the number, from 1, of the line that holds a byte."""
    return data.count(b"\n", 0, position) + 1


def check_last_line(path: Path, data: bytes) -> None:
    """Raise MeshError where the last line has no end: it was cut off."""
    if data[-1:] not in (b"\n", b"\r"):
        raise MeshError(
            "the last line has no end: the file was cut off",
            file=path, line=line_of(data, len(data)), remedy="export the mesh again, or end the last line",
        )  # fmt: skip


def fans(corners: Ints, counts: Ints) -> Ints:
    """Return triangles (T, 3) of polygons, each cut into a fan from its first corner.

    corners: vertex indices of all polygons, one after the other; counts (P,): how many each has.
    """
    # Corner k and k + 1 of a polygon make a triangle with its first, for all k but the first and last.
    first = np.cumsum(counts) - counts
    owner = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(len(corners)) - first[owner]
    middle = np.flatnonzero((place > 0) & (place < counts[owner] - 1))
    return np.stack([corners[first[owner[middle]]], corners[middle], corners[middle + 1]], axis=1)
