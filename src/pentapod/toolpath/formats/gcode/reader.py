"""The reader of G-code: blocks in their order, each word by what it means; all problems of a file are told at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from pentapod.base.errors import ToolpathError
from pentapod.toolpath.formats.gcode import places, planes
from pentapod.toolpath.formats.gcode.coordinates import LINEAR, Coordinates
from pentapod.toolpath.formats.gcode.drilling import Drill
from pentapod.toolpath.formats.gcode.language.blocks import Block, PlainLines, Word
from pentapod.toolpath.formats.gcode.language.problems import Problems
from pentapod.toolpath.formats.gcode.language.scan import Scan
from pentapod.toolpath.formats.gcode.language.sinumerik import SinumerikLines
from pentapod.toolpath.formats.gcode.language.vocabulary import (
    IDLE_G,
    IDLE_NAMES,
    NO_PLACES_G,
    REFUSED_G,
    REFUSED_NAMES,
    SPEED_G,
    Dialect,
)
from pentapod.toolpath.formats.gcode.lifts import lift
from pentapod.toolpath.formats.gcode.modes import Modes
from pentapod.toolpath.formats.gcode.motion import axis_targets, move, vector_axis
from pentapod.toolpath.formats.gcode.notes import notes
from pentapod.toolpath.formats.gcode.switches import Switches
from pentapod.toolpath.formats.gcode.tracer import TooManyError, Tracer
from pentapod.toolpath.formats.reading import StatementReader, read_lines
from pentapod.toolpath.formats.rotary import ANY_AXES, LETTERS
from pentapod.toolpath.toolpath import Toolpath

_Words = Mapping[str, Word]
_ONCE: dict[float, Callable[[Tracer, _Words, int], None]] = {
    10.0: places.set_data, 28.0: places.go_home, 30.0: places.go_home, 52.0: places.local_shift,
    53.0: places.machine_place, 153.0: places.machine_place, 92.0: places.set_coordinates,
    92.1: places.no_coordinates, 92.2: places.no_coordinates,
    68.2: planes.feature_plane, 68.0: planes.rotate,
}  # fmt: skip
"""Codes that take the axis words of their block."""
_LARGEST = 1e12
"""Largest number of a word."""
_CYCLES_OF_OTHERS, _CYCLE_WORDS = frozenset({70.0, 71.0}), frozenset("IJKLPQRU")
"""Inch and millimetre of some controllers, with these words cycles of others."""
_ORIENT, _ORIENT_AND_MOVE = frozenset({53.1, 53.3, 53.6}), 53.3
_TCP, _VECTOR_TCP = frozenset({43.4, 43.5, 169.0, 234.0}), 43.5
_DWELL, _STOP, _SMOOTHING = 4.0, 9.0, 187.0
_TCP_OFF = frozenset({43.0, 43.1, 43.2, 49.0, 168.0})
_IGNORED = frozenset("NOHDLPQRKIJS")
_FRAMES = ("TRANS", "ATRANS", "ROT", "AROT")
_TCP_ON, _TCP_ENDS = ("TRAORI",), ("TRAFOOF",)


@dataclass
class GCodeReader(StatementReader):
    """Reads a file of a dialect."""

    dialect: Dialect
    problems: Problems = field(default_factory=Problems, init=False)
    by_vector: bool = field(default=False, init=False)

    def toolpath(self) -> Toolpath:
        """Return the toolpath. Raises ToolpathError: the first problem of the file, the others in `others`."""
        lines = read_lines(self.file, has_end_mark=True)
        scan = Scan.of(lines, self.dialect)
        try:
            chain = scan.machine(self.dialect, self.file, self.defaults.rotary)
        except ToolpathError as error:
            self.problems.add(error)
            chain = ANY_AXES
        at = Coordinates(chain, scan.named, self.defaults.rotary is not None, tcp=scan.begins_with_tcp(self.dialect))
        self.modes = Modes(self.dialect, self.defaults.scale)
        self.tracer = Tracer(self.moves, at, self.modes, self.defaults)
        self.drill = Drill(self.tracer)
        self.switches = Switches(self.tracer, self.problems, scan)
        block_of = (SinumerikLines if self.dialect.equals else PlainLines)(self.wrong).block
        try:
            for line, text in enumerate(lines, start=1):
                if self.switches.ended is None or text.strip():
                    self._line(text, line, block_of)
            if self.switches.ended is None:
                what = "M2 or M30 is missing: the file was cut off"
                self.problems.add(self.wrong(what, len(lines), "M", expected="M2 or M30"))
        except TooManyError as error:
            self.problems.add(error)
        if self.defaults.tool is not None and self.defaults.tool not in self.switches.seen:
            known = ", ".join(dict.fromkeys(self.switches.seen)) or "none"
            what = "the file never takes this tool"
            self.problems.add(ToolpathError(what, file=self.file, key="tool", value=self.defaults.tool, expected=known))
        self.problems.check()
        told = notes(self.tracer, self.moves)
        if self.moves.tips:
            home_last = self.tracer.here is None and "home" in self.tracer.told
            lift(self.moves, self.tracer.lifts, at_end=home_last)
        return self.gathered(told)

    def _line(self, text: str, line: int, block_of: Callable[[str, int], Block]) -> None:
        """Read a line; what is wrong with it is kept for later."""
        stripped = text.strip()
        if stripped.startswith("%"):
            if self.moves.tips or self.modes.motion is not None:
                self.switches.ended = self.switches.ended or line
            return
        try:
            block = block_of(text, line)
            for comment in block.comments:
                self.read_remark(comment, line)
                self.tracer.kind, self.tracer.exact = self.kind, self.tilt_centre is not None
            if block.words:
                self._block(block)
        except TooManyError:
            raise
        except ToolpathError as error:
            if error.line is None:
                error = self.wrong(error.what, line, error.key or "", remedy=error.remedy)
            self.problems.add(error)

    def _block(self, block: Block) -> None:
        line = block.line
        if self.switches.ended is not None:
            if any(word.address not in "NO" for word in block.words):
                what = f"a block after the program's end in line {self.switches.ended}"
                raise self.wrong(what, line, str(block.words[0])[:20], remedy="make it a file of its own")
            return
        if block.skippable:
            self.tracer.tell("skip", line)
        for word in block.words:
            if abs(word.value) > _LARGEST:
                raise self.wrong("a number beyond any machine", line, word.address)
        codes = [round(word.value, 3) for word in block.words if word.address == "G"]
        names = [word for word in block.words if math.isnan(word.value) and word.address != "T"]
        words: dict[str, Word] = {}
        for word in block.words:
            if word.address in "GM" or word in names:
                continue
            if word.address in words:
                raise self.wrong("a word that comes twice in one block", line, word.address)
            words[word.address] = word
        self._feed_and_speed(codes, words, line)
        self.switches.take([word for word in block.words if word.address == "M"], words, line)
        taken = self._named(names, words, line)
        once = next((code for code in codes if code in _ONCE or code in _ORIENT), None)
        for code in codes:
            if code not in (once, _DWELL):
                self._mode(code, words, line)
        if _DWELL in codes:
            self._dwell(words, line)
        elif not taken:
            self._go(once, codes, words, line)

    def _go(self, once: float | None, codes: list[float], words: dict[str, Word], line: int) -> None:
        """Do what the axis words of a block are for. once: the code that takes them, if there is one."""
        if once in _ORIENT:
            planes.orient(self.tracer, line)
        elif once is not None:
            _ONCE[once](self.tracer, words, line)
        if (once is None and not NO_PLACES_G & set(codes)) or once == _ORIENT_AND_MOVE:
            self._move(codes, words, line)

    def _feed_and_speed(self, codes: list[float], words: dict[str, Word], line: int) -> None:
        """Take F and S, once the mode of the feed is known; not those of a dwell."""
        for code in codes:
            if code in (93.0, 94.0, 95.0):
                self.modes.take(code)
        if _DWELL in codes:
            return
        if "F" in words:
            if words["F"].value <= 0.0:
                raise self.wrong("the feed must be positive", line, str(words["F"]))
            self.modes.feed = words["F"].value
        if "S" in words:
            self.modes.speed = words["S"].value
            self.moves.add_words(str(words["S"]))

    def _named(self, names: list[Word], words: dict[str, Word], line: int) -> bool:
        """Take the commands of Sinumerik; whether one of them took the block's axis words."""
        taken = False
        for word in words.values():
            if word.address in REFUSED_NAMES:
                what, remedy = REFUSED_NAMES[word.address]
                self.problems.add(self.wrong(what, line, str(word), remedy=remedy))
        for word in names:
            name = word.address
            if name == "SUPA":
                places.machine_place(self.tracer, words, line)
                taken = True
            elif name in _TCP_ON or name in _TCP_ENDS:
                self.tracer.set_tcp(on=name in _TCP_ON)
            elif name in _FRAMES:
                planes.programmed_frame(self.tracer, name, words, line)
                taken = True
            elif name == "CYCLE800":
                planes.cycle800(self.tracer, word.arguments, line)
            elif (name.startswith("CYCLE8") and name in self.drill.names) or name == "MCALL":
                self.drill.called(name, word.arguments, line, modal=any(w.address == "MCALL" for w in names))
            elif name in REFUSED_NAMES:
                what, remedy = REFUSED_NAMES[name]
                self.problems.add(self.wrong(what, line, str(word), remedy=remedy))
            elif name == "RET":
                self.switches.ended = line
            elif name not in IDLE_NAMES:
                self.problems.add(self.wrong("a word that is not read", line, str(word)))
        return taken

    def _mode(self, code: float, words: dict[str, Word], line: int) -> None:
        """Take a modal code."""
        tracer, dialect = self.tracer, self.dialect
        old = self.modes.scale
        if code in _CYCLES_OF_OTHERS and not dialect.equals and _CYCLE_WORDS & set(words):
            self.problems.add(self.wrong("a cycle that is not read", line, f"G{code:g}", remedy="export it as moves"))
        elif self.modes.take(code):
            if self.modes.cycle is None:
                self.drill.end()
            if old not in (None, self.modes.scale) and self.moves.tips:
                self.problems.add(self.wrong("the unit changes after the first move", line, f"G{code:g}"))
        elif (system := places.system_of(code, words, dialect)) is not None:
            tracer.at.set_system(system)
        elif code in _TCP:
            self.by_vector = code == _VECTOR_TCP
            tracer.set_tcp(on=True)
        elif code in _TCP_OFF:
            self.by_vector = False
            tracer.set_tcp(on=tracer.at.tcp and not dialect.switched)
        elif code == 69.0:
            tracer.set_frames(None, None)
        elif code in REFUSED_G and not (dialect.switched and SPEED_G.get(code) in words):
            what, remedy = REFUSED_G[code]
            self.problems.add(self.wrong(what, line, f"G{code:g}", remedy=remedy))
        elif code == _SMOOTHING:
            words.pop("E", None)
        elif code not in IDLE_G and code not in REFUSED_G and code != _STOP:
            self.problems.add(self.wrong("a word that is not read", line, f"G{code:g}"))

    def _dwell(self, words: dict[str, Word], line: int) -> None:
        """Add the dwell of a G4 block."""
        times = [word for letter, word in words.items() if letter in self.dialect.dwell]
        others = [letter for letter in words if letter not in self.dialect.dwell and letter != "N"]
        if len(times) == 1 and others:
            what, remedy = "a dwell and other words in one block", "put them into a block of their own"
            raise self.wrong(what, line, str(words[others[0]]), remedy=remedy)
        if len(times) != 1 or times[0].value < 0.0:
            expected = " or ".join(f"G4 {letter}…" for letter in self.dialect.dwell)
            raise self.wrong("a dwell without its time", line, "G4", expected=expected)
        value = times[0].value
        milliseconds = self.dialect.milliseconds and times[0].address == "P"
        if milliseconds and "." in str(times[0]):
            raise self.wrong("seconds or milliseconds?", line, f"P{value:g}", remedy=f"write G4 X{value:g} for seconds")
        self.moves.add_dwell(1e-3 * value if milliseconds else value)

    def _move(self, codes: list[float], words: dict[str, Word], line: int) -> None:
        """Move to the axis words of a block, in the mode of motion that holds."""
        for letter in "UVW":
            if letter in words and words[letter].value != 0.0:
                raise self.wrong("a second axis along X, Y or Z", line, str(words[letter]), remedy="export X, Y and Z")
        unknown = [
            letter for letter in words if letter not in _IGNORED and letter not in "FTUVW" and not _is_place(letter)
        ]
        if unknown and not self.dialect.equals:
            raise self.wrong("an unknown word", line, unknown[0], expected="XYZABC")
        axes = {letter: word for letter, word in words.items() if letter in LINEAR or letter in LETTERS}
        vector = vector_axis(self.tracer, words, self.by_vector, line)
        if not axes and not vector and not (self.modes.motion in (2.0, 3.0) and {"I", "J", "K"} & set(words)):
            return
        if self.modes.scale is None and any(letter in LINEAR for letter in axes):
            expected = f'{self.dialect.units} before it, or unit = "mm" in [toolpath]'
            raise self.wrong("the unit is missing", line, next(iter(axes)), expected=expected)
        target = axis_targets(self.tracer, axes, line)
        first = next(iter(axes), "I")
        if self.modes.cycle is not None:
            self.drill.at(target, words, line)
        elif self.drill.modal is not None:
            move(self.tracer, target, words, line, first, rapid=True)
            self.drill.run_modal(line)
        else:
            move(self.tracer, target, words, line, first)
        if self.tracer.here is not None and (self.modes.stopping or _STOP in codes):
            self.moves.add_dwell(0.0)


def _is_place(address: str) -> bool:
    return address in LINEAR or address in LETTERS or address in ("A3", "B3", "C3", "CR", "TURN", "RPL")
