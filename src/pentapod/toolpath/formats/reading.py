"""Shared parts of the readers of toolpath text: lines, numbers, and statements with the remarks between them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pentapod.base.errors import ToolpathError
from pentapod.base.files import number_in, read_bytes
from pentapod.toolpath.formats.moves import KIND_REMARKS, REMARK, TILT_CENTRE_REMARK, Moves
from pentapod.toolpath.formats.registry import Defaults
from pentapod.toolpath.toolpath import SegmentKind, Toolpath

MOST_BYTES = 500_000_000
"""Largest file that is read; ten million waypoints need less."""


def read_lines(
    file: Path, what: str = "a toolpath", most: int = MOST_BYTES, *, has_end_mark: bool = False
) -> list[str]:
    """Return the lines of a UTF-8 text file. Raises ToolpathError: missing, empty, too large, not text, truncated.

    what: the kind of file, for messages; most: bytes. A last line without its end counts as truncated. has_end_mark:
    the language has a word for the end, which the caller looks for: the last line needs no end then, and comments may
    be in Latin-1, as older programs write them.
    """
    data = read_bytes(file, ToolpathError, what, most)
    if not data.strip(b" \t\r\n\0"):
        raise ToolpathError("the file is empty", file=file, expected=what)
    if b"\0" in data:
        wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
        problem = "not UTF-8 text but UTF-16" if wide else "not a text file: it holds zero bytes"
        line = data.count(b"\n", 0, data.index(b"\0")) + 1
        raise ToolpathError(problem, file=file, line=line, remedy="save it as UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if has_end_mark:
            return _lines(data.decode("latin-1"), file, has_end_mark=True)
        line = data.count(b"\n", 0, error.start) + 1
        value = data[error.start : error.start + 1]
        raise ToolpathError("not UTF-8 text", file=file, line=line, value=value, remedy="save it as UTF-8") from error
    return _lines(text, file, has_end_mark=has_end_mark)


def _lines(text: str, file: Path, *, has_end_mark: bool) -> list[str]:
    if not text.endswith("\n"):
        if not has_end_mark:
            raise ToolpathError(
                "the last line has no end: the file was cut off", file=file, line=text.count("\n") + 1,
                remedy="export it again, or end the last line",
            )  # fmt: skip
        text += "\n"
    lines = text.replace("\r\n", "\n").split("\n")[:-1]
    if "\r" in text and (odd := next((k for k, line in enumerate(lines, start=1) if "\r" in line), None)):
        raise ToolpathError("a carriage return within a line", file=file, line=odd, remedy="end lines with a line feed")
    return lines


def number(text: str, file: Path, line: int, word: str) -> float:
    """Return a finite number. Raises ToolpathError naming the word."""
    value = number_in(text)
    if value is None:
        raise ToolpathError("not a finite number", file=file, line=line, key=word, value=text.strip()[:40])
    return value


def seconds(text: str, file: Path, line: int, word: str) -> float:
    """Return a time, 0 or more. Raises ToolpathError naming the word."""
    value = number(text, file, line, word)
    if value < 0.0:
        raise ToolpathError("a time below 0", file=file, line=line, key=word, value=text.strip()[:40])
    return value


@dataclass
class StatementReader:
    """Base of the readers of APT and G-code: the moves of a file so far, and what its remarks say.

    kind: of the feed moves from here on; tilt_centre: metres, or None where the file does not give it.
    """

    file: Path
    defaults: Defaults
    moves: Moves = field(init=False)
    kind: SegmentKind = field(default=SegmentKind.CUT, init=False)
    tilt_centre: float | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        self.moves = Moves(self.file)

    def read_remark(self, comment: str, line: int) -> None:
        """Evaluate a comment that pentapod wrote; ignore others. Raises ToolpathError where its number is wrong."""
        text = comment.strip()
        if not text.startswith(REMARK):
            return
        name, _, value = text.removeprefix(REMARK).partition(" ")
        if name in KIND_REMARKS:
            self.kind = SegmentKind(name)
        elif name in {TILT_CENTRE_REMARK, "pivot_mm"}:  # the second is the name in files of earlier versions
            self.tilt_centre = 1e-3 * number(value, self.file, line, name)

    def wrong(self, what: str, line: int, word: str, **details: Any) -> ToolpathError:
        """Return the error of a word in a line of the file."""
        return self.moves.wrong(what, line, word, **details)

    def gathered(self, notes: tuple[str, ...] = ()) -> Toolpath:
        """Return the toolpath of all moves. notes: how the file was read."""
        return self.moves.toolpath(self.defaults.tilt_centre if self.tilt_centre is None else self.tilt_centre, notes)
