"""RoboDK CSV of points with normals: X,Y,Z,NX,NY,NZ[,speed] in mm and mm/s, with or without a header row.

The normal points from the tip to the spindle. A row's speed is that of the move to it, empty for a rapid: RoboDK then
uses the robot's own. The format does not distinguish links from cuts and has no tilt centre.
"""

from __future__ import annotations

from pathlib import Path

from pentapod.toolpath.formats.moves import Moves, plain, poses
from pentapod.toolpath.formats.reading import number, read_lines
from pentapod.toolpath.formats.registry import Defaults, Format, register
from pentapod.toolpath.toolpath import SegmentKind, Toolpath

_NAMES = ("X", "Y", "Z", "NX", "NY", "NZ", "SPEED")


def _read(file: Path, defaults: Defaults) -> Toolpath:
    moves, width = Moves(file), 0
    for line, text in enumerate(read_lines(file), start=1):
        cells = [cell.strip() for cell in text.split(",")]
        if line == 1 and tuple(cell.upper() for cell in cells) in (_NAMES, _NAMES[:6]):
            width = len(cells)
            continue
        width = width or len(cells)
        if len(cells) != width or width not in (6, 7):
            expected = str(width) if width in (6, 7) else "6 or 7: X,Y,Z,NX,NY,NZ[,speed]"
            raise moves.wrong("wrong number of columns", line, value=len(cells), expected=expected)
        values = [number(cell, file, line, name) for cell, name in zip(cells[:6], _NAMES, strict=False)]
        kind, feed = SegmentKind.CUT, defaults.feed
        if width == 7 and cells[6] == "":
            kind, feed = SegmentKind.RAPID, float("inf")
        elif width == 7:
            feed = 1e-3 * number(cells[6], file, line, "SPEED")
            if feed <= 0.0:
                raise moves.wrong("the speed must be positive", line, "SPEED", value=cells[6])
        if feed is None:
            raise moves.wrong("the speed is missing", line, "SPEED", expected="a seventh column")
        moves.add(values[:3], values[3:], kind, 6e4 * feed, line, "NX,NY,NZ")
    return moves.toolpath(defaults.tilt_centre)


def _write(toolpath: Toolpath) -> bytes:
    tips, axes, kinds, feeds = poses(toolpath)
    lines = [",".join(_NAMES)]
    for k in range(len(tips)):
        cells = [*(plain(v, 7) for v in tips[k]), *(plain(v, 12) for v in axes[k])]
        speed = plain(float(feeds[k - 1]) / 60.0, 9) if k and kinds[k - 1] != SegmentKind.RAPID else ""
        lines.append(",".join([*cells, speed]))
    return ("\n".join(lines) + "\n").encode()


register(
    Format(
        "robodk",
        (".robodk.csv",),
        "RoboDK: X,Y,Z,NX,NY,NZ,speed",
        _read,
        _write,
        loses=frozenset({"links", "tilt_centre", "end", "power", "dwell"}),
    )
)
