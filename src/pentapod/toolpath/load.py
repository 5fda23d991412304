"""load_mesh: a mesh file with its unit → Mesh. Nothing is guessed; what is missing is asked for."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.errors import MeshError, nearest
from pentapod.toolpath.mesh import CREASE_ANGLE, Mesh
from pentapod.toolpath.stl import read_stl

UNITS: dict[str, float] = {"mm": 1e-3, "cm": 1e-2, "inch": 25.4e-3, "m": 1.0}
"""Metres in each unit that a mesh file's numbers may have."""

FORMATS = (".obj", ".ply", ".stl")

_USUAL_PART_M = 0.15
"""A part that is at home on a desktop machine: what "likely" means when the unit is missing."""


def load_mesh(
    path: str | Path,
    unit: str | None = None,
    *,
    scale: float = 1.0,
    repair: bool = False,
    crease_angle: float = CREASE_ANGLE,
) -> Mesh:
    """Return the mesh of an STL, PLY or OBJ file, in metres; the suffix names the format.

    unit: of the file's numbers, one of `UNITS`; compulsory, as no format says it. scale: factor after the
    unit. repair: also wind facets alike (see `Mesh.of`). crease_angle: radians. Raises MeshError, always in
    one line: no such file, a directory, empty, truncated, not a mesh, no facets, zero area, coordinates
    that are not finite, unit missing (with the extents in each) or unknown.
    """
    path = Path(path)
    if unit is not None and unit not in UNITS:
        raise MeshError("unknown unit", file=path, key="unit", value=unit, remedy=nearest(unit, UNITS))
    if not (np.isfinite(scale) and scale > 0.0):
        raise MeshError("the scale must be positive", file=path, key="scale", value=scale)
    vertices, faces, notes = _read(path)
    if unit is None:
        raise _unit_missing(path, vertices)
    return Mesh.of(
        vertices * (UNITS[unit] * scale),
        faces,
        repair=repair,
        source=path.name,
        crease_angle=crease_angle,
        notes=notes,
    )


def _read(path: Path) -> tuple[Floats, Ints, tuple[str, ...]]:
    """Return vertices (V, 3) in the file's numbers, facets (F, 3) and notes."""
    suffix = path.suffix.lower()
    data = _bytes(path)
    if suffix not in FORMATS:
        raise MeshError("not a mesh format I read", file=path, value=suffix, expected=", ".join(FORMATS))
    notes: tuple[str, ...] = ()
    if suffix == ".stl":
        triangles, notes = read_stl(path, data)
        vertices, faces = triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
    else:
        vertices, faces = _through_trimesh(path, suffix, data)
    if not len(faces):
        raise MeshError("the mesh has no facets", file=path, expected="a surface made of triangles")
    return vertices, faces, notes


def _bytes(path: Path) -> bytes:
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise MeshError("no such file", file=path, expected="a mesh: " + ", ".join(FORMATS)) from error
    except IsADirectoryError as error:
        raise MeshError("a directory, not a mesh file", file=path) from error
    except OSError as error:
        raise MeshError(f"cannot be read: {error.strerror}", file=path) from error
    if not data.strip():
        raise MeshError("the file is empty", file=path)
    return data


def _through_trimesh(path: Path, suffix: str, data: bytes) -> tuple[Floats, Ints]:
    import trimesh  # noqa: PLC0415 - heavy, and only needed here

    try:
        loaded: Any = trimesh.load(
            io.BytesIO(data), file_type=suffix[1:], force="mesh", process=False, skip_materials=True
        )
        vertices = np.asarray(loaded.vertices, dtype=np.float64)
        faces = np.asarray(loaded.faces).reshape(-1, 3)
    except Exception as error:  # what a reader raises on a broken file is not foreseeable
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        name = suffix[1:].upper()
        raise MeshError(f"cannot be read as {name}: {reason}", file=path, remedy="the file may be truncated") from error
    if suffix == ".ply":
        _check_ply_counts(path, data, len(vertices), len(faces))
    return vertices, faces.astype(np.intp)


def _check_ply_counts(path: Path, data: bytes, vertices: int, faces: int) -> None:
    """Raise MeshError where the header announces more than was read."""
    header = data.split(b"end_header", 1)[0]
    announced = {m[1]: int(m[2]) for m in re.finditer(rb"element\s+(\w+)\s+(\d+)", header)}
    for name, found in ((b"face", faces), (b"vertex", vertices)):
        # Of a cloud of points, which has no facets at all, something better is said later.
        if announced.get(name, 0) > found and announced.get(b"face", 0):
            raise MeshError(
                f"truncated: the header announces {announced[name]:,} {name.decode()}, the file holds {found:,}",
                file=path,
                remedy="export the mesh again",
            )


def _unit_missing(path: Path, vertices: Floats) -> MeshError:
    """Return the error that shows how large the part would be in each unit, and which is likely."""
    extents = np.ptp(vertices[np.isfinite(vertices).all(axis=1)], axis=0) if len(vertices) else np.zeros(3)
    sizes = {u: " x ".join(f"{1e3 * factor * e:.4g}" for e in extents) for u, factor in UNITS.items()}
    largest = max(float(extents.max()), 1e-300)
    likely = min(UNITS, key=lambda u: abs(np.log(largest * UNITS[u] / _USUAL_PART_M)))
    shown = ", ".join(f'as "{u}" {size} mm' for u, size in sizes.items())
    return MeshError(
        f"the unit of the mesh is missing; the part would be {shown}",
        file=path,
        key="unit",
        expected="one of " + ", ".join(UNITS),
        remedy=f'unit = "{likely}" is likely',
    )
