"""Text in a single-stroke font that is part of the package."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError

CAPITAL = 10.0
"""Height of capitals in the font's own units."""

LINE_SPACING = 16.0
"""Distance of lines of text, in the font's own units."""

CHORD_DEG = 6.0
"""Angle of an arc's chords."""


@dataclass(frozen=True, eq=False)
class Glyph:
    """Strokes of a character, each (n, 2), and the advance to the next character, in the font's units."""

    advance: float
    strokes: tuple[Floats, ...]


def lettering(text: str, height: float, *, spacing: float = 1.0, align: str = "centre") -> list[Floats]:
    """Return the strokes (n, 2), metres, in reading order, of a text with capitals of `height` metres.

    Line feeds separate lines; the origin is the middle of the text block. spacing: factor on the characters' widths.
    align: left, centre or right. Raises ToolpathError for no text, and for a character that the font does not have.

    >>> strokes = lettering("H", height=0.01)
    >>> len(strokes)
    3
    """
    if not text.strip():
        raise ToolpathError("there is no text", key="text", value=text)
    shifts = {"left": 0.0, "centre": 0.5, "right": 1.0}
    if align not in shifts:
        raise ToolpathError("unknown alignment", key="align", value=align, expected=", ".join(shifts))
    rows = text.split("\n")
    widths = [sum(_glyph(c).advance for c in row) * spacing for row in rows]
    top = 0.5 * LINE_SPACING * (len(rows) - 1) - 0.5 * CAPITAL
    strokes: list[Floats] = []
    for number, (row, width) in enumerate(zip(rows, widths, strict=True)):
        x = (max(widths) - width) * shifts[align] - 0.5 * max(widths)
        for character in row:
            glyph = _glyph(character)
            strokes += [stroke + np.array([x, top - LINE_SPACING * number]) for stroke in glyph.strokes]
            x += glyph.advance * spacing
    return [stroke * (height / CAPITAL) for stroke in strokes]


def _glyph(character: str) -> Glyph:
    glyph = stroke_font().get(character)
    if glyph is None:
        known = "".join(stroke_font())
        raise ToolpathError("the font has no such character", key="text", value=character, expected=f"one of {known!r}")
    return glyph


@cache
def stroke_font() -> dict[str, Glyph]:
    """Return the glyphs of the font file, whose first lines explain the notation."""
    text = files("pentapod.toolpath.inputs.fonts").joinpath("strokes.txt").read_text(encoding="utf-8")
    glyphs: dict[str, Glyph] = {}
    for line in text.splitlines():
        if not line or line.startswith("# "):
            continue
        head, *strokes = line.split(" | ")
        name, advance = head.rsplit(" ", 1)
        character = chr(int(name[2:], 16)) if name.startswith("U+") else name
        glyphs[character] = Glyph(float(advance), tuple(_stroke(stroke) for stroke in strokes))
    return glyphs


def _stroke(text: str) -> Floats:
    """Return the points (n, 2) of a stroke, with arcs as chords."""
    parts: list[Floats] = []
    for word in text.split():
        if word.startswith("("):
            cx, cy, rx, ry, first, last = (float(number) for number in word.strip("()").split(","))
            count = max(2, round(abs(last - first) / CHORD_DEG))
            angle = np.radians(np.linspace(first, last, count + 1))
            parts.append(np.stack([cx + rx * np.cos(angle), cy + ry * np.sin(angle)], axis=1))
        else:
            x, y = word.split(",")
            parts.append(np.array([[float(x), float(y)]]))
    points = np.concatenate(parts)
    # An arc may begin at the point before it.
    apart = np.abs(np.diff(points, axis=0)).max(axis=1) > 1e-9
    return points[np.concatenate([[True], apart])]
