"""Registry of toolpath formats; toolpath files are read and written by their suffix."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pentapod.base.errors import ToolpathError, nearest
from pentapod.base.files import atomic_write
from pentapod.base.values import Value
from pentapod.toolpath.formats.rotary import RotaryAxes
from pentapod.toolpath.toolpath import Toolpath

_UNITS = {"mm": 1.0, "inch": 25.4}


@dataclass(frozen=True)
class Defaults:
    """Values for what a file does not give: tilt_centre in metres, feed in m/s.

    chordal: largest distance of a chord from an arc, metres. rotary: the rotary axes of the machine for which the file
    was made; None for the usual ones. tool: read the moves of this tool only. scale: millimetres in the unit of a file
    that does not name it.
    """

    tilt_centre: float = 0.0
    feed: float | None = None
    chordal: float = 10e-6
    rotary: RotaryAxes | None = None
    tool: str | None = None
    scale: float | None = None


@dataclass(frozen=True)
class Format(Value):
    """A file format. suffixes: lower case. loses: properties of a toolpath that it has no words for.

    names_machine: the reader takes rotary axes and a tool (`Defaults`).
    read: file → Toolpath, in metres, workpiece frame; raises ToolpathError with file, line and word.
    write: Toolpath → bytes; the same toolpath gives the same bytes.
    """

    name: str
    suffixes: tuple[str, ...]
    about: str
    read: Callable[[Path, Defaults], Toolpath]
    write: Callable[[Toolpath], bytes]
    loses: frozenset[str] = frozenset()
    names_machine: bool = False


FORMATS: dict[str, Format] = {}


def register(new: Format) -> None:
    """Add a format to `FORMATS`."""
    FORMATS[new.name] = new


def format_of(path: str | Path, name: str | None = None) -> Format:
    """Return the format of this name, or else of the file's suffix. Raises ToolpathError for unknown ones."""
    file = Path(path)
    if name is not None:
        if name not in FORMATS:
            raise ToolpathError("unknown format", file=file, key="format", value=name, remedy=nearest(name, FORMATS))
        return FORMATS[name]
    fitting = [(len(s), f) for f in FORMATS.values() for s in f.suffixes if file.name.lower().endswith(s)]
    if not fitting:
        known = ", ".join(s for f in FORMATS.values() for s in f.suffixes)
        raise ToolpathError("no toolpath format has this suffix", file=file, value=file.suffix, expected=known)
    return max(fitting, key=lambda pair: pair[0])[1]


def read_toolpath(
    path: str | Path,
    format_name: str | None = None,
    *,
    tilt_centre: float = 0.0,
    feed: float | None = None,
    chordal: float = 10e-6,
    rotary: RotaryAxes | None = None,
    tool: str | None = None,
    unit: str | None = None,
) -> Toolpath:
    """Return the toolpath of a file, workpiece frame, metres. Without a name the suffix decides on the format.

    tilt_centre: metres, for formats without it (see `Toolpath`); feed: m/s, of moves without one; chordal: metres by
    which chords leave arcs. For G-code only: rotary: the rotary axes for which the file was made; tool: read the moves
    of this tool only; unit: "mm" or "inch", of a file that does not name it. Raises ToolpathError with file, line and
    word for anything that is not understood; `others` holds what else is wrong in the file. What was left out, such as
    moves to the home position, is in `notes`.

    >>> _ = write_toolpath(toolpath, "path.csv")
    >>> len(read_toolpath("path.csv")) == len(toolpath)
    True
    """
    file = Path(path)
    form = format_of(file, format_name)
    for key, value in (("rotary_axes", rotary), ("tool", tool), ("unit", unit)):
        if value is not None and not form.names_machine:
            raise ToolpathError("only G-code takes this", file=file, key=key, value=value, remedy="leave it out")
    if unit not in (None, *_UNITS):
        raise ToolpathError("unknown unit", file=file, key="unit", value=unit, expected=" or ".join(_UNITS))
    return form.read(file, Defaults(tilt_centre, feed, chordal, rotary, tool, _UNITS.get(unit or "")))


def write_toolpath(toolpath: Toolpath, path: str | Path, format_name: str | None = None) -> Path:
    """Write a toolpath and return its path. Without a name the suffix decides on the format.

    Equal toolpaths give equal bytes; an interruption leaves no partial file. Raises ToolpathError for an unknown
    format, InputError where the file cannot be written.

    >>> write_toolpath(toolpath, "path.apt").name
    'path.apt'
    """
    file = Path(path)
    content = format_of(file, format_name).write(toolpath)
    with atomic_write(file) as temporary:
        temporary.write_bytes(content)
    return file
