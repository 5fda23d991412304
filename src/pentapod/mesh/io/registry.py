"""Registry of mesh formats by suffix: pentapod's own, and those of other packages by entry points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import MeshError
from pentapod.base.registry import Registry
from pentapod.base.values import Value

MOST_FACETS = 20_000_000
"""Facets that a file may unfold to, where it names bodies that it places several times."""


@dataclass(frozen=True)
class ReadOptions(Value):
    """How a file is read. loose: any number of useless parts is accepted.

    chordal: metres before the job's scale, for formats of curved surfaces: largest distance of the facets from them.
    """

    loose: bool = False
    chordal: float = 10e-6


class MeshData(NamedTuple):
    """Content of a mesh file. vertices (V, 3), in the file's own unit; facets (F, 3); notes: sentences.

    unit: one of `UNITS`, where the file states it. normals (F, 3, 3): of the surface at the facets' corners, of unit
    length, where the file has them exactly.
    """

    vertices: Floats
    faces: Ints
    notes: tuple[str, ...] = ()
    unit: str | None = None
    normals: Floats | None = None


def _accept(_path: Path, _head: bytes, _size: int) -> None:
    """Accept any file."""


@dataclass(frozen=True)
class MeshFormat(Value):
    """A format of mesh files.

    read: path, data and `ReadOptions` → `MeshData`. check: path, first bytes and size, called before the whole file is
    read. Both raise MeshError with file and line. states_unit: whether files state their unit.
    """

    read: Callable[[Path, bytes, ReadOptions], MeshData]
    check: Callable[[Path, bytes, int], None] = _accept
    states_unit: bool = False


_FILES = {"obj": "obj", "ply": "ply", "stl": "stl", "3mf": "threemf", "glb": "glb", "step": "step", "stp": "step"}
_HOMES = {suffix: f"pentapod.mesh.io.{name}" for suffix, name in _FILES.items()}
KNOWN = ", ".join(f".{suffix}" for suffix in _HOMES)
MESH_FORMATS = Registry("mesh format", "pentapod.mesh_formats", MeshFormat, MeshError, homes=_HOMES, constant="FORMAT")
"""Formats by suffix, in lower case and without its dot."""


def states_unit(name: str | Path) -> bool:
    """Return whether mesh files of this name state their unit."""
    suffix = Path(name).suffix.lower().removeprefix(".")
    return suffix in MESH_FORMATS and MESH_FORMATS.find(suffix).states_unit
