"""Reader of DXF drawings: lines of the model space, with curves as chords within a tolerance."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.toolpath.inputs.files import check_points, distinct, extra

_METRES = {"IN": 25.4e-3, "FT": 304.8e-3, "MM": 1e-3, "CM": 1e-2, "M": 1.0, "DM": 0.1}
"""Units by their names in ezdxf."""
_LINE = re.compile(r"line (\d+)")
_WITH_LINES = {
    "INSERT": "explode blocks into lines",
    "TEXT": "turn text into lines, or delete it",
    "MTEXT": "turn text into lines, or delete it",
}
"""What shows lines in a drawing that are not read, and what to do with it: leaving it out would be a silent loss."""
_MOST_BYTES = 16_000_000
_LARGEST_M = 1e4
"""No drawing reaches farther from its origin: a circle of 1e300 would have no end of chords."""


def dxf_lines(path: Path, data: bytes, tolerance: float) -> list[Floats]:
    """Return the lines of a DXF's model space, whose header must say its unit.

    Raises ToolpathError for blocks and text, which would be left out; dimensions and points are passed over.
    """
    if len(data) > _MOST_BYTES:
        raise ToolpathError("the file is too large", file=path, value=len(data), expected=f"at most {_MOST_BYTES:,}")
    if not data.rstrip(b" \t\r\n\0").endswith(b"EOF"):
        raise ToolpathError(
            "EOF is missing: the file was cut off, or is no DXF",
            file=path,
            line=data.count(b"\n") + 1,
            remedy="export it again",
        )
    paths = extra("ezdxf.path", "ezdxf", path)
    recover = extra("ezdxf.recover", "ezdxf", path)
    units = extra("ezdxf.units", "ezdxf", path)
    try:
        document, audit = recover.read(io.BytesIO(data))
        if audit.has_errors:
            raise ToolpathError(f"broken DXF: {audit.errors[0].message}".splitlines()[0][:120], file=path)
        told = int(document.header.get("$INSUNITS", 0))
        unit = next((metres for name, metres in _METRES.items() if getattr(units, name) == told), None)
        if unit is None:
            raise ToolpathError(
                "the drawing does not say its unit", file=path, key="$INSUNITS", expected="mm, cm, m, inch or foot"
            )
        lines: list[Floats] = []
        count = 0
        for entity in document.modelspace():
            if entity.dxftype() in _WITH_LINES:
                raise ToolpathError(
                    f"{entity.dxftype()} is not read", file=path, key=f"handle {entity.dxf.handle}",
                    expected="lines, polylines, arcs, circles, ellipses and splines",
                    remedy=f"{_WITH_LINES[entity.dxftype()]} in the drawing program",
                )  # fmt: skip
            try:
                outline = paths.make_path(entity)
            except TypeError:
                continue  # dimensions, points and the like are no lines to follow
            parts = outline.sub_paths() if outline.has_sub_paths else [outline]
            for part in parts:
                corners = np.array([[p.x, p.y] for p in part.control_vertices()]).reshape(-1, 2)
                if not (np.abs(corners) * unit <= _LARGEST_M).all():
                    raise ToolpathError(
                        f"{entity.dxftype()} reaches beyond any part", file=path, key=f"handle {entity.dxf.handle}",
                        expected=f"within {_LARGEST_M:,.0f} m of the origin",
                    )  # fmt: skip
                points: list[list[float]] = []
                for p in part.flattening(tolerance / unit):
                    points.append([p.x, p.y])
                    count += 1
                    check_points(path, count)
                lines.append(unit * distinct(np.array(points).reshape(-1, 2)))
    except ToolpathError:
        raise
    except Exception as error:  # of whatever kind: what is in the file decides how the parser stumbles
        place = _LINE.search(str(error))
        what = f"cannot be read as DXF: {error}".splitlines()[0][:120]
        raise ToolpathError(what, file=path, line=int(place[1]) if place else None) from error
    return lines
