"""load_mesh: read a mesh file and convert it to metres; its unit must be given where the format does not hold it."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import MeshError, nearest
from pentapod.base.files import read_bytes
from pentapod.base.progress import Progress, silent
from pentapod.mesh.io.registry import KNOWN, MESH_FORMATS, MeshData, MeshFormat, ReadOptions
from pentapod.mesh.io.stl import HEAD_BYTES
from pentapod.mesh.mesh import CREASE_ANGLE, Mesh

UNITS: dict[str, float] = {"mm": 1e-3, "cm": 1e-2, "inch": 25.4e-3, "m": 1.0}
"""Metres in each unit that the numbers of a mesh file may have."""


@dataclass(frozen=True)
class Plausibility:
    """What is expected of a mesh file.

    sizes: metres; a largest extent outside of this range suggests a wrong unit. usual_size: metres; the unit that comes
    nearest to it is called likely. most_dropped: largest share of degenerate and duplicated facets.
    """

    sizes: tuple[float, float] = (2e-3, 2.0)
    usual_size: float = 0.15
    most_dropped: float = 0.01


PLAUSIBLE = Plausibility()


def load_mesh(
    path: str | Path,
    unit: str | None = None,
    *,
    scale: float = 1.0,
    repair: bool = False,
    flip: bool = False,
    least_body: float | None = None,
    chordal: float = ReadOptions.chordal,
    crease_angle: float = CREASE_ANGLE,
    progress: Progress = silent,
) -> Mesh:
    """Return the mesh of a file in metres: STL, PLY, OBJ, 3MF, GLB, STEP or a plug-in's format; the suffix names it.

    unit: of the file's numbers, one of `UNITS`; required where the file does not state it, else told if it differs.
    scale: factor after the unit. repair: also wind facets alike (see `Mesh.of`), and drop any number of useless facets;
    without it more than 1 % of degenerate or duplicated facets is an error. flip: turn all facets over. least_body:
    leave out bodies of a smaller extent, metres, such as the debris of a scan. chordal: largest distance of facets from
    the surface of a STEP file, metres. crease_angle: radians. Raises MeshError of one line: no such file, a folder, too
    large, empty, truncated, not a mesh, no facets, zero area, coordinates that are not finite, unit missing (with the
    size in each unit) or unknown.

    >>> part = load_mesh("part.stl", "mm")
    >>> print(part.diagnosis)
    part.stl: 288 facets, 169 vertices, 1 body
      60 x 60 x 8 mm, area 37.53 cm2; open, 1 border loop; winding consistent
    """
    path = Path(path)
    if unit is not None and unit not in UNITS:
        raise MeshError("unknown unit", file=path, key="unit", value=unit, remedy=nearest(unit, UNITS))
    for name, value in (("scale", scale), ("chordal", chordal), ("least_body", least_body)):
        if value is not None and not (np.isfinite(value) and value > 0.0):
            raise MeshError(f"the {name} must be positive", file=path, key=name, value=value)
    progress("mesh", 0.0, "reading")
    read = _read(path, ReadOptions(loose=repair, chordal=chordal / scale))
    faces, normals, notes = read.faces, read.normals, read.notes
    if flip:
        faces, notes = faces[:, ::-1], (*notes, "all facets turned over: flip = true")
        normals = None if normals is None else -normals[:, ::-1]
    metres, told = _metres(path, read, unit, scale)
    mesh = Mesh.of(
        read.vertices * metres, faces, repair=repair, source=path.name, crease_angle=crease_angle,
        notes=(*notes, *told), exact_normals=normals, progress=progress,
    )  # fmt: skip
    degenerate, duplicated = mesh.diagnosis.degenerate, mesh.diagnosis.duplicated
    counts = (("facets without area", degenerate), ("duplicate facets", duplicated))
    faults = [f"{what}: {many:,} of {len(faces):,}" for what, many in counts if many]
    if not repair and degenerate + duplicated > PLAUSIBLE.most_dropped * len(faces):
        raise MeshError(
            ", ".join(faults),
            file=path,
            expected=f"at most {PLAUSIBLE.most_dropped:.0%}",
            remedy="export the mesh again; where it is complete, repair = true drops these facets",
        )
    return mesh if least_body is None else mesh.without_small_bodies(least_body)


def _metres(path: Path, read: MeshData, unit: str | None, scale: float) -> tuple[float, tuple[str, ...]]:
    """Return the length of one in the file's numbers, scaled, and what to tell about its unit. Raises MeshError."""
    extents = _extents(read.vertices)
    sizes, likely = _sizes(extents)
    if read.unit is not None:
        ignored = unit is not None and unit != read.unit
        told = (f'unit = "{unit}" is not used: the file states "{read.unit}"; scale changes the size',)
        return UNITS[read.unit] * scale, told if ignored else ()
    if unit is None:
        raise MeshError(
            f"the unit of the mesh is missing; the part would be {sizes}", file=path, key="unit",
            expected="one of " + ", ".join(UNITS), remedy=f'unit = "{likely}" is likely',
        )  # fmt: skip
    low, high = PLAUSIBLE.sizes
    metres = UNITS[unit] * scale
    if extents.any() and not low <= float(extents.max()) * metres <= high:
        return metres, (f'doubtful unit "{unit}": the part would be {sizes}; unit = "{likely}" is likely',)
    return metres, ()


def _read(path: Path, options: ReadOptions) -> MeshData:
    """Return the content of a mesh file. Raises MeshError."""
    with contextlib.suppress(OSError), path.open("rb") as stream:  # where it fails, `read_bytes` tells why
        if head := stream.read(HEAD_BYTES):
            _format(path).check(path, head, path.stat().st_size)
    data = read_bytes(path, MeshError, f"a mesh: {KNOWN}")
    if not data.strip():
        raise MeshError("the file is empty", file=path)
    read = _format(path).read(path, data, options)
    if not len(read.faces):
        raise MeshError("the mesh has no facets", file=path, expected="a surface made of triangles")
    return read


def _format(path: Path) -> MeshFormat:
    suffix = path.suffix.lower().removeprefix(".")
    if suffix not in MESH_FORMATS:
        known = ", ".join(f".{name}" for name in MESH_FORMATS)
        raise MeshError("not a mesh format that is read", file=path, value=path.suffix.lower(), expected=known)
    return MESH_FORMATS.find(suffix)


def _extents(vertices: Floats) -> Floats:
    finite = vertices[np.isfinite(vertices).all(axis=1)]
    return np.ptp(finite, axis=0) if len(finite) else np.zeros(3)


def _sizes(extents: Floats) -> tuple[str, str]:
    """Return the size of the part in each unit, and the likely unit."""
    sizes = {unit: " x ".join(f"{1e3 * metres * e:.4g}" for e in extents) for unit, metres in UNITS.items()}
    shown = ", ".join(f'as "{unit}" {size} mm' for unit, size in sizes.items())
    largest = max(float(extents.max()), 1e-300)
    return shown, min(UNITS, key=lambda unit: abs(np.log(largest * UNITS[unit] / PLAUSIBLE.usual_size)))
