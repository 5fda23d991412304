"""Five-axis G-code with tool centre point programming: XYZAB and XYZBC (see `rotary`).

Coordinates are those of the tip in the workpiece frame. LinuxCNC's pentakins always works that way; controllers of
XYZBC machines need G43.4, which the reader requires before the first move. G0 is a rapid, G1 a cut, or a link after a
comment "(pentapod link)". G4 is a dwell at the last point: P in seconds for LinuxCNC and in whole milliseconds for
other controllers, X and U in seconds for these. A dwell of no time is an exact stop; so is every point in mode G61.1
(G61 of other controllers) and the end of a block with G9. G90 G91 G20 G21 G93 G94 and modal words are read; arcs,
cycles, cutter compensation, coordinate systems other than G54 to G59, and expressions are errors.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from pentapod.toolpath.formats.moves import dwell_times, kind_remark, plain, poses, tilt_centre_remark
from pentapod.toolpath.formats.reading import StatementReader, read_lines
from pentapod.toolpath.formats.registry import Defaults, Format, register
from pentapod.toolpath.formats.rotary import AB, BC, Rotary
from pentapod.toolpath.toolpath import SegmentKind, Toolpath

_WORD = re.compile(r"([A-Z])([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))")
_COMMENT = re.compile(r"\(([^()]*)\)|;(.*)$")
_IDLE_G = frozenset({17.0, 18.0, 19.0, 40.0, 49.0, 54.0, 55.0, 56.0, 57.0, 58.0, 59.0, 80.0})
_PATH_MODES = frozenset({61.0, 61.1, 64.0})
_DWELL, _STOP = ("G", 4.0), ("G", 9.0)
_IDLE_M = frozenset({0.0, 1.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 48.0, 49.0})
_ENDS = frozenset({2.0, 30.0})
_LINEAR = ("X", "Y", "Z")


@dataclass
class _Reader(StatementReader):
    """Modal state, and the moves so far. Positions are in millimetres and degrees."""

    rotary: Rotary
    needs_tcp: bool
    scale: float | None = None
    absolute: bool = True
    inverse: bool = False
    motion: float | None = None
    tcp: bool = False
    feed: float | None = None
    stopping: bool = False
    place: dict[str, float] = field(default_factory=dict[str, float])
    ended: int | None = None

    def toolpath(self) -> Toolpath:
        lines = read_lines(self.file)
        for line, text in enumerate(lines, start=1):
            for comment in _COMMENT.finditer(text):
                self.read_remark(comment[1] or comment[2] or "", line)
            block = _COMMENT.sub("", text).strip()
            if not block.isascii():
                # Capitals of some letters of other scripts are letters of commands.
                letter = next(letter for letter in block if not letter.isascii())
                raise self.wrong("a letter or digit that G-code does not have", line, letter)
            block = block.upper()
            if block.startswith("%"):
                continue
            if self.ended is not None and block:
                raise self.wrong(f"a block after the program's end in line {self.ended}", line, block[:20])
            self._block(block, line)
        if self.ended is None:
            raise self.wrong("M2 or M30 is missing: the file was cut off", len(lines), "M", expected="M2 or M30")
        return self.gathered()

    def _words(self, block: str, line: int) -> list[tuple[str, float]]:
        words, position = [], 0
        while position < len(block):
            if block[position].isspace():
                position += 1
                continue
            match = _WORD.match(block, position)
            if match is None:
                text = block[position:].split(maxsplit=1)[0][:20]
                what = "a block that may be skipped" if text.startswith("/") else "not a word with a number"
                raise self.wrong(what, line, text, expected="words such as X12.5; no expressions")
            words.append((match[1], float(match[2])))
            position = match.end()
        letters = [letter for letter, _ in words if letter not in "GM"]
        for letter in letters:
            if letters.count(letter) > 1:
                raise self.wrong("a word that comes twice in one block", line, letter)
        return words

    def _block(self, block: str, line: int) -> None:
        words = self._words(block, line)
        if _DWELL in words:
            self._dwell(words, line)
            return
        # The modes of a block apply to the whole block, wherever in it they are.
        for letter, value in words:
            if letter == "G" and (letter, value) != _STOP:
                self._mode(value, line)
        values: dict[str, float] = {}
        for letter, value in words:
            if letter == "M":
                self._machine(value, line)
            elif letter in (*_LINEAR, *self.rotary.words):
                values[letter] = value
            elif letter == "F":
                if value <= 0.0:
                    raise self.wrong("the feed must be positive", line, f"F{value:g}")
                self.feed = value
            elif letter not in "GNOSTHDPL":
                raise self.wrong("an unknown word", line, letter, expected="".join([*_LINEAR, *self.rotary.words]))
        if values:
            self._move(values, line, own_feed=any(letter == "F" for letter, _ in words))
            if self.stopping or _STOP in words:
                self.moves.add_dwell(0.0)

    def _dwell(self, words: list[tuple[str, float]], line: int) -> None:
        """Add the dwell of a G4 block."""
        times = [(letter, value) for letter, value in words if (letter, value) != _DWELL and letter != "N"]
        letters = ("P", "X", "U") if self.needs_tcp else ("P",)
        if len(times) != 1 or times[0][0] not in letters or times[0][1] < 0.0:
            raise self.wrong("a dwell without its time", line, "G4", expected=" or ".join(f"G4 {x}…" for x in letters))
        letter, value = times[0]
        milliseconds = self.needs_tcp and letter == "P"
        if milliseconds and value != int(value):
            raise self.wrong("seconds or milliseconds?", line, f"P{value:g}", remedy=f"write G4 X{value:g} for seconds")
        self.moves.add_dwell(1e-3 * value if milliseconds else value)

    def _mode(self, code: float, line: int) -> None:
        word = f"G{code:g}"
        if code in (0.0, 1.0):
            self.motion = code
        elif code in (20.0, 21.0):
            if self.moves.tips:
                raise self.wrong("the unit changes after the first move", line, word)
            self.scale = 25.4 if code == 20.0 else 1.0
        elif code in (90.0, 91.0):
            self.absolute = code == 90.0
        elif code in (93.0, 94.0):
            if self.inverse != (code == 93.0):
                self.inverse, self.feed = code == 93.0, None
        elif code in _PATH_MODES:
            self.stopping = code == (61.0 if self.needs_tcp else 61.1)
        elif code == 43.4:
            self.tcp = True
        elif code not in _IDLE_G:
            remedy = {2.0: "export points", 3.0: "export points", 41.0: "export without it", 42.0: "export without it"}
            raise self.wrong("a word that is not read", line, word, remedy=remedy.get(code))
        if code == 49.0:
            self.tcp = False

    def _machine(self, code: float, line: int) -> None:
        if code in _ENDS:
            self.ended = line
        elif code not in _IDLE_M:
            raise self.wrong("a word that is not read", line, f"M{code:g}")

    def _move(self, values: dict[str, float], line: int, *, own_feed: bool) -> None:
        first = next(iter(values))
        if self.scale is None:
            raise self.wrong("the unit is missing", line, first, expected="G20 or G21 before it")
        if self.motion is None:
            raise self.wrong("neither rapid nor feed", line, first, expected="G0 or G1 before it")
        if self.needs_tcp and not self.tcp:
            raise self.wrong("tool centre point programming is off", line, first, expected="G43.4 before it")
        for letter in (*_LINEAR, *self.rotary.words):
            if letter not in self.place and (letter not in values or not self.absolute):
                raise self.wrong("the first move does not say where it goes", line, letter, expected="all axes, in G90")
        for letter, value in values.items():
            value = value * self.scale if letter in _LINEAR else value  # noqa: PLW2901 - in millimetres from here on
            self.place[letter] = value if self.absolute else self.place[letter] + value
        tip = [self.place[letter] for letter in _LINEAR]
        axis = self.rotary.axis(np.array([self.place[letter] for letter in self.rotary.words]))
        feed = math.inf if self.motion == 0.0 else self._feed(tip, line, own_feed=own_feed)
        kind = SegmentKind.RAPID if self.motion == 0.0 else self.kind
        self.moves.add(tip, axis.tolist(), kind, feed, line, first)

    def _feed(self, tip: list[float], line: int, *, own_feed: bool) -> float:
        """Return the feed of the move to a tip, mm/min."""
        if self.inverse:
            if not own_feed or self.feed is None:
                raise self.wrong("in G93 every move needs its own feed", line, "F")
            length = math.dist(tip, self.moves.tips[-1]) if self.moves.tips else 0.0
            if length > 0.0:
                return length * self.feed
            # A rotation about the tip has no tip speed; it keeps the last feed.
            return next((f for f in reversed(self.moves.feeds) if math.isfinite(f)), self.feed)
        if self.feed is None:
            if self.defaults.feed is None:
                raise self.wrong("the feed is missing", line, "F", expected="F before it")
            return 6e4 * self.defaults.feed
        return self.feed * (self.scale or 1.0)


def _read(file: Path, defaults: Defaults, rotary: Rotary, *, needs_tcp: bool) -> Toolpath:
    return _Reader(file, defaults, rotary, needs_tcp).toolpath()


def _write(toolpath: Toolpath, rotary: Rotary, *, needs_tcp: bool, inverse_time: bool) -> bytes:
    tips, axes, kinds, feeds = poses(toolpath)
    dwells = dwell_times(toolpath)
    angles = rotary.angles(axes)
    lines = ["%", f"({tilt_centre_remark(toolpath.tilt_centre)})", f"G21 G90 G{93 if inverse_time else 94}"]
    lines += ["G43.4 H1"] if needs_tcp else []
    kind, feed, motion = SegmentKind.CUT, np.nan, ""
    letters = (*_LINEAR, *rotary.words)
    for k in range(len(tips)):
        move = kinds[k - 1] if k else SegmentKind.RAPID
        if move not in (SegmentKind.RAPID, kind):
            lines.append(f"({kind_remark(move)})")
            kind = move
        values = [*(plain(v, 7) for v in tips[k]), *(plain(v, 10) for v in angles[k])]
        words = [letter + value for letter, value in zip(letters, values, strict=True)]
        wanted = "G0" if move == SegmentKind.RAPID else "G1"
        words = [wanted, *words] if wanted != motion else words
        motion = wanted
        if move != SegmentKind.RAPID and inverse_time:
            length = float(np.linalg.norm(tips[k] - tips[k - 1]))
            words.append(f"F{plain(feeds[k - 1] / length if length > 0.0 else feeds[k - 1], 9)}")
        elif move != SegmentKind.RAPID and feeds[k - 1] != feed:
            feed = float(feeds[k - 1])
            words.append(f"F{plain(feed, 6)}")
        lines.append(" ".join(words))
        if k in dwells:
            lines.append(f"G4 {'X' if needs_tcp else 'P'}{plain(dwells[k], 9)}")
    lines += ["G49"] if needs_tcp else []
    return ("\n".join([*lines, "M2", "%"]) + "\n").encode()


def _variant(name: str, suffixes: tuple[str, ...], about: str, rotary: Rotary, *, tcp: bool, inverse: bool) -> None:
    read = partial(_read, rotary=rotary, needs_tcp=tcp)
    write = partial(_write, rotary=rotary, needs_tcp=tcp, inverse_time=inverse)
    register(Format(name, suffixes, about, read, write, loses=frozenset({"power"})))


_variant("xyzab", (".ngc",), "G-code XYZAB, LinuxCNC pentakins", AB, tcp=False, inverse=False)
_variant("xyzab-g93", (), "the same, inverse time feed", AB, tcp=False, inverse=True)
_variant("xyzbc", (".nc", ".tap"), "G-code XYZBC with G43.4", BC, tcp=True, inverse=False)
_variant("xyzbc-g93", (), "the same, inverse time feed", BC, tcp=True, inverse=True)
