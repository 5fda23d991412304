"""Words that send the tool home or move the origin: G10, G28, G52, G53, G92."""

from __future__ import annotations

from collections.abc import Mapping

from pentapod.toolpath.formats.gcode.coordinates import LINEAR
from pentapod.toolpath.formats.gcode.language.blocks import Word
from pentapod.toolpath.formats.gcode.language.vocabulary import Dialect
from pentapod.toolpath.formats.gcode.tracer import Tracer
from pentapod.toolpath.formats.rotary import LETTERS, Vector

SYSTEMS = {54.0: "G54", 55.0: "G55", 56.0: "G56", 57.0: "G57", 58.0: "G58", 59.0: "G59",
           59.1: "G59.1", 59.2: "G59.2", 59.3: "G59.3"}  # fmt: skip
_BY_NUMBER = dict(enumerate(SYSTEMS.values(), start=1))
_FIRST, _NUMBERED = 54.0, frozenset({54.1, 154.0})
_OFF, _FROM, _TO = 500.0, 505.0, 599.0
_AXES, _STEPS = (*LINEAR, *LETTERS), {"X": "U", "Y": "V", "Z": "W"}


def system_of(code: float, words: Mapping[str, Word], dialect: Dialect) -> str | None:
    """Return the system of coordinates that a code switches on, such as "G54.1 P2"; None where it is another code."""
    if "P" in words and (code in _NUMBERED or (code == _FIRST and dialect.fanuc)):
        return f"G54.1 P{words['P'].value:g}"
    further = dialect.equals and (code == _OFF or _FROM <= code <= _TO)
    return f"G{code:g}" if code in _NUMBERED or further else SYSTEMS.get(code)


def go_home(tracer: Tracer, words: Mapping[str, Word], line: int) -> None:
    """G28, G30: the axes that are named, or all, go to the home position; the point on the way is left out.

    U, V and W are steps along X, Y and Z.
    """
    named = [letter for letter in _AXES if letter in words or _STEPS.get(letter) in words]
    tracer.home(named or _AXES, line)


def machine_place(tracer: Tracer, words: Mapping[str, Word], line: int) -> None:
    """G53, SUPA: a place in the coordinates of the machine."""
    named = [letter for letter in _AXES if letter in words]
    if not named:
        return
    tracer.home(named, line)
    tracer.at.place.update({k: words[k].value for k in named if k in LETTERS})


def local_shift(tracer: Tracer, words: Mapping[str, Word], line: int) -> None:
    """G52: a shift of the coordinates."""
    x, y, z = (tracer.length(words, k, line) if k in words else v for k, v in zip(LINEAR, tracer.at.shift, strict=True))
    tracer.at.set_shift((x, y, z))


def set_coordinates(tracer: Tracer, words: Mapping[str, Word], line: int) -> None:
    """G92: the place of the tool gets these coordinates."""
    at = tracer.at
    _check_rotary(tracer, words, line)
    shift = list(at.shift)
    for k, letter in enumerate(LINEAR):
        if letter not in words:
            continue
        value = tracer.length(words, letter, line)
        if letter in at.place:
            shift[k] += at.place[letter] - value
        elif at.first_system is not None:
            what = "coordinates are set where the place is not known"
            raise tracer.wrong(what, line, str(words[letter]), "give all axes before it")
        at.place[letter] = value
    kept = at.place.copy()
    at.set_shift((shift[0], shift[1], shift[2]))
    at.place.update({k: kept[k] for k in LINEAR if k in kept})


def no_coordinates(tracer: Tracer, words: Mapping[str, Word], line: int) -> None:
    """G92.1, G92.2: no shift."""
    del words, line
    tracer.at.set_shift((0.0, 0.0, 0.0))


def set_data(tracer: Tracer, words: Mapping[str, Word], line: int) -> None:
    """G10: offsets of the systems of coordinates (L2, L20); tables of tools and parameters change nothing here.

    L20 are the further systems of Fanuc (G54.1 P…), and the place of the tool for LinuxCNC.
    """
    kind = words["L"].value if "L" in words else 0.0
    if kind not in (2.0, 20.0):
        return
    number, fanuc = int(words["P"].value) if "P" in words else 0, tracer.modes.dialect.fanuc
    if fanuc and number == 0:
        what = "an offset of all systems of coordinates"
        raise tracer.wrong(what, line, str(words.get("P", "G10")), "give each system its own: G10 L2 P1")
    if fanuc and kind == 20.0:
        system: str | None = f"G54.1 P{number}"
    else:
        system = tracer.at.system if number == 0 else _BY_NUMBER.get(number)
    if system is None:
        raise tracer.wrong("an unknown system of coordinates", line, str(words["P"]), "P1 to P9")
    if "R" in words and words["R"].value % 360.0:
        raise tracer.wrong("turned coordinates", line, str(words["R"]), "export it applied")
    _check_rotary(tracer, words, line)
    if kind == 20.0 and not fanuc:
        if system != tracer.at.system:
            raise tracer.wrong("the zero of another system is set where the tool is", line, "G10 L20", "G10 L2")
        set_coordinates(tracer, words, line)
        return
    old: Vector = tracer.at.offsets.get(system, (0.0, 0.0, 0.0))
    added = fanuc and not tracer.modes.absolute
    x, y, z = (tracer.length(words, k, line) + added * v if k in words else v for k, v in zip(LINEAR, old, strict=True))
    tracer.at.set_offset(system, (x, y, z))


def _check_rotary(tracer: Tracer, words: Mapping[str, Word], line: int) -> None:
    for letter in LETTERS:
        if letter in words and words[letter].value % 360.0:
            what = "an offset of a rotary axis: what it is relative to is known to the machine only"
            raise tracer.wrong(what, line, str(words[letter]), "export with rotary axes at their zero")
