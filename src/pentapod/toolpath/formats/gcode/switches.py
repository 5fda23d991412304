"""M and T words: end of the program, tool, spindle, coolant, kinematics, functions of the machine's builder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from pentapod.toolpath.formats.gcode.language.blocks import Word
from pentapod.toolpath.formats.gcode.language.problems import Problems
from pentapod.toolpath.formats.gcode.language.scan import Scan
from pentapod.toolpath.formats.gcode.language.vocabulary import COOLANT_M, ENDS_M, IDLE_M, REFUSED_M, SPINDLE_M, STOP_M
from pentapod.toolpath.formats.gcode.tracer import Tracer

_CHANGE, _SET_TOOL = 6.0, 61.0
_TCP_ON, _TCP_OFF = 428.0, 429.0
_SUBPROGRAM_ENDS = 17.0
_OUTPUTS = frozenset({67.0, 68.0})
"""Analog outputs of LinuxCNC, E, set to a value, Q."""


@dataclass
class Switches:
    """Takes M and T words.

    pending: the tool that the next M6 brings; seen: tools that were in the spindle; ended: the line that ends the
    program.
    """

    tracer: Tracer
    problems: Problems
    scan: Scan
    pending: str = ""
    seen: list[str] = field(default_factory=list[str])
    ended: int | None = None

    def take(self, switches: Sequence[Word], words: dict[str, Word], line: int) -> None:
        """Take the M and T words of a block, and those that belong to them; what they switch is kept as words."""
        tracer = self.tracer
        if "T" in words:
            word = words["T"]
            self.pending = word.arguments[0] if word.arguments else f"{word.value:g}"
            tracer.moves.add_words(str(word))
            if not self.scan.changes_tools:
                self._take_tool()
        for word in switches:
            code = word.value
            if self._ends(code):
                self.ended = line
            elif code in REFUSED_M:
                what, remedy = REFUSED_M[code]
                self.problems.add(tracer.wrong(what, line, str(word), remedy))
            elif code in (_TCP_ON, _TCP_OFF) and not tracer.modes.dialect.switched:
                tracer.set_tcp(on=code == _TCP_ON)
            elif code in (_CHANGE, _SET_TOOL):
                self._change_tool(word, words, line)
            elif code in STOP_M:
                tracer.moves.add_words(str(word))
                tracer.tell("stop", line)
            elif code in _OUTPUTS and "E" in words and "Q" in words:
                tracer.moves.add_words(" ".join(str(each) for each in (word, words.pop("E"), words.pop("Q"))))
            elif code not in IDLE_M:
                tracer.moves.add_words(str(word))
                if code not in SPINDLE_M and code not in COOLANT_M:
                    tracer.tell(f"function {word}", line)

    def _ends(self, code: float) -> bool:
        return code in ENDS_M and (code != _SUBPROGRAM_ENDS or self.tracer.modes.dialect.equals)

    def _change_tool(self, word: Word, words: Mapping[str, Word], line: int) -> None:
        if word.value == _SET_TOOL and "Q" in words:
            self.pending = f"{words['Q'].value:g}"
        self._take_tool()
        self.tracer.moves.add_words(str(word))
        if self.tracer.moves.tips and word.value == _CHANGE:
            self.tracer.here = None
            self.tracer.tell("tool change", line)

    def _take_tool(self) -> None:
        self.tracer.tool = self.pending
        self.seen.append(self.pending)
