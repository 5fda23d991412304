"""PLY files, binary and ASCII: strict reader; the file must hold exactly what its header announces.

The format: https://paulbourke.net/dataformats/ply. The header names elements, their numbers of rows, and the numbers
and lists of each row; a list is a count and so many numbers. Read are `vertex` with x, y, z and `face` with one list of
vertices, polygons as triangle fans. Other elements and properties are ignored.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import MeshError
from pentapod.geometry.runs import members
from pentapod.mesh.io.ply_header import Element, split_header, truncated
from pentapod.mesh.io.registry import MeshData, MeshFormat, ReadOptions
from pentapod.mesh.io.text import EXPORT_AGAIN, NUMBER, check_last_line, line_of, triangle_fans

MOST_UNEQUAL_ROWS = 5_000_000
"""Rows with lists of different lengths that a binary file may have: they are read one by one."""

_NOT_NUMBERS = re.compile(
    rb"^(?![ \t]*+(?:" + NUMBER + rb"(?:[ \t]++" + NUMBER + rb")*+)?[ \t\r]*+$)(.*)$", re.MULTILINE
)  # fmt: skip
_CORNERS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True)
class _Columns:
    """The rows of an element. numbers: by name (n,). lists: by name all numbers, and how many each row has."""

    numbers: dict[str, NDArray[Any]] = field(default_factory=dict[str, NDArray[Any]])
    lists: dict[str, tuple[NDArray[Any], Ints]] = field(default_factory=dict[str, tuple[NDArray[Any], Ints]])


def _read(path: Path, data: bytes, _options: ReadOptions) -> MeshData:
    """Return the content of a file. Raises MeshError."""
    order, elements, start = split_header(path, data)
    found = _read_binary(path, data, start, elements, order) if order else _read_text(path, data, start, elements)
    corners, counts = _corners(path, found["face"])
    numbers = found["vertex"].numbers
    if not {*"xyz"} <= set(numbers):
        raise MeshError("a vertex of this PLY is not three numbers", file=path, key="vertex", expected="x, y, z")
    few = np.flatnonzero(counts < 3)
    if len(few):
        what = f"facet {int(few[0])} has fewer than three corners"
        raise MeshError(what, file=path, key="face", value=int(counts[few[0]]), remedy=EXPORT_AGAIN)
    vertices = np.stack([numbers[axis].astype(np.float64) for axis in "xyz"], axis=1)
    return MeshData(vertices, triangle_fans(corners, counts))


def _corners(path: Path, found: _Columns) -> tuple[Ints, Ints]:
    """Return the corners of all facets, and how many each has. Raises MeshError where one is not a whole number."""
    names = [name for name in _CORNERS if name in found.lists] or list(found.lists)
    if len(names) != 1:
        what = "a facet of this PLY is not a list of vertices"
        raise MeshError(what, file=path, key="face", expected="a list vertex_indices")
    corners, counts = found.lists[names[0]]
    if corners.dtype.kind == "f":
        whole = (np.abs(corners) < 2.0**53) & (corners == np.floor(corners))
        if not whole.all():
            facet = int(np.searchsorted(np.cumsum(counts), int(np.argmin(whole)), side="right"))
            raise MeshError(
                f"facet {facet} has a vertex index that is not a whole number", file=path, key=names[0],
                value=float(corners[np.argmin(whole)]), remedy=EXPORT_AGAIN,
            )  # fmt: skip
    return corners.astype(np.intp), counts


def _read_text(path: Path, data: bytes, start: int, elements: list[Element]) -> dict[str, _Columns]:
    if strange := _NOT_NUMBERS.search(data, start):
        value = strange[1].decode("utf-8", "replace").strip()[:40]
        line = line_of(data, strange.start())
        raise MeshError("cannot be read as PLY: not numbers", file=path, line=line, value=value, remedy=EXPORT_AGAIN)
    check_last_line(path, data)
    lines, first = data[start:].split(b"\n"), line_of(data, start)
    filled = [k for k, text in enumerate(lines) if text and not text.isspace()]
    found: dict[str, _Columns] = {}
    at = 0
    for element in elements:
        rows = filled[at : at + element.rows]
        at += len(rows)
        if len(rows) < element.rows:
            raise truncated(path, element, len(rows))
        words = [lines[k].split() for k in rows]
        width = np.fromiter(map(len, words), np.intp, len(words))
        values = np.fromiter(map(float, chain.from_iterable(words)), np.float64, int(width.sum()))
        found[element.name], used = _split_rows(values, width, element)
        if (used != width).any():
            row = int(np.argmax(used != width))
            raise MeshError(
                "cannot be read as PLY: wrong count of numbers", file=path, line=first + rows[row],
                key=element.name[:40], value=int(width[row]), remedy=EXPORT_AGAIN,
            )  # fmt: skip
    if at < len(filled):
        what = "lines follow after the last element that the header announces"
        raise MeshError(what, file=path, line=first + filled[at], remedy=EXPORT_AGAIN)
    return found


def _split_rows(values: Floats, width: Ints, element: Element) -> tuple[_Columns, Ints]:
    """Return the columns of consecutive rows of `width` numbers, and how many numbers of each they use; −1: wrong."""
    start = np.cumsum(width) - width
    used = np.zeros_like(width)
    columns = _Columns()
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
        row, number = members(counts)
        columns.lists[prop.name] = values[(start + used)[row] + number], counts
        used = used + counts
    return columns, used


def _read_binary(path: Path, data: bytes, start: int, elements: list[Element], order: str) -> dict[str, _Columns]:
    found: dict[str, _Columns] = {}
    at = start
    for element in elements:
        columns, end = _equal_rows(data, at, element, order) or _unequal_rows(path, data, at, element, order)
        if end > len(data):
            raise truncated(path, element, min(element.rows - 1, (len(data) - at) * element.rows // (end - at)))
        found[element.name], at = columns, end
    if data[at:] not in (b"", b"\n", b"\r\n"):
        what = f"{len(data) - at:,} bytes follow after the last element that the header announces"
        raise MeshError(what, file=path, remedy=EXPORT_AGAIN)
    return found


def _byteorder(order: str) -> Literal["little", "big"]:
    return "little" if order == "<" else "big"


def _equal_rows(data: bytes, at: int, element: Element, order: str) -> tuple[_Columns, int] | None:
    """Return the columns of rows whose lists are as long as those of the first, and where they end; otherwise None.

    The columns are empty where the end lies beyond that of the file.
    """
    fields: list[Any] = []
    offset = at
    for k, prop in enumerate(element.properties):
        length = 1
        if prop.count is not None:
            size = np.dtype(prop.count).itemsize
            length = int.from_bytes(data[offset : offset + size], _byteorder(order))
            fields.append((f"count{k}", order + prop.count))
            offset += size
        offset += length * np.dtype(prop.type).itemsize
        if offset > at + len(data):
            return None
        fields.append((f"value{k}", order + prop.type, (length,)))
    columns = _Columns()
    if not fields:
        return columns, at
    row = np.dtype(fields)
    end = at + row.itemsize * element.rows
    if end > len(data):
        return None if any(prop.count for prop in element.properties) else (columns, end)
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


def _unequal_rows(path: Path, data: bytes, at: int, element: Element, order: str) -> tuple[_Columns, int]:
    """Return the columns of rows whose lists have different lengths, and where they end."""
    if element.rows > MOST_UNEQUAL_ROWS:
        what = f'elements "{element.name[:40]}" of different sizes are too many, or the file was cut off'
        expected = f"at most {MOST_UNEQUAL_ROWS:,}"
        raise MeshError(what, file=path, value=element.rows, expected=expected, remedy="export triangles")
    properties = element.properties
    sizes = [(np.dtype(p.type).itemsize, np.dtype(p.count).itemsize if p.count else 0) for p in properties]
    signed = [bool(p.count and p.count[0] == "i") for p in properties]
    found = [bytearray() for _ in properties]
    counts: list[list[int]] = [[] for _ in properties]
    for row in range(element.rows):
        for k, (size, size_of_count) in enumerate(sizes):
            length = 1
            if size_of_count:
                length = int.from_bytes(data[at : at + size_of_count], _byteorder(order), signed=signed[k])
                at += size_of_count
            end = at + length * size
            if length < 0 or end > len(data):
                raise truncated(path, element, row)
            found[k] += data[at:end]
            counts[k].append(length)
            at = end
    columns = _Columns()
    for prop, raw, count in zip(properties, found, counts, strict=True):
        values = np.frombuffer(raw, order + prop.type)
        if prop.count is None:
            columns.numbers[prop.name] = values
        else:
            columns.lists[prop.name] = values, np.array(count, dtype=np.intp)
    return columns, at


def _check(path: Path, head: bytes, _size: int) -> None:
    if not head.startswith(b"ply"):
        raise MeshError('cannot be read as PLY: it does not begin with "ply"', file=path, line=1)


FORMAT = MeshFormat(_read, _check)
