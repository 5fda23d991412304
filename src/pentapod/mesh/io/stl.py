"""STL, binary and ASCII: triangles from bytes, with the file's own faults told apart.

The format: https://www.fabbers.com/tech/STL_Format. Binary: 80 bytes of text, the number of facets, then 50
bytes a facet (normal, three corners, an attribute). ASCII: `solid`, facets in words, `endsolid`.
"""

from __future__ import annotations

import re
from itertools import chain
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import MeshError
from pentapod.mesh.io.registry import MeshFormat
from pentapod.mesh.io.text import AGAIN, NUMBER, line_of

_HEADER = 84
_FACET = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_SOLID = b"solid"
_FLOAT = re.compile(NUMBER)
_WORDS = (b"facet", b"endfacet", b"endsolid")
_VERTEX = re.compile(rb"vertex[ \t]++(\S++)[ \t]++(\S++)[ \t]++(\S++)", re.IGNORECASE)


def read_stl(path: Path, data: bytes) -> Floats:
    """Return triangles (F, 3, 3) in the file's own numbers. Raises MeshError naming the fault.

    What counts is the size that a binary header announces: files that begin with `solid` may be binary.
    """
    announced = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER else None
    if announced is not None and len(data) == _HEADER + _FACET.itemsize * announced:
        return _binary(data, announced)
    if data.lstrip()[: len(_SOLID)].lower() == _SOLID and (_is_text(data[:4096]) or announced is None):
        return _ascii(path, data)
    if _is_text(data[:4096]):
        raise MeshError("a text file, not STL", file=path, expected='binary STL, or text that begins with "solid"')
    if announced is None:
        raise MeshError(
            f"truncated: {len(data)} bytes, shorter than the header of a binary STL", file=path, remedy=AGAIN
        )
    held = (len(data) - _HEADER) // _FACET.itemsize
    if held < announced:
        raise MeshError(
            f"truncated: the header announces {announced:,} facets, the file holds {held:,}",
            file=path,
            remedy=AGAIN,
        )
    extra = len(data) - _HEADER - _FACET.itemsize * announced
    raise MeshError(f"{extra:,} bytes stand after the last of {announced:,} facets", file=path, remedy=AGAIN)


def _check_size(path: Path, head: bytes, size: int) -> None:
    """Raise MeshError where the head announces another size than the file has, and it is not text either."""
    if len(head) < _HEADER or _is_text(head) or not head.strip():
        return
    announced = int.from_bytes(head[80:84], "little")
    held = (size - _HEADER) // _FACET.itemsize
    if held < announced:
        raise MeshError(
            f"truncated: the header announces {announced:,} facets, the file holds {held:,}", file=path, remedy=AGAIN
        )
    if held > 2 * announced + 100:
        raise MeshError(
            f"the header announces {announced:,} facets, the file has room for {held:,}", file=path, remedy=AGAIN
        )


def _indexed(path: Path, data: bytes, _loose: bool) -> tuple[Floats, Ints, tuple[str, ...]]:
    triangles = read_stl(path, data)
    return triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3), ()


def write_stl(triangles: Floats, name: str) -> bytes:
    """Return a binary STL of triangles (F, 3, 3): same numbers, same bytes. name: at most 80 of ASCII."""
    corners = np.asarray(triangles, dtype=np.float64).astype("<f4")
    sides = corners.astype(np.float64)
    normal = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    facets = np.zeros(len(corners), dtype=_FACET)
    facets["corners"] = corners
    facets["normal"] = normal / np.where(length > 0.0, length, 1.0)
    return name.encode("ascii")[:80].ljust(80) + len(facets).to_bytes(4, "little") + facets.tobytes()


def _binary(data: bytes, count: int) -> Floats:
    return np.frombuffer(data, dtype=_FACET, count=count, offset=_HEADER)["corners"].astype(np.float64)


def _is_text(data: bytes) -> bool:
    """Whether bytes look like text: no NUL, hardly any control characters."""
    control = sum(byte < 32 and byte not in b"\t\n\r\f\v" for byte in data)
    return b"\0" not in data and control <= len(data) // 100


def _ascii(path: Path, data: bytes) -> Floats:
    numbers = _VERTEX.findall(data)
    words = {word: len(re.findall(rb"^[ \t]*+" + word, data, re.IGNORECASE | re.MULTILINE)) for word in _WORDS}
    facets = words[b"facet"]
    if not facets and not numbers and not words[b"endsolid"]:
        raise MeshError('begins with "solid", but no facet follows', file=path, expected="an STL file")
    if not words[b"endsolid"] or words[b"endfacet"] != facets or len(numbers) != 3 * facets:
        raise MeshError(
            f"truncated or malformed: {facets:,} facets begin, {words[b'endfacet']:,} end, "
            f"{len(numbers):,} vertices in all" + ("" if words[b"endsolid"] else ', "endsolid" is missing'),
            file=path,
            line=line_of(data, len(data)),
            remedy=AGAIN,
        )
    if not numbers:
        return np.zeros((0, 3, 3))
    try:
        values = np.fromiter(map(float, chain.from_iterable(numbers)), np.float64, 3 * len(numbers))
    except ValueError as error:
        raise _not_a_number(path, data) from error
    # Python takes 1_0 for ten.
    if b"_" in data and any(b"_" in word for word in chain.from_iterable(numbers)):
        raise _not_a_number(path, data)
    return values.reshape(-1, 3, 3)


def _not_a_number(path: Path, data: bytes) -> MeshError:
    """Return the error about the first vertex that is not three numbers, with its line."""
    for match in _VERTEX.finditer(data):
        for word in match.groups():
            if not _FLOAT.fullmatch(word):
                line = line_of(data, match.start())
                value = word.decode("ascii", "replace")[:40]
                return MeshError("a vertex is not three numbers", file=path, line=line, value=value)
    return MeshError("a vertex is not three numbers", file=path)


FORMAT = MeshFormat(_indexed, _check_size)
