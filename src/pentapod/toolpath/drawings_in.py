"""Drawings in: flat lines from SVG and DXF files, curves as chords within a tolerance."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from pentapod.arrays import Floats
from pentapod.errors import InputError, ToolpathError

_MOST_BYTES = 64 * 1024 * 1024
_PX_M = 25.4e-3 / 96.0
_DXF_UNITS = {1: 25.4e-3, 2: 304.8e-3, 4: 1e-3, 5: 1e-2, 6: 1.0, 14: 0.1}
_LINE = re.compile(r"line (\d+)")
_LEAST_CHORDS, _MOST_CHORDS = 8, 4096


def read_lines(path: str | Path, tolerance: float) -> list[Floats]:
    """Return the lines (n, 2), metres, y up, of an .svg or .dxf file; curves leave their chords by `tolerance`.

    Raises ToolpathError, naming the file, for what is no such file, holds no line, or has no unit.
    """
    path = Path(path)
    readers: dict[str, Callable[[Path, bytes, float], list[Floats]]] = {".svg": _svg, ".dxf": _dxf}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise ToolpathError("unknown kind of drawing", file=path, value=path.suffix, expected=" or ".join(readers))
    lines = [line for line in reader(path, small_file(path), tolerance) if len(line) > 1]
    if not lines:
        raise ToolpathError("the drawing holds no line", file=path)
    if not all(np.isfinite(line).all() for line in lines):
        raise ToolpathError("the drawing holds numbers that are not finite", file=path)
    return lines


def small_file(path: Path, most: int = _MOST_BYTES) -> bytes:
    """Return a file's bytes. Raises ToolpathError where it is not there, empty, or larger than `most`."""
    try:
        size = path.stat().st_size
        if size > most:
            raise ToolpathError("the file is too large", file=path, value=size, expected=f"at most {most:,} bytes")
        data = path.read_bytes()
    except OSError as error:
        raise ToolpathError(f"cannot be read: {error.strerror}", file=path) from error
    if not data.strip(b" \t\r\n\0"):
        raise ToolpathError("the file is empty", file=path)
    return data


def extra(module: str, package: str, path: Path) -> Any:
    """Return an optional module. Raises InputError that names the extra to install."""
    try:
        return import_module(module)
    except ImportError as error:
        raise InputError(
            f"reading this needs the package {package}", file=path, remedy='pip install "pentapod[drawings]"'
        ) from error


def _svg(path: Path, data: bytes, tolerance: float) -> list[Floats]:
    """Return the lines of an SVG; 96 user units are an inch where the file says nothing else; y turned up."""
    svg = extra("svgelements", "svgelements", path)
    try:
        text = data.decode("utf-8")
        # The parser below takes what it gets of a file that was cut off.
        ElementTree.fromstring(text)
        shapes = [e for e in svg.SVG.parse(io.StringIO(text), reify=True).elements() if isinstance(e, svg.Shape)]
        lines = [line for shape in shapes for line in _svg_lines(svg, shape, tolerance / _PX_M)]
    except UnicodeDecodeError as error:
        raise ToolpathError("not a text file in UTF-8", file=path, expected="an SVG file") from error
    except ElementTree.ParseError as error:
        what = f"not a whole SVG file: {error}".split(": line")[0]
        raise ToolpathError(what, file=path, line=error.position[0]) from error
    except Exception as error:
        line = getattr(error, "position", (None, None))[0]
        raise ToolpathError(f"cannot be read as SVG: {error}".splitlines()[0], file=path, line=line) from error
    return [_PX_M * line * [1.0, -1.0] for line in lines]


def _svg_lines(svg: Any, shape: Any, tolerance: float) -> list[Floats]:
    """Return the lines of one shape, in user units."""
    lines: list[list[Floats]] = []
    for segment in svg.Path(shape).segments():
        if isinstance(segment, svg.Move) or not lines:
            lines.append([])
        if isinstance(segment, svg.Move):
            if segment.end is not None:
                lines[-1].append(np.array([[segment.end.x, segment.end.y]]))
            continue
        count = 1
        if not isinstance(segment, (svg.Line, svg.Close)):
            count = chords(lambda t, s=segment: _points(s, t), tolerance)
        if segment.end is None:
            continue
        lines[-1].append(_points(segment, np.linspace(0.0, 1.0, count + 1)[1:]))
    return [_distinct(np.concatenate(line)) for line in lines if line]


def _points(segment: Any, at: Floats) -> Floats:
    return np.array([[p.x, p.y] for p in (segment.point(float(t)) for t in at)])


def chords(curve: Callable[[Floats], Floats], tolerance: float) -> int:
    """Return into how many chords a curve (0 to 1 → points) is cut so that it leaves none by more than `tolerance`."""
    count = _LEAST_CHORDS
    while count < _MOST_CHORDS:
        points = curve(np.linspace(0.0, 1.0, 2 * count + 1))
        sag = np.linalg.norm(points[1::2] - 0.5 * (points[:-2:2] + points[2::2]), axis=1).max()
        if sag <= tolerance:
            break
        count *= 2
    return count


def _dxf(path: Path, data: bytes, tolerance: float) -> list[Floats]:
    """Return the lines of a DXF's model space, whose header must say its unit."""
    if not data.rstrip(b" \t\r\n\0").endswith(b"EOF"):
        raise ToolpathError(
            "EOF is missing: the file was cut off, or is no DXF",
            file=path,
            line=data.count(b"\n") + 1,
            remedy="export it again",
        )
    paths = extra("ezdxf.path", "ezdxf", path)
    recover = extra("ezdxf.recover", "ezdxf", path)
    try:
        document, audit = recover.read(io.BytesIO(data))
        if audit.has_errors:
            raise ToolpathError(f"broken DXF: {audit.errors[0].message}".splitlines()[0], file=path)
        unit = _DXF_UNITS.get(int(document.header.get("$INSUNITS", 0)))
        if unit is None:
            raise ToolpathError(
                "the drawing does not say its unit", file=path, key="$INSUNITS", expected="mm, cm, m, inch or foot"
            )
        lines: list[Floats] = []
        for entity in document.modelspace():
            try:
                outline = paths.make_path(entity)
            except TypeError:
                continue  # dimensions, hatches and the like are not lines
            parts = outline.sub_paths() if outline.has_sub_paths else [outline]
            for part in parts:
                points = np.array([[p.x, p.y] for p in part.flattening(tolerance / unit)])
                lines.append(unit * _distinct(points.reshape(-1, 2)))
    except ToolpathError:
        raise
    except Exception as error:  # of whatever kind: what is in the file decides how the parser stumbles
        place = _LINE.search(str(error))
        what = f"cannot be read as DXF: {error}".splitlines()[0]
        raise ToolpathError(what, file=path, line=int(place[1]) if place else None) from error
    return lines


def _distinct(points: Floats) -> Floats:
    """Return points (n, 2) without those equal to the one before."""
    if len(points) < 2:
        return points
    return points[np.concatenate([[True], (np.diff(points, axis=0) != 0.0).any(axis=1)])]
