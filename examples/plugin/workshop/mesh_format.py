"""A mesh format: OFF, Geomview's Object File Format, read by trimesh."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import trimesh

from pentapod.base.errors import MeshError
from pentapod.mesh import MeshData, MeshFormat, ReadOptions


def _check(path: Path, head: bytes, _size: int) -> None:
    if not head.startswith(b"OFF"):
        raise MeshError('cannot be read as OFF: it does not begin with "OFF"', file=path, line=1)


def _read(path: Path, data: bytes, _options: ReadOptions) -> MeshData:
    try:
        shape = trimesh.load_mesh(io.BytesIO(data), file_type="off", process=False)
    except Exception as error:  # of any kind: trimesh's exceptions depend on what is in the file
        raise MeshError(f"cannot be read as OFF: {error}", file=path, remedy="export the mesh again") from error
    return MeshData(np.asarray(shape.vertices), np.asarray(shape.faces))


FORMAT = MeshFormat(_read, _check)
