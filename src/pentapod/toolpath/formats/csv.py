"""Toolpath CSV: one waypoint a row with the kind, feed and power of the move to it, and its dwell."""

from __future__ import annotations

import re
from pathlib import Path

from pentapod.base.errors import ToolpathError
from pentapod.toolpath.formats.moves import Moves, dwell_times, plain, poses
from pentapod.toolpath.formats.reading import number, read_lines, seconds
from pentapod.toolpath.formats.registry import Defaults, Format, register
from pentapod.toolpath.toolpath import SegmentKind, Toolpath

_COLUMNS = "x_mm,y_mm,z_mm,i,j,k,kind,feed_mm_min,power,dwell_s"
_OPTIONAL = (",dwell_s", ",power,dwell_s", ",kind,feed_mm_min,power,dwell_s")
_MM = {"mm": 1.0, "m": 1e3, "inch": 25.4}
_HEADER = re.compile(r"#\s*(\w+)\s*=\s*(\S+)\s*$")
_START = "start"


def _read(file: Path, defaults: Defaults) -> Toolpath:
    lines = read_lines(file)
    header: dict[str, tuple[str, int]] = {}
    row = 0
    while row < len(lines) and lines[row].startswith("#"):
        if match := _HEADER.match(lines[row]):
            header[match[1]] = (match[2], row + 1)
        row += 1
    if row == len(lines):
        raise ToolpathError("there are no columns", file=file, line=row, expected=_COLUMNS)
    scale = _unit(file, row + 1, lines[row])
    names = lines[row].split(",")
    moves = Moves(file)
    for line, text in enumerate(lines[row + 1 :], start=row + 2):
        cells = text.split(",")
        if len(cells) != len(names):
            raise moves.wrong("wrong number of columns", line, value=len(cells), expected=str(len(names)))
        values = [number(cell, file, line, name) for cell, name in zip(cells[:6], names[:6], strict=True)]
        kind, feed = _kind_and_feed(file, line, cells[6:8], defaults, first=not moves.tips)
        power = number(cells[8], file, line, "power") if len(cells) > 8 else 1.0
        if not 0.0 <= power <= 1.0:
            raise moves.wrong("not a share", line, "power", value=cells[8], expected="0 to 1")
        moves.add([v * scale for v in values[:3]], values[3:], kind, feed, line, "i,j,k", power)
        if len(cells) > 9 and cells[9]:
            moves.add_dwell(seconds(cells[9], file, line, "dwell_s"))
    if "waypoints" in header:
        text, line = header["waypoints"]
        if number(text, file, line, "waypoints") != len(moves.tips):
            what = "the number of rows is not that of the header: the file was cut off or rows were added"
            raise moves.wrong(what, len(lines), "waypoints", value=len(moves.tips), expected=text)
    tilt_centre = defaults.tilt_centre
    for name in ("pivot_mm", "tilt_centre_mm"):  # the first is the name in files of earlier versions
        if name in header:
            text, line = header[name]
            tilt_centre = 1e-3 * number(text, file, line, name)
    return moves.toolpath(tilt_centre)


def _unit(file: Path, line: int, names: str) -> float:
    """Return millimetres in the unit of the first three columns. Raises ToolpathError for other columns."""
    for unit, scale in _MM.items():
        known = _COLUMNS.replace("x_mm,y_mm,z_mm", f"x_{unit},y_{unit},z_{unit}")
        if names in (known, *(known.removesuffix(missing) for missing in _OPTIONAL)):
            return scale
    bare = names.split(",")[:3] == ["x", "y", "z"]
    what = "the columns x, y, z have no unit" if bare else "wrong column names"
    raise ToolpathError(what, file=file, line=line, value=names[:80], expected=f"{_COLUMNS} (or m, inch)")


def _kind_and_feed(
    file: Path, line: int, cells: list[str], defaults: Defaults, *, first: bool
) -> tuple[SegmentKind, float]:
    """Return kind and feed, mm/min, of the move to a row."""
    word, text = cells if cells else (SegmentKind.CUT.value, "")
    if first and word == _START:
        return SegmentKind.RAPID, float("inf")
    if word not in tuple(SegmentKind):
        known = ", ".join(SegmentKind)
        raise ToolpathError("unknown kind of move", file=file, line=line, key="kind", value=word[:40], expected=known)
    if word == SegmentKind.RAPID:
        return SegmentKind.RAPID, float("inf")
    if text == "" and defaults.feed is not None:
        return SegmentKind(word), 6e4 * defaults.feed
    feed = number(text, file, line, "feed_mm_min")
    if feed <= 0.0:
        raise ToolpathError("the feed must be positive", file=file, line=line, key="feed_mm_min", value=feed)
    return SegmentKind(word), feed


def _write(toolpath: Toolpath) -> bytes:
    tips, axes, kinds, feeds = poses(toolpath)
    dwells = dwell_times(toolpath)
    powers = [toolpath.segments[k].power for k in toolpath.segment_of_interval]
    lines = [
        "# pentapod_toolpath = 1",
        f"# tilt_centre_mm = {1e3 * toolpath.tilt_centre!r}",
        f"# waypoints = {len(tips)}",
        _COLUMNS,
    ]
    for k in range(len(tips)):
        cells = [*(plain(v, 7) for v in tips[k]), *(plain(v, 12) for v in axes[k])]
        kind = str(kinds[k - 1]) if k else _START
        feed = plain(float(feeds[k - 1]), 6) if k and kinds[k - 1] != SegmentKind.RAPID else ""
        power = plain(powers[k - 1], 9) if k else "1.0"
        dwell = plain(dwells[k], 9) if k in dwells else ""
        lines.append(",".join([*cells, kind, feed, power, dwell]))
    return ("\n".join(lines) + "\n").encode()


register(Format("csv", (".csv",), "one waypoint a row, units in the column names", _read, _write))
