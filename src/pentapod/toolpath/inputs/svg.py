"""SVG drawings: shapes as polylines, read with svgelements, after a check of how much the file unfolds to."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from functools import cache
from itertools import count, islice
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.toolpath.inputs.files import LIMITS, check_points, chord_count, distinct, extra

_PX_M = 25.4e-3 / 96.0
_HREFS = ("href", "{http://www.w3.org/1999/xlink}href")
_NUMBERS = re.compile(r"[0-9.]+|[A-DF-Za-df-z]")
_COMMENT = re.compile(r"/\*.*?(?:\*/|\Z)", re.DOTALL)
_SHAPING = re.compile(r"(?:^|;)\s*(?:display|transform|d|r|rx|ry|cx|cy|x|y|width|height)\s*:")


def svg_lines(path: Path, data: bytes, tolerance: float) -> list[Floats]:
    """Return the polylines (n, 2), metres, y up, of an SVG; without another unit 96 user units are an inch.

    Raises ToolpathError for text and pictures, and for a file that would take hours or all memory.
    """
    svg = extra("svgelements", "svgelements", path)
    try:
        # svgelements would accept a file that was cut off.
        root = ElementTree.fromstring(data.decode("utf-8"))
        _check(path, root)
        text = ElementTree.tostring(root, encoding="unicode")
        drawing = svg.SVG.parse(io.StringIO(text), reify=True, on_error="raise")
        lines: list[Floats] = []
        points = count()
        for element in drawing.elements():
            _check_kind(path, svg, element)
            if isinstance(element, svg.Shape):
                lines += _lines(svg, svg.Path(element).segments(), tolerance / _PX_M, path, points)
    except ToolpathError:
        raise
    except UnicodeDecodeError as error:
        raise ToolpathError("not a text file in UTF-8", file=path, expected="an SVG file") from error
    except ElementTree.ParseError as error:
        what = f"not a whole SVG file: {error}".split(": line")[0]
        raise ToolpathError(what, file=path, line=error.position[0]) from error
    except Exception as error:  # of any kind: the parser's exceptions depend on what is in the file
        line = getattr(error, "position", (None, None))[0]
        what = f"cannot be read as SVG: {str(error) or type(error).__name__}".splitlines()[0][:120]
        raise ToolpathError(what, file=path, line=line) from error
    return [_PX_M * line * [1.0, -1.0] for line in lines]


def _check_size(path: Path, size: int, most: int, what: str) -> None:
    if size > most:
        what = f"this SVG is too large: {what}"
        raise ToolpathError(what, file=path, expected=f"at most {most:,}", remedy="simplify it")


def _check(path: Path, root: ElementTree.Element) -> None:
    """Raise ToolpathError where a drawing is too large; drop rules of its styles that do not affect shapes."""
    named: dict[str, ElementTree.Element] = {}
    style = 0
    for element in root.iter():
        if isinstance(identity := element.get("id"), str):
            named[identity] = element
        transform = max(len(element.get(key, "")) for key in ("transform", "viewBox"))
        names = max(len(element.get(key, "")) for key in ("style", "class", "id"))
        _check_size(path, len(element.attrib), LIMITS.svg_attributes, "an element has too many attributes")
        _check_size(path, transform, LIMITS.svg_transform, "a transform is too long")
        _check_size(path, names, LIMITS.svg_style, "a style is too long")
        if str(element.tag).endswith("}style") or element.tag == "style":
            element.text = _shaping(element.text or "")
            style += len(element.text)
            _check_size(path, style, LIMITS.svg_style, "its style rules that move or hide shapes are too long")
    elements, numbers = _unfolded(path, root, named, {}, 0)
    _check_size(path, elements, LIMITS.svg_elements, f"it unfolds to {elements:,} elements")
    _check_size(path, numbers, LIMITS.svg_numbers, f"its paths unfold to {numbers:,} numbers and commands")


def _check_kind(path: Path, svg: Any, element: Any) -> None:
    """Raise ToolpathError for text and pictures, which are not read."""
    if isinstance(element, svg.Image):
        remedy = "trace or delete the picture"
    elif isinstance(element, svg.Text) and (element.text or "").strip():
        remedy = "turn text into paths"
    else:
        return
    what = f"<{type(element).__name__.lower()}> is not read"
    key = None if element.id is None else f"id {element.id[:40]}"
    remedy = f"{remedy} in the drawing program"
    raise ToolpathError(what, file=path, key=key, expected="paths and shapes", remedy=remedy)


def _shaping(text: str) -> str:
    """Return the rules of a style sheet that move or hide shapes."""
    rules: list[str] = []
    for rule in _COMMENT.sub("", text).split("}"):
        names, _, body = rule.partition("{")
        if _SHAPING.search(body):
            rules.append(f"{names.strip()}{{{body.strip()}}}")
    return "\n".join(rules)


def _unfolded(
    path: Path,
    element: ElementTree.Element,
    named: dict[str, ElementTree.Element],
    known: dict[int, tuple[int, int]],
    depth: int,
) -> tuple[int, int]:
    """Return the numbers of elements, and of numbers in paths, of an element with all that it contains and repeats."""
    if id(element) in known:
        return known[id(element)]
    _check_size(path, depth, LIMITS.svg_depth, "its elements are nested too deep, or repeat themselves")
    parts = [_unfolded(path, child, named, known, depth + 1) for child in element]
    if element.tag == "use" or str(element.tag).endswith("}use"):
        link = next((element.get(key, "") for key in reversed(_HREFS) if key in element.attrib), "")
        target = named.get(link[1:]) if link.startswith("#") else None
        if target is None:
            what = "a <use> refers to nothing in this drawing"
            raise ToolpathError(what, file=path, key="href", value=link[:40], remedy="export it with everything in it")
        parts.append(_unfolded(path, target, named, known, depth + 1))
    own = sum(len(_NUMBERS.findall(element.get(key, ""))) for key in ("d", "points"))
    known[id(element)] = 1 + sum(part[0] for part in parts), own + sum(part[1] for part in parts)
    return known[id(element)]


def _lines(svg: Any, segments: list[Any], tolerance: float, path: Path, points: Iterator[int]) -> list[Floats]:
    """Return the polylines of one shape, in user units. points: counts those of all shapes."""
    lines: list[list[Floats]] = []
    for segment in segments:
        if isinstance(segment, svg.Move) or not lines:
            lines.append([])
        if isinstance(segment, svg.Move):
            if segment.end is not None:
                lines[-1].append(np.array([[segment.end.x, segment.end.y]]))
            continue
        if segment.end is None:
            continue
        if isinstance(segment, (svg.Line, svg.Close)):
            lines[-1].append(np.array([[segment.end.x, segment.end.y]]))
            check_points(path, next(points))
            continue
        corners = _corners(svg, segment)
        if corners is None:
            cut = chord_count(segment.npoint, tolerance)
            lines[-1].append(segment.npoint(np.linspace(0.0, 1.0, cut + 1)[1:]))
        else:
            cut = chord_count(lambda t, c=corners: _bernstein(len(c) - 1, len(t) - 1) @ c, tolerance)
            lines[-1].append(_bernstein(len(corners) - 1, cut)[1:] @ corners)
        check_points(path, next(islice(points, cut - 1, None)))
    return [distinct(np.concatenate(line)) for line in lines if line]


def _corners(svg: Any, segment: Any) -> Floats | None:
    """Return the control points (n, 2) of a Bézier curve, None for an arc."""
    if isinstance(segment, svg.CubicBezier):
        corners = (segment.start, segment.control1, segment.control2, segment.end)
    elif isinstance(segment, svg.QuadraticBezier):
        corners = (segment.start, segment.control, segment.end)
    else:
        return None
    return np.array([[p.x, p.y] for p in corners])


@cache
def _bernstein(degree: int, intervals: int) -> Floats:
    """Return the Bernstein polynomials (intervals + 1, degree + 1) at evenly spaced parameters."""
    t = np.linspace(0.0, 1.0, intervals + 1)[:, None]
    k = np.arange(degree + 1)
    binomials = np.array({2: (1, 2, 1), 3: (1, 3, 3, 1)}[degree])
    return binomials * t**k * (1.0 - t) ** (degree - k)
