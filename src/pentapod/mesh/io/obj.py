"""Wavefront OBJ files: strict reader; a line that it does not know is an error.

The format: https://www.martinreddy.net/gfx/3d/OBJ.spec. Read are `v x y z` and `f` with three corners or more, each
`vertex/texture/normal`, counted from 1, or from the end where negative; polygons become triangle fans. Textures,
normals, groups and materials are ignored; curves, surfaces and unknown words are refused, so that nothing is lost.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import chain, islice
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import MeshError
from pentapod.geometry.runs import distinct
from pentapod.mesh.io.registry import MeshData, MeshFormat, ReadOptions
from pentapod.mesh.io.text import EXPORT_AGAIN, NUMBER, check_last_line, line_of, triangle_fans

MOST_UNUSED = 0.01
"""Share of the vertices that may belong to no facet: a file that was cut off between lines has more."""

UNENDED = "the last line has no end: was the file cut off? every vertex belongs to a facet, so it counts as whole"
"""Note on an open surface that another program may have left so, or that was cut off near its end."""

_CORNER = rb"[-+]?\d++(?:/[-+]?\d*+){0,2}"
_GAP = rb"[ \t]++"
_IGNORED = (
    rb"#.*|(?:vt|vn|vp|g|o|s|mg|usemtl|mtllib|usemap|maplib|bevel|c_interp|d_interp|lod|shadow_obj|trace_obj|p|l)"
    rb"(?:[ \t].*)?"
)
_VERTEX_LINE = rb"v(?:" + _GAP + NUMBER + rb"){3,8}+"
_FACET_LINE = rb"f(?:" + _GAP + _CORNER + rb"){3,}+"
_UNKNOWN_LINE = re.compile(
    rb"^(?![ \t]*+(?:(?:" + _VERTEX_LINE + rb"|" + _FACET_LINE + rb")[ \t]*+(?:#.*)?|" + _IGNORED
    + rb")?[ \t\r]*+$)[ \t]*+(\S++).*$",
    re.MULTILINE,
)  # fmt: skip
_VERTEX = re.compile(rb"^[ \t]*+v" + 3 * (_GAP + rb"(" + NUMBER + rb")"), re.MULTILINE)
_FACET = re.compile(rb"^[ \t]*+f((?:" + _GAP + _CORNER + rb")++)", re.MULTILINE)
_MOST_DIGITS, _BEYOND = 18, 10**18
_LINE_OR_POINT = re.compile(rb"^[ \t]*+[lp][ \t]", re.MULTILINE)
_REST_OF_CORNER = re.compile(rb"/\S*")
_COMMENT_OR_CONTINUATION = re.compile(rb"(#[^\n]*)|\\\r?\n")


def _read(path: Path, data: bytes, options: ReadOptions) -> MeshData:
    """Return the content of a file. Raises MeshError with the line.

    With `options.loose` more than `MOST_UNUSED` of the vertices may belong to no facet, and the last line of an open
    surface may have no end.
    """
    text = _joined_lines(data)
    if strange := _UNKNOWN_LINE.search(text):
        word = strange[1].decode("utf-8", "replace")[:20]
        what = {"v": "a vertex is not three numbers", "f": "a facet is not three corners or more"}
        value = strange[0].decode("utf-8", "replace").strip()[:40]
        raise MeshError(
            f"cannot be read as OBJ: {what.get(word, 'an unknown word')}",
            file=path, line=line_of(data, strange.start()), key=word, value=value, remedy=EXPORT_AGAIN,
        )  # fmt: skip
    vertices, places = _vertices(text)
    faces = _facets(path, data, text, places)
    _check_announced(path, text, len(vertices), len(faces))
    notes = _unused(path, text, vertices, faces, loose=options.loose)
    if data[-1:] not in (b"\n", b"\r"):
        if notes or not _ends_with_facet(text):
            check_last_line(path, data)
        if _is_closed(vertices, faces):
            return MeshData(vertices, faces, notes)
        if not options.loose:
            check_last_line(path, data, "; where it is complete, repair = true takes it as it is")
        notes = (UNENDED,)
    return MeshData(vertices, faces, notes)


def _joined_lines(data: bytes) -> bytes:
    """Return the file with line continuations replaced by spaces: every byte keeps its place.

    A comment ends with its line, even after a backslash: Windows paths end with one.
    """

    def blank(found: re.Match[bytes]) -> bytes:
        return found[0] if found[1] is not None else b" " * len(found[0])

    return _COMMENT_OR_CONTINUATION.sub(blank, data) if b"\\" in data else data


def _vertices(text: bytes) -> tuple[Floats, Ints]:
    """Return vertices (V, 3), and the places (V,) in the file where they begin."""
    parts, places = [np.zeros((0, 3))], [np.zeros(0, dtype=np.intp)]
    for matches in _batches(_VERTEX.finditer(text)):
        words = chain.from_iterable(match.groups() for match in matches)
        parts.append(np.fromiter(map(float, words), np.float64, 3 * len(matches)).reshape(-1, 3))
        places.append(np.array([match.start() for match in matches]))
    return np.concatenate(parts), np.concatenate(places)


def _facets(path: Path, data: bytes, text: bytes, places: Ints) -> Ints:
    """Return triangles (F, 3) of vertex indices from 0. Raises MeshError for an index beyond the vertices."""
    parts = [np.zeros((0, 3), dtype=np.intp)]
    for matches in _batches(_FACET.finditer(text)):
        corners = [_REST_OF_CORNER.sub(b"", match[1]).split() for match in matches]
        count = np.array([len(words) for words in corners])
        index = _indices([word for words in corners for word in words])
        owner = np.repeat(np.arange(len(matches)), count)
        before = np.searchsorted(places, np.array([match.start() for match in matches]))
        index = np.where(index < 0, before[owner] + index, index - 1)
        wrong = (index < 0) | (index >= len(places))
        if wrong.any():
            match = matches[int(owner[wrong.argmax()])]
            raise MeshError(
                f"a facet uses a vertex that is not there; the mesh has {len(places):,} vertices",
                file=path, line=line_of(data, match.start()), key="f", value=match[1].decode().strip()[:40],
                remedy=EXPORT_AGAIN,
            )  # fmt: skip
        parts.append(triangle_fans(index, count))
    return np.concatenate(parts)


def _indices(words: list[bytes]) -> Ints:
    """Return whole numbers (n,); those beyond 64 bits become one that no vertex has."""
    try:
        return np.array(list(map(int, words)), dtype=np.intp)
    except (OverflowError, ValueError):
        return np.array([int(w) if len(w) < _MOST_DIGITS else _BEYOND for w in words], dtype=np.intp)


def _batches(matches: Iterator[re.Match[bytes]]) -> Iterator[list[re.Match[bytes]]]:
    """Return matches a hundred thousand at a time: objects of Python are large."""
    while batch := list(islice(matches, 100_000)):
        yield batch


def _check_announced(path: Path, text: bytes, vertices: int, faces: int) -> None:
    """Raise MeshError where a remark announces more vertices or facets, as MeshLab's do, than there are."""
    for word, found in ((b"vertices", vertices), (b"faces", faces)):
        announced = re.findall(
            rb"^#[ \t]*+" + word + rb"[ \t]*+:[ \t]*+(\d{1,18})[ \t\r]*$", text, re.MULTILINE | re.IGNORECASE
        )
        if len(announced) == 1 and int(announced[0]) > found:
            what = f"truncated: a remark announces {int(announced[0]):,} {word.decode()}, the file holds {found:,}"
            raise MeshError(what, file=path, remedy=EXPORT_AGAIN)


def _unused(path: Path, text: bytes, vertices: Floats, faces: Ints, *, loose: bool) -> tuple[str, ...]:
    """Return a note on vertices of no facet. Raises MeshError where many are and the file has no lines or points."""
    count, unused = len(vertices), len(vertices) - len(distinct(faces))
    what = (
        f"{unused:,} of {count:,} vertices belong to no facet: was the file cut off? "
        "an OBJ does not tell how many facets it should have"
    )
    if unused > MOST_UNUSED * count and not loose and len(faces) and not _LINE_OR_POINT.search(text):
        remedy = "export the mesh again; where it is complete, repair = true takes it as it is"
        raise MeshError(what, file=path, remedy=remedy)
    return (what,) if unused else ()


def _is_closed(vertices: Floats, faces: Ints) -> bool:
    """Return whether each side of a facet has a facet on the other side: then none is missing."""
    place = np.unique(vertices, axis=0, return_inverse=True)[1].ravel()[faces]
    first, second = place.ravel(), np.roll(place, -1, axis=1).ravel()
    proper, count = first != second, len(vertices)
    there, back = first * count + second, second * count + first
    return bool(np.array_equal(np.sort(there[proper]), np.sort(back[proper])))


def _ends_with_facet(text: bytes) -> bool:
    """Return whether the last line is a facet whose corners have the same form: then it may be whole without an end."""
    facet = _FACET.match(text[max(text.rfind(b"\n"), text.rfind(b"\r")) + 1 :])
    if facet is None:
        return False
    return len({(corner.count(b"/"), corner.endswith(b"/")) for corner in facet[1].split()}) == 1


def _check(path: Path, head: bytes, _size: int) -> None:
    if b"\0" in head:
        wide = head.startswith((b"\xff\xfe", b"\xfe\xff"))
        what = "not UTF-8 text but UTF-16" if wide else "it holds zero bytes"
        raise MeshError(f"cannot be read as OBJ: {what}", file=path, line=1, remedy="save it as UTF-8")


FORMAT = MeshFormat(_read, _check)
