"""OBJ: vertices and facets of Wavefront's text format, strictly; a line that is not understood is named.

The format: https://www.martinreddy.net/gfx/3d/OBJ.spec. `v x y z` and `f` with three corners or more count, corners as
`vertex/texture/normal` from 1, or from the end where negative; polygons are cut into fans. Textures, normals, groups
and materials are passed over. Curves, surfaces and words that are not known are refused: nothing is left out silently.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import chain, islice
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import MeshError
from pentapod.mesh.io.registry import MeshFormat
from pentapod.mesh.io.text import AGAIN, NUMBER, check_last_line, fans, line_of

_CORNER = rb"[-+]?\d++(?:/[-+]?\d*+){0,2}"
_GAP = rb"[ \t]++"
_PASSED_OVER = (
    rb"#.*|(?:vt|vn|vp|g|o|s|mg|usemtl|mtllib|usemap|maplib|bevel|c_interp|d_interp|lod|shadow_obj|trace_obj|p|l)"
    rb"(?:[ \t].*)?"
)
_VERTEX_LINE = rb"v(?:" + _GAP + NUMBER + rb"){3,8}+"
_FACET_LINE = rb"f(?:" + _GAP + _CORNER + rb"){3,}+"
_STRANGE = re.compile(
    rb"^(?![ \t]*+(?:(?:" + _VERTEX_LINE + rb"|" + _FACET_LINE + rb")[ \t]*+(?:#.*)?|" + _PASSED_OVER
    + rb")?[ \t\r]*+$)[ \t]*+(\S++).*$",
    re.MULTILINE,
)  # fmt: skip
_VERTEX = re.compile(rb"^[ \t]*+v" + 3 * (_GAP + rb"(" + NUMBER + rb")"), re.MULTILINE)
_FACET = re.compile(rb"^[ \t]*+f((?:" + _GAP + _CORNER + rb")++)", re.MULTILINE)
_LONG, _BEYOND = 18, 10**18
_LINES = re.compile(rb"^[ \t]*+[lp][ \t]", re.MULTILINE)
_MOST_LOOSE = 0.01
_REST_OF_CORNER = re.compile(rb"/\S*")
_COMMENT_OR_GOES_ON = re.compile(rb"(#[^\n]*)|\\\r?\n")


def read_obj(path: Path, data: bytes, loose: bool = False) -> tuple[Floats, Ints, tuple[str, ...]]:
    """Return vertices (V, 3) in the file's own numbers, facets (F, 3), and notes. Raises MeshError naming the line.

    loose: whether more than 1 % of the vertices may belong to no facet. A file that was cut off looks like that.
    """
    text = _whole_lines(data)
    if strange := _STRANGE.search(text):
        word = strange[1].decode("utf-8", "replace")[:20]
        what = {"v": "a vertex is not three numbers", "f": "a facet is not three corners or more"}
        value = strange[0].decode("utf-8", "replace").strip()[:40]
        raise MeshError(
            f"cannot be read as OBJ: {what.get(word, 'an unknown word')}",
            file=path, line=line_of(data, strange.start()), key=word, value=value, remedy=AGAIN,
        )  # fmt: skip
    check_last_line(path, data)
    vertices, places = _vertices(text)
    faces = _facets(path, data, text, places)
    _check_told(path, text, len(vertices), len(faces))
    return vertices, faces, _unused(path, text, vertices, faces, loose=loose)


def _whole_lines(data: bytes) -> bytes:
    """Return the file with spaces for what ends lines that go on in the next: every byte stays at its place.

    A comment ends with its line, even on a backslash: directories of Windows do.
    """

    def blank(found: re.Match[bytes]) -> bytes:
        return found[0] if found[1] is not None else b" " * len(found[0])

    return _COMMENT_OR_GOES_ON.sub(blank, data) if b"\\" in data else data


def _vertices(text: bytes) -> tuple[Floats, Ints]:
    """Return vertices (V, 3), and where (V,) in the file each stands."""
    parts, places = [np.zeros((0, 3))], [np.zeros(0, dtype=np.intp)]
    for matches in _batches(_VERTEX.finditer(text)):
        words = chain.from_iterable(match.groups() for match in matches)
        parts.append(np.fromiter(map(float, words), np.float64, 3 * len(matches)).reshape(-1, 3))
        places.append(np.array([match.start() for match in matches]))
    return np.concatenate(parts), np.concatenate(places)


def _facets(path: Path, data: bytes, text: bytes, places: Ints) -> Ints:
    """Return triangles (F, 3) of vertex indices from 0. Raises MeshError for a corner that is not there.

    text: the file with its lines whole.
    """
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
                f"a facet names a vertex that is not there; the mesh has {len(places):,} vertices",
                file=path, line=line_of(data, match.start()), key="f", value=match[1].decode().strip()[:40],
                remedy=AGAIN,
            )  # fmt: skip
        parts.append(fans(index, count))
    return np.concatenate(parts)


def _indices(words: list[bytes]) -> Ints:
    """Return whole numbers (n,); what is beyond the computer's own is the largest of these, which no vertex has."""
    try:
        return np.array(list(map(int, words)), dtype=np.intp)
    except (OverflowError, ValueError):
        return np.array([int(w) if len(w) < _LONG else _BEYOND for w in words], dtype=np.intp)


def _batches(matches: Iterator[re.Match[bytes]]) -> Iterator[list[re.Match[bytes]]]:
    """Return matches a hundred thousand at a time: objects of Python are large."""
    while batch := list(islice(matches, 100_000)):
        yield batch


def _check_told(path: Path, text: bytes, vertices: int, faces: int) -> None:
    """Raise MeshError where a remark tells how many vertices and facets there are, as MeshLab's do, and fewer are."""
    for word, found in ((b"vertices", vertices), (b"faces", faces)):
        told = re.findall(
            rb"^#[ \t]*+" + word + rb"[ \t]*+:[ \t]*+(\d{1,18})[ \t\r]*$", text, re.MULTILINE | re.IGNORECASE
        )
        if len(told) == 1 and int(told[0]) > found:
            name = word.decode()
            what = f"truncated: a remark tells of {int(told[0]):,} {name}, the file holds {found:,}"
            raise MeshError(what, file=path, remedy=AGAIN)


def _unused(path: Path, text: bytes, vertices: Floats, faces: Ints, *, loose: bool) -> tuple[str, ...]:
    """Return a note where vertices belong to no facet. Raises MeshError where they are many and no lines or points."""
    count, left = len(vertices), len(vertices) - len(np.unique(faces))
    whole = "an OBJ does not tell how many facets it should have"
    what = f"{left:,} of {count:,} vertices belong to no facet: was the file cut off? {whole}"
    if left > _MOST_LOOSE * count and not loose and len(faces) and not _LINES.search(text):
        remedy = "export the mesh again; where it is whole, repair = true takes it as it is"
        raise MeshError(what, file=path, remedy=remedy)
    return (what,) if left else ()


def _check(path: Path, head: bytes, _size: int) -> None:
    if b"\0" in head:
        wide = head.startswith((b"\xff\xfe", b"\xfe\xff"))
        what = "not UTF-8 text but UTF-16" if wide else "it holds zero bytes"
        raise MeshError(f"cannot be read as OBJ: {what}", file=path, line=1, remedy="save it as UTF-8")


FORMAT = MeshFormat(read_obj, _check)
