"""STEP files (ISO 10303-21): shapes of CAD systems, tessellated by Open CASCADE with exact normals (extra `step`).

Facets are nowhere farther from the surface than `chordal`. Lengths are those of the file, whatever its unit.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from pentapod.base.archives import arrays_of_process
from pentapod.base.errors import MeshError
from pentapod.mesh.io import step_tessellation
from pentapod.mesh.io.registry import MOST_FACETS, MeshData, MeshFormat, ReadOptions
from pentapod.mesh.io.text import EXPORT_AGAIN
from pentapod.mesh.normals import unit_or_zero


@dataclass(frozen=True)
class TessellationOptions:
    """angle: largest angle between neighbouring facets, radians. seconds, memory: of the process, in bytes."""

    angle: float = 0.3
    seconds: int = 300
    memory: int = 10_000_000_000


_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
_LENGTH_UNIT = re.compile(
    rb"CONVERSION_BASED_UNIT\s*\(\s*'(INCH)'[^;]{0,99}LENGTH_UNIT"
    rb"|LENGTH_UNIT\s*\(\s*\)[^;]{0,99}?(?:CONVERSION_BASED_UNIT\s*\(\s*'(INCH)'|SI_UNIT\s*\(\s*(\$|\.\w{1,9}\.)\s*,\s*\.METRE\.)"
)
_PREFIX = {b".MILLI.": "mm", b".CENTI.": "cm", b"$": "m"}


def _read(path: Path, data: bytes, options: ReadOptions) -> MeshData:
    """Return the facets of a STEP file. Raises MeshError: the extra is missing, the file is broken or cut off."""
    if not data.rstrip().endswith(b"END-ISO-10303-21;"):
        what = 'truncated: the last line is not "END-ISO-10303-21;"'
        raise MeshError(what, file=path, remedy=EXPORT_AGAIN)
    if find_spec("OCP") is None:
        what = "STEP files are read by Open CASCADE, which is not installed"
        raise MeshError(what, file=path, remedy='pip install "pentapod[step]", or export STL')
    limits = TessellationOptions()
    arguments = (1e3 * options.chordal, limits.angle, MOST_FACETS)
    names = ("vertices", "facets", "normals", "faces")
    made = arrays_of_process(
        Path(step_tessellation.__file__), path, arguments, names, MeshError, limits.seconds, limits.memory
    )
    if isinstance(made, str):
        raise MeshError(
            made or "cannot be read as STEP: Open CASCADE fails, or takes too long", file=path, remedy=EXPORT_AGAIN
        )
    _check_faces(path, data, *made["faces"].tolist(), loose=options.loose)
    facets, unit = made["facets"].astype(np.intp), _unit(data)
    return MeshData(made["vertices"] / _MM[unit], facets, (), unit, unit_or_zero(made["normals"])[facets])


def _check_faces(path: Path, data: bytes, found: int, failed: int, *, loose: bool) -> None:
    """Raise MeshError where faces of the file are missing among the facets."""
    announced = len(re.findall(rb"=\s*(?:ADVANCED_FACE|FACE_SURFACE)\s*\(", data))
    missing = max(announced - found, 0) + failed
    if missing and not loose:
        remedy = "export the shape again; repair = true takes the others"
        raise MeshError(f"{missing:,} of {announced:,} faces cannot be read", file=path, remedy=remedy)


def _unit(data: bytes) -> str:
    """Return the unit of lengths that the file states; mm, to which Open CASCADE converts, where it is not clear."""
    units = {"inch" if inch or other else _PREFIX.get(si.upper(), "") for inch, other, si in _LENGTH_UNIT.findall(data)}
    unit = units.pop() if len(units) == 1 else ""
    return unit or "mm"


def _check(path: Path, head: bytes, _size: int) -> None:
    if not head.lstrip().startswith(b"ISO-10303-21;"):
        raise MeshError('cannot be read as STEP: it does not begin with "ISO-10303-21;"', file=path, line=1)


FORMAT = MeshFormat(_read, _check, states_unit=True)
