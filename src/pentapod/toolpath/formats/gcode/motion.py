"""A move of a block: where its axis words lead, on rapid, straight or along an arc."""

from __future__ import annotations

import math
from collections.abc import Mapping

from pentapod.toolpath.formats.gcode.arcs import CENTRE, PLANES, Arc, ArcError, arc_between
from pentapod.toolpath.formats.gcode.coordinates import LINEAR
from pentapod.toolpath.formats.gcode.language.blocks import Word
from pentapod.toolpath.formats.gcode.language.options import OPTIONS
from pentapod.toolpath.formats.gcode.tracer import Tracer

_VECTORS = (("A3", "B3", "C3"), ("I", "J", "K"))
_RAPID, _CLOCKWISE, _COUNTERCLOCKWISE = 0.0, 2.0, 3.0


def move(
    tracer: Tracer, target: dict[str, float], words: Mapping[str, Word], line: int, first: str, *, rapid: bool = False
) -> None:
    """Move to a target in the mode of motion that holds. first: the word that messages name."""
    motion = _RAPID if rapid else tracer.modes.motion
    if motion is None:
        raise tracer.wrong("neither rapid nor feed", line, first, "G0 or G1 before it")
    if motion == _RAPID:
        tracer.rapid(target, line, first)
        return
    arc = _arc(tracer, target, words, line, motion) if motion in (_CLOCKWISE, _COUNTERCLOCKWISE) else None
    tracer.feed(target, line, first, arc, own_feed="F" in words)


def _arc(tracer: Tracer, target: Mapping[str, float], words: Mapping[str, Word], line: int, motion: float) -> Arc:
    at, modes = tracer.at, tracer.modes
    start = at.place.copy()
    if unknown := at.unknown:
        at.place.update(target)
        tracer.here = None
        raise tracer.wrong(f"an arc from an unknown place: {unknown} is not known here", line, f"G{motion:g}")
    scale = modes.scale or 1.0
    radius = next((words[k].value * scale for k in ("CR", "R") if k in words), None)
    centre: dict[str, float] | None = None
    in_plane, across = PLANES[modes.plane][:2], PLANES[modes.plane][2]
    strange = [CENTRE[across], *("LQ" if modes.dialect.fanuc else "")]
    if (letter := next((k for k in strange if k in words and words[k].value), None)) is not None:
        remedy = "check the plane (G17, G18, G19); export a spiral or a helix of several turns as arcs of one turn"
        raise _failed(tracer, target, f"{letter} in an arc of the plane G{modes.plane:g}", line, motion, remedy)
    if any(CENTRE[letter] in words for letter in in_plane):
        centre = {}
        for letter in in_plane:
            word = words.get(CENTRE[letter])
            value = 0.0 if word is None else word.value * scale
            absolute = modes.absolute_centres if word is None or not word.how else word.how == "AC"
            centre[letter] = value if absolute and word is not None else start[letter] + value
    if radius is None and centre is None:
        remedy = "give I, J, K of the plane (G17, G18, G19), or R"
        raise _failed(tracer, target, "an arc without its centre or radius", line, motion, remedy)
    if "TURN" in words:
        turns = int(words["TURN"].value)
    else:
        turns = int(words["P"].value) - 1 if "P" in words and not modes.dialect.switched else 0
    end = {**start, **target}
    try:
        return arc_between(
            {k: start[k] for k in LINEAR}, {k: end[k] for k in LINEAR}, modes.plane, clockwise=motion == _CLOCKWISE,
            centre=centre, radius=radius if centre is None else None, turns=max(turns, 0),
        )  # fmt: skip
    except ArcError as error:
        remedy = "check the plane (G17, G18, G19) and whether I, J, K are relative (G91.1)"
        raise _failed(tracer, target, str(error), line, motion, remedy) from error


def _failed(tracer: Tracer, target: Mapping[str, float], what: str, line: int, motion: float, remedy: str) -> Exception:
    """Return the error of an arc; reading goes on from its end."""
    tracer.at.place.update(target)
    tracer.here = tracer.at.pose(tracer.at.place)
    return tracer.wrong(what, line, f"G{motion:g}", remedy)


def axis_targets(tracer: Tracer, words: Mapping[str, Word], line: int) -> dict[str, float]:
    """Return the coordinates that a block leads to, mm and degrees; axes whose place is unknown stay so."""
    target: dict[str, float] = {}
    place = tracer.at.place
    for letter, word in words.items():
        linear = letter in LINEAR
        value = word.value * (tracer.modes.scale or 1.0) if linear else word.value
        if not abs(value) <= OPTIONS.farthest:
            raise tracer.wrong("a number beyond any machine", line, str(word)[:40])
        if word.how == "IC" or (not word.how and not tracer.modes.absolute):
            if letter in place and letter not in tracer.at.lost:
                target[letter] = place[letter] + value
        elif linear:
            target[letter] = value
        else:
            target[letter] = place[letter] + _turn(place[letter], value, word.how)
            tracer.turn_known(letter)
    return target


def _turn(now: float, value: float, how: str) -> float:
    """Return the degrees by which an axis turns to an absolute angle."""
    turn = value - now
    if how == "ACP":
        return turn % 360.0
    if how == "ACN":
        return -(-turn % 360.0)
    over = how == "DC" or (abs(turn) > OPTIONS.rollover and -180.0 <= value < 360.0)
    return math.remainder(turn, 360.0) if over else turn


def vector_axis(tracer: Tracer, words: Mapping[str, Word], by_centre: bool, line: int) -> bool:
    """Take the tool axis of a block that gives it as a vector: A3, B3, C3, or I, J, K after G43.5."""
    letters = _VECTORS[1] if by_centre else _VECTORS[0]
    straight = tracer.modes.motion not in (_CLOCKWISE, _COUNTERCLOCKWISE) and tracer.modes.cycle is None
    if straight and not by_centre and (word := next((words[k] for k in _VECTORS[1] if k in words), None)):
        remedy = "as a tool axis it needs G43.5, as the centre of an arc G2 or G3"
        raise tracer.wrong("I, J, K in a straight move", line, str(word), remedy)
    if not any(letter in words for letter in letters):
        return False
    vector = [words[letter].value if letter in words else 0.0 for letter in letters]
    size = math.hypot(*vector)
    if not 1e-6 < size <= OPTIONS.farthest:
        raise tracer.wrong("a tool axis without length", line, letters[0])
    x, y, z = (v / size for v in vector)
    frame = tracer.at.frame
    if frame is not None:
        turned, origin = frame.outside((x, y, z)), frame.origin
        x, y, z = (a - b for a, b in zip(turned, origin, strict=True))
    tracer.at.fixed = (x, y, z)
    return True
