"""PLY, binary and in text: vertices and facets, strictly; what the header announces is what the file must hold.

The format: https://paulbourke.net/dataformats/ply. A header names elements, how many of each follow, and of what
numbers each consists; a list is a count and so many numbers. `vertex` with x, y, z and `face` with one list of vertices
count; polygons are cut into fans. Other elements and numbers are passed over.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import MeshError
from pentapod.mesh.io.ply_header import Element, split_header, truncated
from pentapod.mesh.io.registry import MeshFormat
from pentapod.mesh.io.text import AGAIN, NUMBER, check_last_line, fans, line_of

_STRANGE = re.compile(
    rb"^(?![ \t]*+(?:" + NUMBER + rb"(?:[ \t]++" + NUMBER + rb")*+)?[ \t\r]*+$)(.*)$", re.MULTILINE
)  # fmt: skip
_CORNERS = ("vertex_indices", "vertex_index")
_MOST_DIFFERING = 5_000_000
"""Polygons of different sizes in a binary file are read one by one."""


@dataclass(frozen=True)
class _Columns:
    """What an element's rows hold. numbers: by name (n,). lists: by name all numbers, and how many each row has."""

    numbers: dict[str, NDArray[Any]]
    lists: dict[str, tuple[NDArray[Any], Ints]]


def read_ply(path: Path, data: bytes, _loose: bool = False) -> tuple[Floats, Ints, tuple[str, ...]]:
    """Return vertices (V, 3) in the file's own numbers, facets (F, 3), and no notes. Raises MeshError."""
    order, elements, start = split_header(path, data)
    found = _text(path, data, start, elements) if order is None else _binary(path, data, start, elements, order)
    corners, counts = _corners(path, found["face"])
    vertices = _vertices(path, found["vertex"])
    few = np.flatnonzero(counts < 3)
    if len(few):
        what = f"facet {int(few[0])} has fewer than three corners"
        raise MeshError(what, file=path, key="face", value=int(counts[few[0]]), remedy=AGAIN)
    return vertices, fans(corners, counts), ()


def _text(path: Path, data: bytes, start: int, elements: list[Element]) -> dict[str, _Columns]:
    """Return the elements of a file in text."""
    if strange := _STRANGE.search(data, start):
        value = strange[1].decode("utf-8", "replace").strip()[:40]
        line = line_of(data, strange.start())
        raise MeshError("cannot be read as PLY: not numbers", file=path, line=line, value=value, remedy=AGAIN)
    check_last_line(path, data)
    lines, first = data[start:].split(b"\n"), line_of(data, start)
    kept = [k for k, text in enumerate(lines) if text and not text.isspace()]
    found: dict[str, _Columns] = {}
    at = 0
    for element in elements:
        rows = kept[at : at + element.rows]
        at += len(rows)
        if len(rows) < element.rows:
            raise truncated(path, element, len(rows))
        words = [lines[k].split() for k in rows]
        width = np.fromiter(map(len, words), np.intp, len(words))
        values = np.fromiter(map(float, chain.from_iterable(words)), np.float64, int(width.sum()))
        columns, used = _split(values, width, element)
        if (used != width).any():
            row = int(np.argmax(used != width))
            raise MeshError(
                "cannot be read as PLY: wrong count of numbers", file=path, line=first + rows[row],
                key=element.name[:40], value=int(width[row]), remedy=AGAIN,
            )  # fmt: skip
        found[element.name] = columns
    if at < len(kept):
        what = "lines stand after the last element that the header announces"
        raise MeshError(what, file=path, line=first + kept[at], remedy=AGAIN)
    return found


def _split(values: Floats, width: Ints, element: Element) -> tuple[_Columns, Ints]:
    """Return the columns of rows that follow each other, and how many numbers of each they use; −1: wrong."""
    start = np.cumsum(width) - width
    used = np.zeros_like(width)
    columns = _Columns({}, {})
    padded = np.append(values, np.nan)
    for prop in element.properties:
        here = padded[np.minimum(start + used, len(values))]
        used = used + 1
        if prop.count is None:
            columns.numbers[prop.name] = here
            continue
        whole = (here >= 0) & (here <= width - used) & (here == np.floor(here))
        if not whole.all():
            return columns, np.where(whole, width, -1)
        counts = here.astype(np.intp)
        columns.lists[prop.name] = values[_spread(start + used, counts)], counts
        used = used + counts
    return columns, used


def _spread(starts: Ints, counts: Ints, step: int = 1) -> Ints:
    """Return the places start, start + step, … of each list, one list after the other."""
    inner = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(starts, counts) + step * inner


def _binary(path: Path, data: bytes, start: int, elements: list[Element], order: str) -> dict[str, _Columns]:
    """Return the elements of a binary file."""
    found: dict[str, _Columns] = {}
    at = start
    for element in elements:
        columns, end = _alike(data, at, element, order) or _differing(path, data, at, element, order)
        if end > len(data):
            raise truncated(path, element, min(element.rows - 1, (len(data) - at) * element.rows // (end - at)))
        found[element.name], at = columns, end
    if data[at:] not in (b"", b"\n", b"\r\n"):
        what = f"{len(data) - at:,} bytes stand after the last element that the header announces"
        raise MeshError(what, file=path, remedy=AGAIN)
    return found


def _alike(data: bytes, at: int, element: Element, order: str) -> tuple[_Columns, int] | None:
    """Return the columns of rows whose lists are all as long as those of the first, and where they end; else None.

    The columns are empty where the end lies beyond that of the file.
    """
    fields: list[Any] = []
    offset = at
    for k, prop in enumerate(element.properties):
        length = 1
        if prop.count is not None:
            size = np.dtype(prop.count).itemsize
            length = int.from_bytes(data[offset : offset + size], "little" if order == "<" else "big")
            fields.append((f"count{k}", order + prop.count))
            offset += size
        if length * np.dtype(prop.type).itemsize > len(data):
            return None
        fields.append((f"value{k}", order + prop.type, (length,)))
        offset += length * np.dtype(prop.type).itemsize
    if not fields:
        return _Columns({}, {}), at
    row = np.dtype(fields)
    end = at + row.itemsize * element.rows
    columns = _Columns({}, {})
    lists = any(prop.count is not None for prop in element.properties)
    if end > len(data):
        return None if lists else (columns, end)
    table = np.frombuffer(data, row, element.rows, at)
    for k, prop in enumerate(element.properties):
        values: NDArray[Any] = table[f"value{k}"]
        if prop.count is None:
            columns.numbers[prop.name] = values.reshape(-1)
            continue
        counts = table[f"count{k}"].astype(np.intp)
        if (counts != values.shape[1]).any():
            return None
        columns.lists[prop.name] = values.reshape(-1), counts
    return columns, end


def _differing(path: Path, data: bytes, at: int, element: Element, order: str) -> tuple[_Columns, int]:
    """Return the columns of rows whose lists have different lengths, and where they end."""
    if element.rows > _MOST_DIFFERING:
        what = f'elements "{element.name[:40]}" of different sizes are too many, or the file was cut off'
        expected = f"at most {_MOST_DIFFERING:,}"
        raise MeshError(what, file=path, value=element.rows, expected=expected, remedy="export triangles")
    sizes = [
        (np.dtype(p.type).itemsize, np.dtype(p.count).itemsize if p.count else 0, bool(p.count and p.count[0] == "i"))
        for p in element.properties
    ]
    names = {"<": "little", ">": "big"}
    places: list[list[int]] = [[] for _ in sizes]
    counts: list[list[int]] = [[] for _ in sizes]
    for row in range(element.rows):
        for k, (size, size_of_count, signed) in enumerate(sizes):
            length = 1
            if size_of_count:
                length = int.from_bytes(data[at : at + size_of_count], names[order], signed=signed)  # type: ignore[arg-type]
                at += size_of_count
            if length < 0 or at + length * size > len(data):
                raise truncated(path, element, row)
            places[k].append(at)
            counts[k].append(length)
            at += length * size
    columns = _Columns({}, {})
    letters = np.frombuffer(data, np.uint8)
    for k, prop in enumerate(element.properties):
        size, length = sizes[k][0], np.array(counts[k], dtype=np.intp)
        spread = _spread(np.array(places[k], dtype=np.intp), length, size)
        values = letters[spread[:, None] + np.arange(size)].view(order + prop.type).reshape(-1)
        if prop.count is None:
            columns.numbers[prop.name] = values
        else:
            columns.lists[prop.name] = values, length
    return columns, at


def _vertices(path: Path, found: _Columns) -> Floats:
    missing = [axis for axis in "xyz" if axis not in found.numbers]
    if missing:
        raise MeshError("a vertex of this PLY is not three numbers", file=path, key="vertex", expected="x, y, z")
    return np.stack([found.numbers[axis].astype(np.float64) for axis in "xyz"], axis=1)


def _corners(path: Path, found: _Columns) -> tuple[Ints, Ints]:
    """Return the corners of all facets, and how many each has. Raises MeshError for what is no whole number."""
    names = [name for name in _CORNERS if name in found.lists] or list(found.lists)[:2]
    if len(names) != 1:
        what = "a facet of this PLY is not a list of vertices"
        raise MeshError(what, file=path, key="face", expected="a list vertex_indices")
    corners, counts = found.lists[names[0]]
    if corners.dtype.kind == "f":
        whole = (np.abs(corners) < 2.0**53) & (corners == np.floor(corners))
        if not whole.all():
            facet = int(np.searchsorted(np.cumsum(counts), int(np.argmin(whole)), side="right"))
            raise MeshError(
                f"facet {facet} names a vertex that is no whole number", file=path, key=names[0],
                value=float(corners[np.argmin(whole)]), remedy=AGAIN,
            )  # fmt: skip
    return corners.astype(np.intp), counts


def _check(path: Path, head: bytes, _size: int) -> None:
    if not head.startswith(b"ply"):
        raise MeshError('cannot be read as PLY: it does not begin with "ply"', file=path, line=1)


FORMAT = MeshFormat(read_ply, _check)
