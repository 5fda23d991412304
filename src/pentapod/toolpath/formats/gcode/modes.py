"""Modal state of a program: units, planes, feeds, cycles."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.toolpath.formats.gcode.language.vocabulary import Dialect

_UNITS = {20.0: 25.4, 21.0: 1.0, 70.0: 25.4, 71.0: 1.0, 700.0: 25.4, 710.0: 1.0}
_INCH_LENGTHS = 70.0
_PATH = frozenset({60.0, 61.0, 61.1, 64.0, 64.1, 641.0, 642.0, 643.0, 644.0, 645.0})
_WINDOWS = frozenset({601.0, 602.0, 603.0, 450.0, 451.0})
CYCLES = frozenset({73.0, 81.0, 82.0, 83.0, 85.0, 86.0, 89.0})
_PER_MINUTE, _INVERSE, _PER_TURN = 94.0, 93.0, 95.0


@dataclass
class Modes:
    """What holds until it is changed. scale: millimetres in the unit; feed: as in the file; speed: of the spindle.

    lengths_only: the scale is not that of the feed (G70 of Sinumerik). cycle: the drilling cycle that is on; to_start:
    it goes back to where it began (G98), not to R (G99). stopping: exact stops at all points.
    """

    dialect: Dialect
    scale: float | None = None
    lengths_only: bool = False
    absolute: bool = True
    absolute_centres: bool = False
    motion: float | None = None
    plane: float = 17.0
    feed_mode: float = _PER_MINUTE
    feed: float | None = None
    speed: float | None = None
    stopping: bool = False
    cycle: float | None = None
    to_start: bool = True

    @property
    def inverse(self) -> bool:
        """Whether feeds are times: G93."""
        return self.feed_mode == _INVERSE

    @property
    def per_turn(self) -> bool:
        """Whether feeds are per turn of the spindle: G95."""
        return self.feed_mode == _PER_TURN

    def take(self, code: float) -> bool:
        """Change the mode that a G code sets; False where it sets none."""
        if code in (0.0, 1.0, 2.0, 3.0):
            self.motion, self.cycle = code, None
        elif code in CYCLES:
            self.cycle = code
        elif code == 80.0:
            self.cycle = None
        elif code in (17.0, 18.0, 19.0):
            self.plane = code
        elif code in _UNITS and (self.dialect.equals or code < 100.0):
            self.scale, self.lengths_only = _UNITS[code], self.dialect.equals and code == _INCH_LENGTHS
        elif code in (_INVERSE, _PER_MINUTE, _PER_TURN):
            self.feed = self.feed if code == self.feed_mode else None
            self.feed_mode = code
        else:
            return self._take_rest(code)
        return True

    def _take_rest(self, code: float) -> bool:
        if code in (90.0, 91.0):
            self.absolute = code == 90.0
        elif code in (90.1, 91.1):
            self.absolute_centres = code == 90.1
        elif code in (98.0, 99.0):
            self.to_start = code == 98.0
        elif code in _PATH:
            self.stopping = code == self.dialect.exact_stop
        else:
            return code in _WINDOWS and self.dialect.equals
        return True
