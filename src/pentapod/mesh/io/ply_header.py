"""Header of PLY files: elements, how many of each follow, and of what numbers each consists."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from pentapod.base.errors import MeshError
from pentapod.mesh.io.text import AGAIN, line_of

_HEADER_END = re.compile(rb"^[ \t]*+end_header[ \t]*+\r?\n", re.MULTILINE)
_HEADER_LINE = re.compile(
    rb"ply|format (?:ascii|binary_little_endian|binary_big_endian) 1\.0|(?:comment|obj_info)\b.*|element \w+ \d{1,18}"
    rb"|property (?:list \w+ )?\w+ \w+|end_header"
)
_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_LONGEST_HEADER = 1_000_000


@dataclass(frozen=True)
class Property:
    """A number of an element, or where `count` is given a list of them; types as NumPy names them."""

    name: str
    type: str
    count: str | None


@dataclass(frozen=True)
class Element:
    """What `rows` rows of a file hold; line: where the header announces it."""

    name: str
    rows: int
    line: int
    properties: list[Property] = field(default_factory=list[Property])


def split_header(path: Path, data: bytes) -> tuple[str | None, list[Element], int]:
    """Return the order of bytes, None for text, the elements, and where the header ends.

    Raises MeshError for the first line that is none of a header.
    """
    end = _HEADER_END.search(data, 0, _LONGEST_HEADER)
    header = data[: end.end()] if end else data[:_LONGEST_HEADER]
    order, elements = _header(path, header)
    if end is None:
        raise MeshError(
            'cannot be read as PLY: "end_header" is missing', file=path, line=line_of(header, len(header)), remedy=AGAIN
        )
    return order, elements, end.end()


def _header(path: Path, header: bytes) -> tuple[str | None, list[Element]]:
    """Return the order of bytes, None for text, and the elements. Raises MeshError for the first line that is none."""
    order: str | None = "?"
    elements: list[Element] = []
    for number, raw in enumerate(header.splitlines(), start=1):
        line = b" ".join(raw.split())
        words = line.decode("ascii", "replace").split()

        def wrong(what: str, line: int = number, value: str = raw.decode("utf-8", "replace").strip()[:40]) -> MeshError:
            return MeshError(f"cannot be read as PLY: {what}", file=path, line=line, value=value, remedy=AGAIN)

        if line and not _HEADER_LINE.fullmatch(line):
            raise wrong("not a line of a header")
        if words[:1] == ["format"]:
            order = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}[words[1]]
        elif words[:1] == ["element"]:
            if words[1] in {element.name for element in elements}:
                raise wrong("the element is there twice")
            elements.append(Element(words[1], int(words[2]), number))
        elif words[:1] == ["property"]:
            types = words[2:4] if len(words) > 3 else words[1:2]
            if not elements or any(word not in _TYPES for word in types):
                raise wrong("not a type of numbers" if elements else "a property of no element")
            if words[-1] in {known.name for known in elements[-1].properties}:
                raise wrong("the property is there twice")
            count = _TYPES[types[0]] if len(types) == 2 else None
            if count is not None and count.startswith("f"):
                raise wrong("a list's count is a whole number")
            elements[-1].properties.append(Property(words[-1], _TYPES[types[-1]], count))
    if order == "?" and b"end_header" in header:
        raise MeshError("cannot be read as PLY: the header has no format", file=path, line=1, remedy=AGAIN)
    names = [element.name for element in elements]
    for name in ("vertex", "face"):
        if b"end_header" in header and name not in names:
            what = f"the file announces no {'facets' if name == 'face' else 'vertices'}"
            raise MeshError(what, file=path, expected=f'"element {name}" in its header')
    return order, elements


def truncated(path: Path, element: Element, held: int) -> MeshError:
    """Return the error of a file that holds fewer rows of an element than announced."""
    name = {"face": "facets", "vertex": "vertices"}.get(element.name, f'elements "{element.name[:40]}"')
    what = f"truncated: the header announces {element.rows:,} {name}, the file holds {held:,}"
    return MeshError(what, file=path, remedy="export the mesh again")
