"""Words that turn the frame of the program: G68, G68.2, G53.1, G69, CYCLE800, TRANS, ROT."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pentapod.base.files import number_in
from pentapod.toolpath.formats.gcode.arcs import PLANES
from pentapod.toolpath.formats.gcode.coordinates import LINEAR
from pentapod.toolpath.formats.gcode.frames import IDENTITY, Frame, rotation
from pentapod.toolpath.formats.gcode.language.blocks import Word
from pentapod.toolpath.formats.gcode.tracer import Tracer
from pentapod.toolpath.formats.rotary import Vector

_EULER = frozenset({"121", "131", "212", "232", "313", "323", "123", "132", "213", "231", "312", "321"})
_FIXED = frozenset({"123", "132", "213", "231", "312", "321"})
_ABOUT = {"X": "1", "Y": "2", "Z": "3"}
_UNSWIVELLED = 64
"""From here on the number of CYCLE800's mode means angles that are not rotations about the axes one after another."""


def feature_plane(tracer: Tracer, words: Mapping[str, Word], line: int) -> None:
    """G68.2: a frame by its origin and Euler angles (P0) or roll, pitch and yaw (P1)."""
    form = int(_value(words, "P"))
    if form not in (0, 1):
        what = "a plane by points, vectors or projections"
        raise tracer.wrong(what, line, f"G68.2 P{form}", "export it by Euler angles: G68.2 X Y Z I J K")
    order = str(int(_value(words, "Q", 123.0 if form else 313.0)))
    if order not in (_FIXED if form else _EULER):
        raise tracer.wrong("an unknown order of rotations", line, f"Q{order}", "give Q313, or leave it out")
    # With P1 I, J and K are about x, y and z, in whatever order.
    letters = ["IJK"[int(axis) - 1] for axis in order] if form else "IJK"
    angles = [_value(words, letter) for letter in letters]
    frame = Frame(_point(tracer, words, line), rotation(angles, order, fixed=form == 1))
    tracer.set_frames(frame, None)


def orient(tracer: Tracer, line: int) -> None:
    """G53.1: the tool turns to the third axis of the frame."""
    if tracer.swivel is None:
        raise tracer.wrong("there is no plane to turn the tool to", line, "G53.1", "G68.2 before it")
    tracer.set_frames(tracer.swivel, tracer.programmed, oriented=True)


def rotate(tracer: Tracer, words: Mapping[str, Word], line: int) -> None:
    """G68: the coordinates turn in the plane by R degrees about a point."""
    if "R" not in words:
        raise tracer.wrong("a rotation without its angle", line, "G68", "G68 X… Y… R…")
    a, b, normal = PLANES[tracer.modes.plane]
    place = tracer.at.place
    known = {k: tracer.length(words, k, line) if k in words else place.get(k) for k in (a, b)}
    if None in known.values():
        raise tracer.wrong("a rotation about an unknown point", line, "G68", "G68 X… Y… R…")
    centre: Vector = tuple(known.get(k) or 0.0 for k in LINEAR)  # type: ignore[assignment]
    columns = rotation([words["R"].value], _ABOUT[normal])
    turned = Frame((0.0, 0.0, 0.0), columns).outside(centre)
    origin: Vector = tuple(p - q for p, q in zip(centre, turned, strict=True))  # type: ignore[assignment]
    tracer.set_frames(tracer.swivel, Frame(origin, columns))


def programmed_frame(tracer: Tracer, name: str, words: Mapping[str, Word], line: int) -> None:
    """TRANS and ROT of Sinumerik, and ATRANS and AROT, which are added to what was there."""
    if "RPL" in words:
        frame = Frame((0.0, 0.0, 0.0), rotation([words["RPL"].value], _ABOUT[PLANES[tracer.modes.plane][2]]))
    elif name.endswith("ROT"):
        frame = Frame((0.0, 0.0, 0.0), rotation([_value(words, k) for k in "ZYX"], "321"))
    else:
        frame = Frame(_point(tracer, words, line))
    before = tracer.programmed
    added = name.startswith("A") and before is not None
    nothing = frame == Frame((0.0, 0.0, 0.0))
    new = before.then(frame) if added and before is not None else None if nothing else frame
    tracer.set_frames(tracer.swivel, new)


def cycle800(tracer: Tracer, arguments: Sequence[str], line: int) -> None:
    """CYCLE800: a swivelled frame; without arguments the frame is off, and the tool stays as it is."""
    if not arguments:
        tracer.set_frames(None, None)
        return
    numbers = [number_in(text) or 0.0 for text in arguments] + [0.0] * 14
    mode = int(numbers[3])
    angles = numbers[7:10]
    if mode >= _UNSWIVELLED and any(angles):
        remedy = "swivel axis by axis: mode 27 or 57"
        raise tracer.wrong("a swivelled plane by solid angle, projection or rotary axes", line, "CYCLE800", remedy)
    order = "".join(str((mode >> shift) & 3) for shift in (0, 2, 4))
    turns = [(angle, axis) for angle, axis in zip(angles, order, strict=True) if angle]
    if any(axis == "0" for _, axis in turns):
        raise tracer.wrong("a swivel angle without its axis", line, "CYCLE800", "swivel axis by axis: mode 27 or 57")
    scale = tracer.modes.scale or 1.0
    before, after = (tuple(scale * v for v in numbers[k : k + 3]) for k in (4, 10))
    columns = rotation([angle for angle, _ in turns], "".join(axis for _, axis in turns)) if turns else IDENTITY
    frame = Frame(before, columns).then(Frame(after))  # type: ignore[arg-type]
    if int(numbers[2]) % 10 == 1 and tracer.swivel is not None:
        frame = tracer.swivel.then(frame)
    if numbers[0]:
        tracer.home((), line)
    moves = len(arguments) < 14 or numbers[13] != 0.0
    nothing = frame == Frame((0.0, 0.0, 0.0))
    tracer.set_frames(frame, None, oriented=moves)
    if nothing:
        tracer.set_frames(None, None)


def _point(tracer: Tracer, words: Mapping[str, Word], line: int) -> Vector:
    return tracer.length(words, "X", line), tracer.length(words, "Y", line), tracer.length(words, "Z", line)


def _value(words: Mapping[str, Word], letter: str, default: float = 0.0) -> float:
    return words[letter].value if letter in words else default
