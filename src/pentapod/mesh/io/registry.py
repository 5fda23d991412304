"""Registry of mesh formats by suffix: pentapod's own, and those of other packages by entry points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import MeshError
from pentapod.base.registry import Registry
from pentapod.base.values import Value


def _accept(_path: Path, _head: bytes, _size: int) -> None:
    """Accept any file."""


@dataclass(frozen=True)
class MeshFormat(Value):
    """A format of mesh files.

    read: path, data and `loose` → vertices (V, 3) in the file's own unit, facets (F, 3), and notes; loose: whether any
    number of unused vertices is accepted. check: path, first bytes and size, called before the whole file is read.
    Both raise MeshError with file and line.
    """

    read: Callable[[Path, bytes, bool], tuple[Floats, Ints, tuple[str, ...]]]
    check: Callable[[Path, bytes, int], None] = _accept


_HOMES = {suffix: f"pentapod.mesh.io.{suffix}" for suffix in ("obj", "ply", "stl")}
KNOWN = ", ".join(f".{suffix}" for suffix in _HOMES)
MESH_FORMATS = Registry("mesh format", "pentapod.mesh_formats", MeshFormat, MeshError, homes=_HOMES, constant="FORMAT")
"""Formats by suffix, in lower case and without its dot."""
