"""load_mesh: read a mesh file and convert it to metres; the unit must be given, as no format holds it."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import MeshError, nearest
from pentapod.base.files import read_bytes
from pentapod.base.progress import Progress, silent
from pentapod.mesh.io.registry import KNOWN, MESH_FORMATS, MeshFormat
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
    crease_angle: float = CREASE_ANGLE,
    progress: Progress = silent,
) -> Mesh:
    """Return the mesh of an STL, PLY or OBJ file, or of a plug-in's format, in metres; the suffix names the format.

    unit: of the file's numbers, one of `UNITS`; required. scale: factor after the unit. repair: also wind facets alike
    (see `Mesh.of`), and drop any number of useless facets; without it more than 1 % of degenerate or duplicated facets
    is an error. flip: turn all facets over. crease_angle: radians. Raises MeshError of one line: no such file, a
    folder, too large, empty, truncated, not a mesh, no facets, zero area, coordinates that are not finite, unit missing
    (with the size in each unit) or unknown.
    """
    path = Path(path)
    if unit is not None and unit not in UNITS:
        raise MeshError("unknown unit", file=path, key="unit", value=unit, remedy=nearest(unit, UNITS))
    if not (np.isfinite(scale) and scale > 0.0):
        raise MeshError("the scale must be positive", file=path, key="scale", value=scale)
    progress("mesh", 0.0, "reading")
    vertices, faces, notes = _read(path, repair=repair)
    if flip:
        faces, notes = faces[:, ::-1], (*notes, "all facets turned over: flip = true")
    extents = _extents(vertices)
    sizes, likely = _sizes(extents)
    if unit is None:
        raise MeshError(
            f"the unit of the mesh is missing; the part would be {sizes}", file=path, key="unit",
            expected="one of " + ", ".join(UNITS), remedy=f'unit = "{likely}" is likely',
        )  # fmt: skip
    low, high = PLAUSIBLE.sizes
    if extents.any() and not low <= float(extents.max()) * UNITS[unit] * scale <= high:
        notes += (f'doubtful unit "{unit}": the part would be {sizes}; unit = "{likely}" is likely',)
    mesh = Mesh.of(
        vertices * (UNITS[unit] * scale), faces, repair=repair, source=path.name, crease_angle=crease_angle,
        notes=notes, progress=progress,
    )  # fmt: skip
    degenerate, duplicated = mesh.diagnosis.degenerate, mesh.diagnosis.duplicated
    if not repair and degenerate + duplicated > PLAUSIBLE.most_dropped * len(faces):
        raise MeshError(
            f"of {len(faces):,} facets {degenerate:,} span no surface and {duplicated:,} are duplicates",
            file=path,
            expected=f"at most {PLAUSIBLE.most_dropped:.0%}",
            remedy="export the mesh again; where it is complete, repair = true drops these facets",
        )
    return mesh


def _read(path: Path, *, repair: bool) -> tuple[Floats, Ints, tuple[str, ...]]:
    """Return vertices (V, 3) in the file's own unit, facets (F, 3) and notes."""
    with contextlib.suppress(OSError), path.open("rb") as stream:  # where it fails, `read_bytes` tells why
        if head := stream.read(HEAD_BYTES):
            _format(path).check(path, head, path.stat().st_size)
    data = read_bytes(path, MeshError, f"a mesh: {KNOWN}")
    if not data.strip():
        raise MeshError("the file is empty", file=path)
    vertices, faces, notes = _format(path).read(path, data, repair)
    if not len(faces):
        raise MeshError("the mesh has no facets", file=path, expected="a surface made of triangles")
    return vertices, faces, notes


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
