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
_TILT_CENTRE = "tilt_centre_mm"
_KINDS = (SegmentKind.CUT, SegmentKind.LINK)


@dataclass
class Remarks:
    """What a file's remarks have said so far. kind: of moves on feed from here on; tilt_centre: metres or None."""

    file: Path
    kind: SegmentKind = SegmentKind.CUT
    tilt_centre: float | None = None

    def read(self, comment: str, line: int) -> None:
        """Take in a comment; most are of no account. Raises ToolpathError where ours holds no number."""
        text = comment.strip()
        if not text.startswith(_MARK):
            return
        name, _, value = text.removeprefix(_MARK).partition(" ")
        if name in _KINDS:
            self.kind = SegmentKind(name)
        elif name in {_TILT_CENTRE, "pivot_mm"}:  # the second is how files of earlier versions call it
            self.tilt_centre = 1e-3 * number(value, self.file, line, name)


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
        """Return the toolpath of all moves, with the tilt centre that remarks or defaults tell."""
        return self.moves.toolpath(
            self.defaults.tilt_centre if self.remarks.tilt_centre is None else self.remarks.tilt_centre
        )


def kind_remark(kind: SegmentKind) -> str:
    """Return the comment before moves on feed of a kind."""
    return f"{_MARK}{kind}"


def tilt_centre_remark(tilt_centre: float) -> str:
    """Return the comment that tells the tilt centre, metres."""
    return f"{_MARK}{_TILT_CENTRE} {1e3 * tilt_centre!r}"
