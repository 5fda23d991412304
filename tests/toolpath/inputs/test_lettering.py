"""Text in single strokes: every character is there, of the right height, and text has the size that was asked for."""

from __future__ import annotations

import string

import numpy as np
import pytest

from pentapod.base.errors import ToolpathError
from pentapod.toolpath import lettering
from pentapod.toolpath.inputs.lettering import CAPITAL, stroke_font


def test_font_has_every_printable_character():
    assert set(string.printable[:95]) <= set(stroke_font())
    assert set("ÄÖÜäöüß°±µ×Ø") <= set(stroke_font())
    for character, glyph in stroke_font().items():
        assert glyph.advance > 0
        assert (len(glyph.strokes) == 0) == (character == " ")
        for stroke in glyph.strokes:
            assert len(stroke) >= 2
            assert stroke[:, 1].min() >= -3.3
            assert stroke[:, 1].max() <= 12.5
            assert stroke[:, 0].min() >= -1.6
            assert stroke[:, 0].max() <= glyph.advance + 0.9


def test_font_strokes_have_no_jumps():
    """What one stroke draws is one line: no step is longer than a letter is high."""
    for glyph in stroke_font().values():
        for stroke in glyph.strokes:
            assert np.linalg.norm(np.diff(stroke, axis=0), axis=1).max() <= 13.0
            assert np.linalg.norm(np.diff(stroke, axis=0), axis=1).min() > 0


@pytest.mark.parametrize("letter", string.ascii_uppercase + string.digits)
def test_lettering_has_the_height_of_capitals(letter):
    points = np.concatenate(lettering(letter, 7e-3))
    assert np.ptp(points[:, 1]) == pytest.approx(7e-3 * (10.8 / 10 if letter == "Q" else 1.0), rel=1e-2)


def test_font_letters_differ():
    shapes = {c: np.concatenate(g.strokes) for c, g in stroke_font().items() if g.strokes}
    for a, one in shapes.items():
        for b, two in shapes.items():
            assert a == b or one.shape != two.shape or np.abs(one - two).max() > 0.1, (a, b)


def test_lettering_of_lines_and_alignment():
    sides = ("left", "centre", "right")
    left, centre, right = (lettering("AAAA\nA", 1.0, align=side)[-1][:, 0].mean() for side in sides)
    assert left < centre < right
    assert centre == pytest.approx(0.5 * (left + right))
    strokes = lettering("H\nH", 1.0)
    tops = sorted({round(float(s[:, 1].max()), 6) for s in strokes})
    assert tops[-1] - tops[0] >= 1.0
    wide = np.concatenate(lettering("HH", 1.0, spacing=2.0))
    assert np.ptp(wide[:, 0]) > 1.5 * np.ptp(np.concatenate(lettering("HH", 1.0))[:, 0])
    assert CAPITAL == 10.0


@pytest.mark.parametrize(
    ("text", "align", "message"),
    [("", "left", "no text"), ("語", "left", "no such character"), ("A", "top", "alignment")],
)
def test_lettering_refuses_unknown_characters_and_alignment(text, align, message):
    with pytest.raises(ToolpathError, match=message):
        lettering(text, 1e-3, align=align)
