"""Drawings, SVG or DXF by the file's suffix, as polylines."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.toolpath.inputs.dxf import dxf_lines
from pentapod.toolpath.inputs.files import small_file
from pentapod.toolpath.inputs.svg import svg_lines


def read_lines(path: str | Path, tolerance: float) -> list[Floats]:
    """Return the polylines (n, 2), metres, y up, of an .svg or .dxf file; chords deviate from curves by `tolerance`.

    Raises ToolpathError with the file: missing, of another kind, without a line or a unit.

    >>> len(read_lines("line.svg", tolerance=1e-5))
    1
    """
    path = Path(path)
    readers: dict[str, Callable[[Path, bytes, float], list[Floats]]] = {".svg": svg_lines, ".dxf": dxf_lines}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise ToolpathError("unknown kind of drawing", file=path, value=path.suffix, expected=" or ".join(readers))
    lines = [line for line in reader(path, small_file(path), tolerance) if len(line) > 1]
    if not lines:
        raise ToolpathError("the drawing holds no line", file=path)
    if not all(np.isfinite(line).all() for line in lines):
        raise ToolpathError("the drawing holds numbers that are not finite", file=path)
    return lines
