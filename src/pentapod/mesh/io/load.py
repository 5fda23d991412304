"""load_mesh: a mesh file and its unit to a Mesh; a missing unit is an error."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import MeshError, nearest
from pentapod.base.files import read_bytes
from pentapod.base.progress import Progress, silent
from pentapod.mesh.io.registry import KNOWN, MESH_FORMATS
from pentapod.mesh.mesh import CREASE_ANGLE, Mesh

UNITS: dict[str, float] = {"mm": 1e-3, "cm": 1e-2, "inch": 25.4e-3, "m": 1.0}
"""Metres in each unit that a mesh file's numbers may have."""

_HEAD = 4096
_DOUBTFUL_M = (2e-3, 2.0)
"""Largest extents outside of this are rather a mistaken unit than a part."""

_MOST_DROPPED = 0.01
"""Share of the facets that may be degenerate or doubled: a file whose bytes have slipped has more."""

_USUAL_PART_M = 0.15
"""A part that is at home on a desktop machine: what "likely" means when the unit is missing."""


def load_mesh(
    path: str | Path,
    unit: str | None = None,
    *,
    scale: float = 1.0,
    repair: bool = False,
    crease_angle: float = CREASE_ANGLE,
    progress: Progress = silent,
) -> Mesh:
    """Return the mesh of an STL, PLY or OBJ file, or of a further format, in metres; the suffix names the format.

    unit: of the file's numbers, one of `UNITS`; compulsory, as no format says it. scale: factor after the
    unit. repair: also wind facets alike (see `Mesh.of`), and leave useless facets out however many they are: without
    it more than 1 % degenerate or doubled ones are an error. crease_angle: radians. Raises MeshError, always in one
    line: no such file, too large, a directory, empty, truncated, not a mesh, no facets, zero area, coordinates that
    are not finite, unit missing (with the extents in each) or unknown.
    """
    path = Path(path)
    if unit is not None and unit not in UNITS:
        raise MeshError("unknown unit", file=path, key="unit", value=unit, remedy=nearest(unit, UNITS))
    if not (np.isfinite(scale) and scale > 0.0):
        raise MeshError("the scale must be positive", file=path, key="scale", value=scale)
    progress("mesh", 0.0, "reading")
    vertices, faces, notes = _read(path, repair=repair)
    if unit is None:
        raise _unit_missing(path, vertices)
    notes += _unit_doubtful(vertices, unit, scale)
    mesh = Mesh.of(
        vertices * (UNITS[unit] * scale),
        faces,
        repair=repair,
        source=path.name,
        crease_angle=crease_angle,
        notes=notes,
        progress=progress,
    )
    if not repair:
        _check_dropped(path, mesh, len(faces))
    return mesh


def _check_dropped(path: Path, mesh: Mesh, held: int) -> None:
    """Raise MeshError where more facets of a file are of no use than a good exporter leaves."""
    degenerate, duplicated = mesh.diagnosis.degenerate, mesh.diagnosis.duplicated
    if degenerate + duplicated > _MOST_DROPPED * held:
        raise MeshError(
            f"of {held:,} facets {degenerate:,} span no surface and {duplicated:,} are there twice",
            file=path,
            expected=f"at most {_MOST_DROPPED:.0%}",
            remedy="export the mesh again; where it is whole, repair = true leaves these facets out",
        )


def _read(path: Path, *, repair: bool) -> tuple[Floats, Ints, tuple[str, ...]]:
    """Return vertices (V, 3) in the file's numbers, facets (F, 3) and notes."""
    suffix = path.suffix.lower().removeprefix(".")
    head, size = _head(path)
    if suffix not in MESH_FORMATS:
        known = ", ".join(f".{name}" for name in MESH_FORMATS)
        raise MeshError("not a mesh format that is read", file=path, value=path.suffix.lower(), expected=known)
    form = MESH_FORMATS.find(suffix)
    form.check(path, head, size)
    data = read_bytes(path, MeshError, f"a mesh: {KNOWN}")
    if not data.strip():
        raise MeshError("the file is empty", file=path)
    vertices, faces, notes = form.read(path, data, repair)
    if not len(faces):
        raise MeshError("the mesh has no facets", file=path, expected="a surface made of triangles")
    return vertices, faces, notes


def _head(path: Path) -> tuple[bytes, int]:
    """Return a file's first bytes and its size."""
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD)
        size = path.stat().st_size
    except FileNotFoundError as error:
        raise MeshError("no such file", file=path, expected=f"a mesh: {KNOWN}") from error
    except IsADirectoryError as error:
        raise MeshError("a directory, not a mesh file", file=path) from error
    except OSError as error:
        raise MeshError(f"cannot be read: {error.strerror}", file=path) from error
    if not head:
        raise MeshError("the file is empty", file=path)
    return head, size


def _unit_missing(path: Path, vertices: Floats) -> MeshError:
    """Return the error that shows how large the part would be in each unit, and which is likely."""
    shown, likely = _sizes(_extents(vertices))
    return MeshError(
        f"the unit of the mesh is missing; the part would be {shown}",
        file=path,
        key="unit",
        expected="one of " + ", ".join(UNITS),
        remedy=f'unit = "{likely}" is likely',
    )


def _unit_doubtful(vertices: Floats, unit: str, scale: float) -> tuple[str, ...]:
    """Return a note where the part comes out smaller or larger than parts are."""
    extents = _extents(vertices)
    low, high = _DOUBTFUL_M
    if low <= float(extents.max()) * UNITS[unit] * scale <= high or not extents.max() > 0.0:
        return ()
    shown, likely = _sizes(extents)
    return (f'doubtful unit "{unit}": the part would be {shown}; unit = "{likely}" is likely',)


def _extents(vertices: Floats) -> Floats:
    finite = vertices[np.isfinite(vertices).all(axis=1)]
    return np.ptp(finite, axis=0) if len(finite) else np.zeros(3)


def _sizes(extents: Floats) -> tuple[str, str]:
    """Return how large a part with these numbers is in each unit, and the likely unit."""
    sizes = {u: " x ".join(f"{1e3 * factor * e:.4g}" for e in extents) for u, factor in UNITS.items()}
    largest = max(float(extents.max()), 1e-300)
    likely = min(UNITS, key=lambda u: abs(np.log(largest * UNITS[u] / _USUAL_PART_M)))
    shown = ", ".join(f'as "{u}" {size} mm' for u, size in sizes.items())
    return shown, likely
