"""APT / CLDATA (ISO 4343): GOTO with i, j, k, MULTAX, RAPID, FEDRAT, DELAY, UNITS and words that do not move the tool.

The reader is strict: a missing unit, an unknown word, and words that it cannot follow (CUTCOM, TRACUT) are errors.
i, j, k point from the tip to the spindle. RAPID holds for the next GOTO only. DELAY/s is a dwell of s seconds at the
last point; DELAY/0 is an exact stop. A `$$` remark "pentapod link" or "pentapod cut" gives the kind of the feed moves,
for which APT has no word.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pentapod.base.errors import nearest
from pentapod.toolpath.formats.apt_words import statements_of, words_of
from pentapod.toolpath.formats.moves import dwell_times, kind_remark, plain, poses, tilt_centre_remark, words_before
from pentapod.toolpath.formats.reading import StatementReader, number, read_lines, seconds
from pentapod.toolpath.formats.registry import Defaults, Format, register
from pentapod.toolpath.toolpath import SegmentKind, Toolpath

_MM = {"MM": 1.0, "INCHES": 25.4, "INCH": 25.4}
_PER_MINUTE = {"MMPM": 1.0, "IPM": 25.4}
_NAMED = ("PARTNO", "PPRINT", "REMARK", "TITLE")  # a text follows, with or without a slash
_SILENT = frozenset((*_NAMED, "MACHIN", "TOOLNO", "CLDATE", "TLNAME", "END"))
_SAYING, _INSERTED = frozenset({"LOADTL", "SPINDL", "COOLNT", "STOP", "OPSTOP"}), "INSERT"
"""Words that do not move the tool; those about spindle, coolant and tool are kept."""

_REFUSED = {
    "CUTCOM": "cutter compensation shifts the path: export without it",
    "TRACUT": "a transformation of what follows: export it applied",
    "COPY": "a repetition of what came before: export it applied",
    "CIRCLE": "arcs are not read: export points",
    "ARCSLP": "arcs are not read: export points",
    "CYCLE": "drilling cycles are not read: export points",
    "GODLTA": "increments are not read: export absolute points",
}
_LONGEST_SHOWN, _MOST = 40, 6
"""Characters of a statement, and statements, that notes show."""
_WORDS = ("UNITS", "MULTAX", "FEDRAT", "RAPID", "GOTO", "FROM", "CUTTER", "DELAY", "FINI")


@dataclass
class _Reader(StatementReader):
    unit: float | None = None
    five_axis: bool = False
    feed: float | None = None
    rapid: bool = False
    ended: int | None = None
    unknown: dict[str, int] = field(default_factory=dict[str, int])

    def toolpath(self) -> Toolpath:
        line, pending, lines = 0, "", read_lines(self.file)
        for line, raw in enumerate(lines, start=1):
            text, _, remark = raw.partition("$$")
            self.read_remark(remark, line)
            text = text.strip()
            if text.endswith("$"):
                pending += text[:-1]
                continue
            statement, pending = pending + text, ""
            if statement:
                self._statement(statement, line)
        if pending:
            raise self.wrong("the file ends within a statement", line, pending.split("/")[0].strip())
        if self.ended is None:
            raise self.wrong("FINI is missing: the file was cut off", line, "FINI", expected="FINI as the last word")
        told = [f"not kept: {text[:_LONGEST_SHOWN]} (line {at})" for text, at in self.unknown.items()]
        if len(told) > _MOST:
            told = [*told[:_MOST], f"not kept: {len(told) - _MOST} more statements"]
        return self.gathered(tuple(told))

    def _statement(self, text: str, line: int) -> None:
        head, _, tail = text.partition("/")
        word = head.strip().upper()
        if self.ended is not None:
            raise self.wrong("a word after FINI", line, word)
        if word in _SILENT or word.startswith(_NAMED):
            return
        values = [part.strip() for part in tail.split(",")] if tail.strip() else []
        if word in _SAYING or word.startswith(_INSERTED):
            self._say(text, word, values, line)
            return
        if word in _REFUSED:
            raise self.wrong("a word that is not read", line, word, remedy=_REFUSED[word])
        if word not in _WORDS:
            raise self.wrong("an unknown word", line, word[:20], remedy=nearest(word, _WORDS))
        getattr(self, f"_{word.lower()}")(values, line)

    def _say(self, text: str, word: str, values: list[str], line: int) -> None:
        """Keep what a statement says of spindle, coolant and tool."""
        said = words_of(word, values) if word in _SAYING else (text[len(_INSERTED) :].strip("/ "),)
        if said is None:
            self.unknown.setdefault(text, line)
        for one in said or ():
            self.moves.add_words(one)

    def _units(self, words: list[str], line: int) -> None:
        if len(words) != 1 or words[0].upper() not in _MM:
            raise self.wrong("unknown unit", line, "UNITS", value=",".join(words)[:40], expected="MM or INCHES")
        if self.moves.tips:
            raise self.wrong("the unit changes after the first point", line, "UNITS")
        self.unit = _MM[words[0].upper()]

    def _multax(self, words: list[str], line: int) -> None:
        mode = [word.upper() for word in words]
        if mode not in ([], ["ON"], ["OFF"]):
            raise self.wrong("neither ON nor OFF", line, "MULTAX", value=",".join(words)[:40])
        self.five_axis = mode != ["OFF"]

    def _fedrat(self, words: list[str], line: int) -> None:
        if len(words) != 2 or words[1].upper() not in _PER_MINUTE:
            raise self.wrong(
                "a feed needs its unit", line, "FEDRAT", value=",".join(words)[:40], expected="FEDRAT/f,MMPM or f,IPM"
            )
        feed = number(words[0], self.file, line, "FEDRAT") * _PER_MINUTE[words[1].upper()]
        if feed <= 0.0:
            raise self.wrong("the feed must be positive", line, "FEDRAT", value=words[0])
        self.feed, self.rapid = feed, False

    def _rapid(self, words: list[str], line: int) -> None:
        if words:
            raise self.wrong("RAPID takes no value", line, "RAPID", value=",".join(words)[:40])
        self.rapid = True

    def _cutter(self, words: list[str], line: int) -> None:
        numbers = [number(word, self.file, line, "CUTTER") for word in words]
        if not numbers or numbers[0] <= 0.0:
            raise self.wrong("a cutter needs its diameter", line, "CUTTER", value=",".join(words)[:40])
        if self.unit is None:
            raise self.wrong("the unit is missing", line, "CUTTER", expected="UNITS/MM or UNITS/INCHES before it")
        ball = len(numbers) > 1 and abs(numbers[1] - 0.5 * numbers[0]) <= 1e-6 * numbers[0]
        # The last of CUTTER and the remarks counts.
        self.tilt_centre = numbers[1] * self.unit * 1e-3 if ball else 0.0

    def _delay(self, words: list[str], line: int) -> None:
        if len(words) != 1:
            raise self.wrong("not a time", line, "DELAY", value=",".join(words)[:40], expected="DELAY/seconds")
        self.moves.add_dwell(seconds(words[0], self.file, line, "DELAY"))

    def _from(self, words: list[str], line: int) -> None:
        if self.moves.tips:
            raise self.wrong("FROM after the first point", line, "FROM")
        self.rapid = True
        self._point(words, line, "FROM")

    def _goto(self, words: list[str], line: int) -> None:
        self._point(words, line, "GOTO")

    def _point(self, words: list[str], line: int, name: str) -> None:
        if self.unit is None:
            raise self.wrong("the unit is missing", line, name, expected="UNITS/MM or UNITS/INCHES before it")
        expected = "x,y,z,i,j,k" if self.five_axis else "x,y,z"
        if len(words) != (6 if self.five_axis else 3):
            remedy = "MULTAX/ON is missing" if len(words) == 6 else None
            raise self.wrong("wrong number of values", line, name, value=len(words), expected=expected, remedy=remedy)
        values = [number(word, self.file, line, name) for word in words]
        axis = values[3:] if self.five_axis else [0.0, 0.0, 1.0]
        feed = self.defaults.feed if self.feed is None else self.feed / 6e4
        if feed is None and not self.rapid:
            raise self.wrong("the feed is missing", line, name, expected="FEDRAT before it")
        kind = SegmentKind.RAPID if self.rapid else self.kind
        speed = float("inf") if self.rapid or feed is None else feed * 6e4
        self.moves.add([v * self.unit for v in values[:3]], axis, kind, speed, line, name)
        self.rapid = False

    def _fini(self, words: list[str], line: int) -> None:
        if words:
            raise self.wrong("FINI takes no value", line, "FINI", value=",".join(words)[:40])
        self.ended = line


def _read(file: Path, defaults: Defaults) -> Toolpath:
    return _Reader(file, defaults).toolpath()


def _write(toolpath: Toolpath) -> bytes:
    tips, axes, kinds, feeds = poses(toolpath)
    dwells = dwell_times(toolpath)
    lines = ["PARTNO PENTAPOD", "UNITS/MM", f"$$ {tilt_centre_remark(toolpath.tilt_centre)}", "MULTAX/ON"]
    kind, feed, said = SegmentKind.CUT, np.nan, words_before(toolpath)
    for k in range(len(tips)):
        lines += statements_of(said.get(k, ()))
        move = kinds[k - 1] if k else SegmentKind.RAPID
        if move == SegmentKind.RAPID:
            lines.append("RAPID")
            # FEDRAT is modal in most readers; in some RAPID cancels it, so that it is repeated.
            feed = np.nan
        else:
            if move != kind:
                lines.append(f"$$ {kind_remark(move)}")
                kind = move
            if feeds[k - 1] != feed:
                feed = float(feeds[k - 1])
                lines.append(f"FEDRAT/{plain(feed, 6)},MMPM")
        point = ",".join([*(plain(v, 7) for v in tips[k]), *(plain(v, 12) for v in axes[k])])
        lines.append(f"GOTO/{point}")
        if k in dwells:
            lines.append(f"DELAY/{plain(dwells[k], 9)}")
    return ("\n".join([*lines, *statements_of(toolpath.end_words), "FINI"]) + "\n").encode()


register(
    Format(
        "apt",
        (".apt", ".cls", ".cl", ".cldata"),
        "APT / CLDATA cutter locations",
        _read,
        _write,
        loses=frozenset({"power"}),
    )
)
