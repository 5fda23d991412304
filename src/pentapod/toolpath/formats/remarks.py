"""Remarks: comments by which pentapod's files keep what their language has no word for."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from pentapod.base.errors import ToolpathError
from pentapod.toolpath.formats.moves import Moves
from pentapod.toolpath.formats.reading import number
from pentapod.toolpath.formats.registry import Defaults
from pentapod.toolpath.toolpath import SegmentKind, Toolpath

_MARK = "pentapod "
_PIVOT = "pivot_mm"
_KINDS = (SegmentKind.CUT, SegmentKind.LINK)


@dataclass
class Remarks:
    """What a file's remarks have said so far. kind: of moves on feed from here on; pivot: metres, None if not told."""

    file: Path
    kind: SegmentKind = SegmentKind.CUT
    pivot: float | None = None

    def read(self, comment: str, line: int) -> None:
        """Take in a comment; most are of no account. Raises ToolpathError where ours holds no number."""
        text = comment.strip()
        if not text.startswith(_MARK):
            return
        name, _, value = text.removeprefix(_MARK).partition(" ")
        if name in _KINDS:
            self.kind = SegmentKind(name)
        elif name == _PIVOT:
            self.pivot = 1e-3 * number(value, self.file, line, name)


@dataclass
class StatementReader:
    """What readers of statements line by line hold: the file's moves and remarks so far."""

    file: Path
    defaults: Defaults
    moves: Moves = field(init=False)
    remarks: Remarks = field(init=False)

    def __post_init__(self) -> None:
        self.moves, self.remarks = Moves(self.file), Remarks(self.file)

    def wrong(self, what: str, line: int, word: str, **details: object) -> ToolpathError:
        """Return the error of a word in a line."""
        return ToolpathError(what, file=self.file, line=line, key=word, **details)  # type: ignore[arg-type]

    def gathered(self) -> Toolpath:
        """Return the toolpath of all moves, with the pivot that remarks or defaults tell."""
        return self.moves.toolpath(self.defaults.pivot if self.remarks.pivot is None else self.remarks.pivot)


def kind_remark(kind: SegmentKind) -> str:
    """Return the comment before moves on feed of a kind."""
    return f"{_MARK}{kind}"


def pivot_remark(pivot: float) -> str:
    """Return the comment that tells the pivot, metres."""
    return f"{_MARK}{_PIVOT} {1e3 * pivot!r}"
