"""G-code: programs of CAM systems for LinuxCNC, for Fanuc and its relatives, and for Sinumerik 840D.

Coordinates are those of the tip against the part. G0 is a rapid, G1 a cut, or a link after a comment "(pentapod link)";
arcs become chords. LinuxCNC's kinematics of five axes always work with tool centre point programming; other controllers
switch it on by G43.4 or TRAORI, and need it only where a rotary axis is turned. G4 is a dwell at the last point: P in
seconds for LinuxCNC, P in whole milliseconds, X and U in seconds for Fanuc, F in seconds for Sinumerik. A dwell of no
time is an exact stop; so is every point in mode G61.1 (G61, G60 of other controllers) and the end of a block with G9.
Moves to the home position are left out, and the tool passes over the part instead. All that is not read is told in
one run, with line, word, reason and remedy.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

from pentapod.toolpath.formats.gcode.language.vocabulary import ISO, LINUXCNC, SINUMERIK, Dialect
from pentapod.toolpath.formats.gcode.reader import GCodeReader
from pentapod.toolpath.formats.gcode.writer import write_plain, write_sinumerik
from pentapod.toolpath.formats.registry import Defaults, Format, register
from pentapod.toolpath.formats.rotary import AB, BC, Rotary
from pentapod.toolpath.toolpath import Toolpath


def _read(file: Path, defaults: Defaults, dialect: Dialect) -> Toolpath:
    return GCodeReader(file, defaults, dialect).toolpath()


def _variant(name: str, suffixes: tuple[str, ...], about: str, dialect: Dialect, rotary: Rotary, inverse: bool) -> None:
    read = partial(_read, dialect=dialect)
    write = partial(write_plain, rotary=rotary, needs_tcp=dialect.switched, inverse_time=inverse)
    register(Format(name, suffixes, about, read, write, frozenset({"power"}), names_machine=True))


_variant("xyzab", (".ngc",), "G-code of LinuxCNC; written as XYZAB for pentakins", LINUXCNC, AB, inverse=False)
_variant("xyzab-g93", (), "the same, inverse time feed", LINUXCNC, AB, inverse=True)
_variant(
    "xyzbc", (".nc", ".tap", ".cnc", ".ptp", ".eia", ".gcode", ".gc"),
    "G-code of Fanuc and others; written as XYZBC with G43.4", ISO, BC, inverse=False,
)  # fmt: skip
_variant("xyzbc-g93", (), "the same, inverse time feed", ISO, BC, inverse=True)
register(
    Format(
        "sinumerik", (".mpf",), "G-code of Sinumerik 840D; written with TRAORI and tool axes",
        partial(_read, dialect=SINUMERIK), write_sinumerik, frozenset({"power"}), names_machine=True,
    )
)  # fmt: skip
