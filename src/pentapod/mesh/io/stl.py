"""STL files, binary and ASCII: reader and writer.

The format: https://www.fabbers.com/tech/STL_Format. Binary: 80 bytes of text, the number of facets, then 50
bytes a facet (normal, three corners, an attribute). ASCII: `solid`, facets in words, `endsolid`.
"""

from __future__ import annotations

import re
from itertools import chain
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import MeshError
from pentapod.mesh.io.registry import MeshData, MeshFormat, ReadOptions
from pentapod.mesh.io.text import EXPORT_AGAIN, NUMBER, line_of

HEADER_BYTES, HEAD_BYTES = 84, 4096
"""Length of a binary header; how many of the first bytes show whether a file is text."""

_FACET = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_NUMBER = re.compile(NUMBER)
_SOLID = re.compile(rb"\s*+solid", re.IGNORECASE)
_WORDS = (b"facet", b"endfacet", b"endsolid")
_VERTEX = re.compile(rb"vertex[ \t]++(\S++)[ \t]++(\S++)[ \t]++(\S++)", re.IGNORECASE)


def read_stl(path: Path, data: bytes) -> Floats:
    """Return the triangles (F, 3, 3), in the file's own unit, of a file that `_check` accepts. Raises MeshError."""
    if not _is_binary(data[:HEAD_BYTES], len(data)):
        return _read_ascii(path, data)
    return np.frombuffer(data, dtype=_FACET, offset=HEADER_BYTES)["corners"].astype(np.float64)


def write_stl(triangles: Floats, name: str) -> bytes:
    """Return a binary STL of triangles (F, 3, 3): same numbers, same bytes. name: at most 80 characters of ASCII.

    >>> written = Path("copy.stl").write_bytes(write_stl(1e3 * part.vertices[part.faces], "copy"))
    """
    corners = np.asarray(triangles, dtype=np.float64).astype("<f4")
    sides = corners.astype(np.float64)
    normal = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    facets = np.zeros(len(corners), dtype=_FACET)
    facets["corners"] = corners
    facets["normal"] = normal / np.where(length > 0.0, length, 1.0)
    return name.encode("ascii")[:80].ljust(80) + len(facets).to_bytes(4, "little") + facets.tobytes()


def _announced(head: bytes) -> int:
    return int.from_bytes(head[80:84], "little")


def _is_binary(head: bytes, size: int) -> bool:
    """Whether the size is what a binary header announces: binary files may begin with `solid` too."""
    return size >= HEADER_BYTES and size == HEADER_BYTES + _FACET.itemsize * _announced(head)


def _check(path: Path, head: bytes, size: int) -> None:
    """Raise MeshError for a file that is neither text nor a binary STL of the announced size."""
    if _is_binary(head, size) or not head.strip():
        return
    if _is_text(head) or (size < HEADER_BYTES and _begins_with_solid(head)):
        return
    announced, held = _announced(head), (size - HEADER_BYTES) // _FACET.itemsize
    if size < HEADER_BYTES:
        what = f"truncated: {size} bytes, shorter than the header of a binary STL"
    elif held < announced:
        what = f"truncated: the header announces {announced:,} facets, the file holds {held:,}"
    else:
        extra = size - HEADER_BYTES - _FACET.itemsize * announced
        what = f"{extra:,} bytes follow after the last of {announced:,} facets that the header announces"
    raise MeshError(what, file=path, remedy=EXPORT_AGAIN)


def _begins_with_solid(data: bytes) -> bool:
    return _SOLID.match(data) is not None


def _is_text(data: bytes) -> bool:
    """Whether bytes look like text: no NUL, at most 1 % control characters."""
    control = sum(byte < 32 and byte not in b"\t\n\r\f\v" for byte in data)
    return b"\0" not in data and control <= len(data) // 100


def _read_ascii(path: Path, data: bytes) -> Floats:
    if not _begins_with_solid(data):
        raise MeshError("a text file, not STL", file=path, expected='binary STL, or text that begins with "solid"')
    numbers = _VERTEX.findall(data)
    begin, end, closed = (len(re.findall(rb"^[ \t]*+" + word, data, re.IGNORECASE | re.MULTILINE)) for word in _WORDS)
    if not (begin or numbers or closed):
        raise MeshError('begins with "solid", but no facet follows', file=path, expected="an STL file")
    if not closed or end != begin or len(numbers) != 3 * begin:
        counts = f"{begin:,} facets begin, {end:,} end, {len(numbers):,} vertices in all"
        missing = "" if closed else ', "endsolid" is missing'
        what = f"truncated or malformed: {counts}{missing}"
        raise MeshError(what, file=path, line=line_of(data, len(data)), remedy=EXPORT_AGAIN)
    words = chain.from_iterable(numbers)
    try:
        if b"_" in data and any(b"_" in word for word in chain.from_iterable(numbers)):
            raise ValueError("Python reads 1_0 as ten")
        return np.fromiter(map(float, words), np.float64, 3 * len(numbers)).reshape(-1, 3, 3)
    except ValueError as error:
        at, word = next(
            (match.start(), word) for match in _VERTEX.finditer(data) for word in match.groups()
            if not _NUMBER.fullmatch(word)
        )  # fmt: skip
        raise MeshError(
            "a vertex is not three numbers",
            file=path,
            line=line_of(data, at),
            value=word.decode("ascii", "replace")[:40],
        ) from error


def _read(path: Path, data: bytes, _options: ReadOptions) -> MeshData:
    triangles = read_stl(path, data)
    return MeshData(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))


FORMAT = MeshFormat(_read, _check)
