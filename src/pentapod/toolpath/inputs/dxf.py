"""DXF drawings: entities of the model space as polylines, read with ezdxf."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.toolpath.inputs.files import LIMITS, check_points, distinct, extra

_UNITS_M = {"IN": 25.4e-3, "FT": 304.8e-3, "MM": 1e-3, "CM": 1e-2, "M": 1.0, "DM": 0.1}
"""Metres by the units' names in ezdxf."""
_LINE = re.compile(r"line (\d+)")
_REFUSED = {
    "INSERT": "explode blocks into lines",
    "TEXT": "turn text into lines, or delete it",
    "MTEXT": "turn text into lines, or delete it",
}
"""Entities with lines that are not read, and the remedy: to leave them out would lose lines silently."""


def dxf_lines(path: Path, data: bytes, tolerance: float) -> list[Floats]:
    """Return the polylines (n, 2), metres, of a DXF's model space; its header must give the unit.

    Raises ToolpathError for blocks and text; dimensions and points are ignored.
    """
    most = LIMITS.dxf_bytes
    if len(data) > most:
        raise ToolpathError("the file is too large", file=path, value=len(data), expected=f"at most {most:,}")
    if not data.rstrip(b" \t\r\n\0").endswith(b"EOF"):
        raise ToolpathError(
            "EOF is missing: the file was cut off, or is no DXF", file=path, line=data.count(b"\n") + 1,
            remedy="export it again",
        )  # fmt: skip
    paths = extra("ezdxf.path", "ezdxf", path)
    recover = extra("ezdxf.recover", "ezdxf", path)
    units = extra("ezdxf.units", "ezdxf", path)
    try:
        document, audit = recover.read(io.BytesIO(data))
        if audit.has_errors:
            raise ToolpathError(f"broken DXF: {audit.errors[0].message}".splitlines()[0][:120], file=path)
        code = int(document.header.get("$INSUNITS", 0))
        unit = next((metres for name, metres in _UNITS_M.items() if getattr(units, name) == code), None)
        if unit is None:
            raise ToolpathError(
                "the drawing does not say its unit", file=path, key="$INSUNITS", expected="mm, cm, m, inch or foot"
            )
        lines: list[Floats] = []
        count = 0
        for entity in document.modelspace():
            if entity.dxftype() in _REFUSED:
                raise ToolpathError(
                    f"{entity.dxftype()} is not read", file=path, key=f"handle {entity.dxf.handle}",
                    expected="lines, polylines, arcs, circles, ellipses and splines",
                    remedy=f"{_REFUSED[entity.dxftype()]} in the drawing program",
                )  # fmt: skip
            try:
                outline = paths.make_path(entity)
            except TypeError:
                continue  # dimensions, points and the like have no lines
            parts = outline.sub_paths() if outline.has_sub_paths else [outline]
            for part in parts:
                corners = np.array([[p.x, p.y] for p in part.control_vertices()]).reshape(-1, 2)
                if not (np.abs(corners) * unit <= LIMITS.reach).all():
                    raise ToolpathError(
                        f"{entity.dxftype()} reaches beyond any part", file=path, key=f"handle {entity.dxf.handle}",
                        expected=f"within {LIMITS.reach:,.0f} m of the origin",
                    )  # fmt: skip
                points: list[list[float]] = []
                for p in part.flattening(tolerance / unit):
                    points.append([p.x, p.y])
                    count += 1
                    check_points(path, count)
                lines.append(unit * distinct(np.array(points).reshape(-1, 2)))
    except ToolpathError:
        raise
    except Exception as error:  # of any kind: the parser's exceptions depend on what is in the file
        place = _LINE.search(str(error))
        what = f"cannot be read as DXF: {error}".splitlines()[0][:120]
        raise ToolpathError(what, file=path, line=int(place[1]) if place else None) from error
    return lines
