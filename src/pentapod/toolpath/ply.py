"""PLY, binary and in text: trimesh reads it; what it announces is counted, and what is wrong is given its line."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.errors import MeshError
from pentapod.toolpath.text_mesh import AGAIN, NUMBER, check_last_line, line_of

_HEADER_END = re.compile(rb"^end_header[ \t]*\r?\n", re.MULTILINE)
_HEADER_LINE = re.compile(
    rb"ply|format (?:ascii|binary_little_endian|binary_big_endian) 1\.0|(?:comment|obj_info)\b.*|element \w+ \d+"
    rb"|property (?:list \w+ )?\w+ \w+|end_header"
)
_STRANGE = re.compile(
    rb"^(?![ \t]*(?:" + NUMBER + rb"(?:[ \t]+" + NUMBER + rb")*)?[ \t\r]*$)(.*)$", re.MULTILINE
)  # fmt: skip
_ELEMENT = re.compile(rb"^[ \t]*element[ \t]+(\w+)[ \t]+(\d+)", re.MULTILINE)


def read_ply(path: Path, data: bytes) -> tuple[Floats, Ints]:
    """Return vertices (V, 3) in the file's own numbers and facets (F, 3). Raises MeshError, with the line in text."""
    end = _HEADER_END.search(data)
    _check_header(path, data[: end.end() if end else None])
    if end is None:
        raise MeshError(
            'cannot be read as PLY: "end_header" is missing', file=path, line=line_of(data, len(data)), remedy=AGAIN
        )
    if re.search(rb"^format ascii", data[: end.end()], re.MULTILINE):
        if strange := _STRANGE.search(data, end.end()):
            value = strange[1].decode("utf-8", "replace").strip()[:40]
            line = line_of(data, strange.start())
            raise MeshError("cannot be read as PLY: not numbers", file=path, line=line, value=value, remedy=AGAIN)
        check_last_line(path, data)
    vertices, faces = _through_trimesh(path, data)
    _check_counts(path, data[: end.end()], len(vertices), len(faces))
    return vertices, faces


def _check_header(path: Path, header: bytes) -> None:
    """Raise MeshError for the first line of the header that is none."""
    for number, text in enumerate(header.splitlines(), start=1):
        words = b" ".join(text.split())
        if words and not _HEADER_LINE.fullmatch(words):
            value = text.decode("utf-8", "replace").strip()[:40]
            what = "cannot be read as PLY: not a line of a header"
            raise MeshError(what, file=path, line=number, value=value, remedy=AGAIN)


def _through_trimesh(path: Path, data: bytes) -> tuple[Floats, Ints]:
    import trimesh  # noqa: PLC0415 - heavy, and only needed here

    try:
        loaded: Any = trimesh.load(io.BytesIO(data), file_type="ply", force="mesh", process=False, skip_materials=True)
        vertices = np.asarray(loaded.vertices, dtype=np.float64)
        faces = np.asarray(loaded.faces).reshape(-1, 3)
    except Exception as error:  # what a reader raises on a broken file is not foreseeable
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise MeshError(f"cannot be read as PLY: {reason}", file=path, remedy=AGAIN) from error
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise MeshError("a vertex of this PLY is not three numbers", file=path)
    return vertices, faces.astype(np.intp)


def _check_counts(path: Path, header: bytes, vertices: int, faces: int) -> None:
    """Raise MeshError where the header announces more than was read."""
    announced = {m[1]: int(m[2]) for m in _ELEMENT.finditer(header)}
    for name, what, found in ((b"face", "facets", faces), (b"vertex", "vertices", vertices)):
        # Of a cloud of points, which has no facets at all, something better is said later.
        if announced.get(name, 0) > found and announced.get(b"face", 0):
            raise MeshError(
                f"truncated: the header announces {announced[name]:,} {what}, the file holds {found:,}",
                file=path,
                remedy="export the mesh again",
            )
