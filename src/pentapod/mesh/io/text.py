"""Shared parts of the readers of mesh files: number patterns, line numbers, polygons, signs of a truncated file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pentapod.base.arrays import Ints
from pentapod.base.errors import MeshError
from pentapod.geometry.runs import members

NUMBER = rb"[-+]?(?:(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d++)?|[nN][aA][nN]|[iI][nN][fF](?:[iI][nN][iI][tT][yY])?)"
"""Pattern of a number; nan and inf match too, and are refused later with the number of their facet.

No text matches it in two ways: otherwise a line that does not match could take exponential time.
"""

EXPORT_AGAIN = "export the mesh again; the file may be incomplete"


def line_of(data: bytes, position: int) -> int:
    """Return the number, from 1, of the line that holds a byte."""
    return data.count(b"\n", 0, position) + 1


def check_last_line(path: Path, data: bytes, otherwise: str = "") -> None:
    """Raise MeshError where the last line has no line feed: the file is truncated. otherwise: further remedy."""
    if data[-1:] not in (b"\n", b"\r"):
        raise MeshError(
            "the last line has no end: the file was cut off",
            file=path, line=line_of(data, len(data)), remedy=f"export the mesh again, or end the last line{otherwise}",
        )  # fmt: skip


def triangle_fans(corners: Ints, counts: Ints) -> Ints:
    """Return the triangles (T, 3) of polygons, each triangulated as a fan from its first corner.

    corners: vertex indices of all polygons, one after the other; counts (P,): how many each has.
    """
    # Corners k and k + 1 of a polygon make a triangle with its first, for all k but the first and last.
    owner, place = members(counts)
    first = (np.cumsum(counts) - counts)[owner]
    middle = np.flatnonzero((place > 0) & (place < counts[owner] - 1))
    return np.stack([corners[first[middle]], corners[middle], corners[middle + 1]], axis=1)
