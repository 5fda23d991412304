"""GLB files (binary glTF 2.0), read by trimesh: all triangles of the scene where they are placed, in metres."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pentapod.base.archives import arrays_of_process
from pentapod.base.errors import MeshError
from pentapod.mesh.io import glb_scene
from pentapod.mesh.io.registry import MOST_FACETS, MeshData, MeshFormat, ReadOptions
from pentapod.mesh.io.text import EXPORT_AGAIN


@dataclass(frozen=True)
class ProcessLimits:
    """seconds of computing and bytes of memory that reading a file may take."""

    seconds: int = 60
    memory: int = 6_000_000_000


UP = "glTF's upward direction is +y: region_direction = [0, 1, 0] machines from above"


def _read(path: Path, _data: bytes, _options: ReadOptions) -> MeshData:
    """Return the facets of a GLB file. Raises MeshError."""
    script, limits = Path(glb_scene.__file__), ProcessLimits()
    made = arrays_of_process(
        script, path, (MOST_FACETS,), ("vertices", "facets"), MeshError, limits.seconds, limits.memory
    )
    if isinstance(made, str):
        what, _, remedy = made.partition("\t")
        raise MeshError(f"cannot be read as GLB: {what or 'it is broken'}", file=path, remedy=remedy or EXPORT_AGAIN)
    return MeshData(made["vertices"], made["facets"].astype(np.intp), (UP,), "m")


def _check(path: Path, head: bytes, size: int) -> None:
    version, length = int.from_bytes(head[4:8], "little"), int.from_bytes(head[8:12], "little")
    if not head.startswith(b"glTF") or version != 2:
        raise MeshError("cannot be read as GLB: not a binary glTF 2.0 file", file=path)
    if length != size:
        what = f"truncated: the header announces {length:,} bytes, the file holds {size:,}"
        raise MeshError(what, file=path, remedy=EXPORT_AGAIN)


FORMAT = MeshFormat(_read, _check, states_unit=True)
