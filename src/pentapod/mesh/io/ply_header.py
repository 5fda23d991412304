"""Header of PLY files: the elements, their numbers of rows, and the properties of each."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from pentapod.base.errors import MeshError
from pentapod.mesh.io.text import EXPORT_AGAIN, line_of

LONGEST_HEADER = 1_000_000
"""Bytes within which the header must end."""

_HEADER_END = re.compile(rb"^[ \t]*+end_header[ \t]*+\r?\n", re.MULTILINE)
_HEADER_LINE = re.compile(
    rb"ply|format (?:ascii|binary_little_endian|binary_big_endian) 1\.0|(?:comment|obj_info)\b.*|element \w+ \d{1,18}"
    rb"|property (?:list \w+ )?\w+ \w+|end_header"
)
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip


@dataclass(frozen=True)
class Property:
    """A number of an element, or a list of numbers where `count` is given; types as NumPy names them."""

    name: str
    type: str
    count: str | None


@dataclass(frozen=True)
class Element:
    """What `rows` rows of a file hold."""

    name: str
    rows: int
    properties: list[Property] = field(default_factory=list[Property])


def split_header(path: Path, data: bytes) -> tuple[str, list[Element], int]:
    """Return the byte order ("<", ">", or "" for text), the elements, and where the header ends.

    Raises MeshError for the first line that no header has.
    """
    end = _HEADER_END.search(data, 0, LONGEST_HEADER)
    header = data[: end.end()] if end else data[:LONGEST_HEADER]
    order: str | None = None
    elements: list[Element] = []
    for number, raw in enumerate(header.splitlines(), start=1):
        line = b" ".join(raw.split())
        words = line.decode("ascii", "replace").split()
        fault = None
        if line and not _HEADER_LINE.fullmatch(line):
            fault = "not a line of a header"
        elif words[:1] == ["format"]:
            order = _ORDERS[words[1]]
        elif words[:1] == ["element"]:
            if words[1] in {element.name for element in elements}:
                fault = "the element is there twice"
            elements.append(Element(words[1], int(words[2])))
        elif words[:1] == ["property"]:
            fault = _add_property(elements, words)
        if fault:
            value = raw.decode("utf-8", "replace").strip()[:40]
            raise MeshError(f"cannot be read as PLY: {fault}", file=path, line=number, value=value, remedy=EXPORT_AGAIN)
    if end is None or order is None:
        what = '"end_header" is missing' if end is None else "the header has no format"
        line = line_of(header, len(header)) if end is None else 1
        raise MeshError(f"cannot be read as PLY: {what}", file=path, line=line, remedy=EXPORT_AGAIN)
    for name, what in (("vertex", "vertices"), ("face", "facets")):
        if name not in {element.name for element in elements}:
            raise MeshError(f"the file announces no {what}", file=path, expected=f'"element {name}" in its header')
    return order, elements, end.end()


def _add_property(elements: list[Element], words: list[str]) -> str | None:
    """Add a property to the last element; return what is wrong with it."""
    types = words[2:4] if len(words) > 3 else words[1:2]
    if not elements or any(word not in _TYPES for word in types):
        return "not a type of numbers" if elements else "a property of no element"
    if words[-1] in {known.name for known in elements[-1].properties}:
        return "the property is there twice"
    count = _TYPES[types[0]] if len(types) == 2 else None
    elements[-1].properties.append(Property(words[-1], _TYPES[types[-1]], count))
    return "a list's count is a whole number" if count and count.startswith("f") else None


def truncated(path: Path, element: Element, held: int) -> MeshError:
    """Return the error of a file that holds fewer rows of an element than announced."""
    name = {"face": "facets", "vertex": "vertices"}.get(element.name, f'elements "{element.name[:40]}"')
    what = f"truncated: the header announces {element.rows:,} {name}, the file holds {held:,}"
    return MeshError(what, file=path, remedy="export the mesh again")
