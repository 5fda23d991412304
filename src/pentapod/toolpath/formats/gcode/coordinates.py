"""Coordinates of a program: from its words to the tip and the tool axis against the part."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from pentapod.base.errors import ToolpathError
from pentapod.toolpath.formats.gcode.arcs import xyz
from pentapod.toolpath.formats.gcode.frames import Frame
from pentapod.toolpath.formats.rotary import LETTERS, RotaryAxes, Vector

LINEAR = ("X", "Y", "Z")
_ORIGIN: Vector = (0.0, 0.0, 0.0)


class Pose(NamedTuple):
    """Tip, millimetres, and tool axis against the part."""

    tip: Vector
    axis: Vector


@dataclass
class Coordinates:
    """What the program's coordinates mean. Millimetres and degrees.

    chain: the rotary axes of the machine; named: letters of those in the file; described: the user lists them. tcp:
    tool centre point programming is on. place: coordinates by letter, the linear ones only where they are known. frame:
    a turned frame; swivelled: the controller knows how the machine stands in it (G68.2). fixed: the tool axis where it
    is not given by rotary words (G53.1, vectors). lost: rotary axes whose angle is not known, as the controller found
    it (G53.1). shift: of G52 and G92. system: G54 and the like; offsets: where the file gives them. first_system: the
    one in which the tool moved first, and its offset then.
    """

    chain: RotaryAxes
    named: frozenset[str] = frozenset()
    described: bool = False
    tcp: bool = False
    place: dict[str, float] = field(default_factory=lambda: dict.fromkeys(LETTERS, 0.0))
    frame: Frame | None = None
    swivelled: bool = False
    fixed: Vector | None = None
    lost: frozenset[str] = frozenset()
    shift: Vector = _ORIGIN
    system: str = "G54"
    offsets: dict[str, Vector] = field(default_factory=dict[str, Vector])
    first_system: tuple[str, Vector | None] | None = None

    @property
    def unknown(self) -> str:
        """The linear axes whose place is not known, such as "X, Y"."""
        return ", ".join(letter for letter in LINEAR if letter not in self.place)

    @property
    def tilted(self) -> bool:
        """Whether the tip depends on the machine: a rotary axis is turned, or the tool was turned by G53.1."""
        return self._tilted_at(self.place)

    def _tilted_at(self, place: Mapping[str, float]) -> bool:
        return self.fixed is not None or any(place[letter] % 360.0 for letter in LETTERS)

    def forget(self, letters: Sequence[str] = LINEAR) -> None:
        """Take the place along some axes as unknown."""
        for letter in letters:
            self.place.pop(letter, None)

    def pose(self, place: Mapping[str, float]) -> Pose | None:
        """Return the pose against the part; None where that depends on the machine, or a coordinate is not known."""
        if "X" not in place or "Y" not in place or "Z" not in place or (base := self._base()) is None:
            return None
        if self.lost and self.fixed is None:
            return None
        point: Vector | None = xyz(place)
        if self.frame is not None:
            point = self.frame.outside(point)
        if not (self.tcp or self.swivelled) and self._tilted_at(place):
            point = None if self.fixed is not None else self.chain.tip(point, place)
        if point is None:
            return None
        return Pose((point[0] + base[0], point[1] + base[1], point[2] + base[2]), self.fixed or self.chain.axis(place))

    def why_unknown(self) -> tuple[str, str]:
        """Return why there is no pose, and the remedy."""
        if self._base() is None and self.first_system is not None:
            what = f"moves in {self.system} after moves in {self.first_system[0]}: the file does not say how far apart"
            return what, "export a file for each of them, or write their offsets into the file (G10 L2)"
        if self.unknown:
            return (
                f"{self.unknown} {'are' if ',' in self.unknown else 'is'} not known here",
                "give all axes before the first cut and after each home position",
            )
        if self.lost and self.fixed is None:
            return f"the angle of {', '.join(sorted(self.lost))} is not known after G53.1", "give all rotary axes"
        if self.fixed is not None:
            what = "the tool is turned, and neither a turned frame nor tool centre point programming is on"
            return what, "cut in the frame of G53.1, or with G43.4 or TRAORI"
        keys = "rotary_axes, with rotary_centre_mm (table) or pivot_mm (head),"
        if self.described:
            moved = [axis for axis in self.chain.axes if self.place[axis.letter] % 360.0]
            lacks_pivot = self.chain.pivot is None and not all(axis.in_table for axis in moved)
            lacks_centre = self.chain.centre is None and any(axis.in_table for axis in moved)
            keys = " and ".join(["rotary_centre_mm"] * lacks_centre + ["pivot_mm"] * lacks_pivot)
        return (
            "a rotary axis is turned without tool centre point programming: the place depends on the machine",
            f"give {keys} in [toolpath], or export with G43.4 or TRAORI",
        )

    def use(self) -> None:
        """Take the system of coordinates as that of the part, if it is the first in which something moves."""
        if self.first_system is None:
            self.first_system = (self.system, self.offsets.get(self.system))

    def _base(self) -> Vector | None:
        """Return what is added to points: shifts, and the distance from the first system; None if it is not known."""
        offset = self.offsets.get(self.system)
        if self.first_system is None or self.first_system == (self.system, offset):
            return self.shift
        first = self.first_system[1]
        if offset is None or first is None:
            return None
        a, b, c = (s + new - old for s, new, old in zip(self.shift, offset, first, strict=True))
        return a, b, c

    def set_tcp(self, *, on: bool) -> bool:
        """Switch tool centre point programming; return whether that changes what the coordinates mean."""
        changed = on != self.tcp and self.tilted and not self.swivelled
        self.tcp = on
        if changed:
            self.forget()
        return changed

    def set_frame(self, frame: Frame | None, *, swivelled: bool, oriented: bool = False) -> None:
        """Turn the frame, or turn it off; the tool stays where it is. oriented: the tool turns along."""
        before = self.pose(self.place)
        self.frame, self.swivelled = frame, swivelled
        if oriented and frame is not None:
            self.fixed = frame.axis if math.dist(frame.axis, (0.0, 0.0, 1.0)) > 1e-12 else None
            self.lost = self.named if self.fixed is not None else frozenset()
            self.place.update(dict.fromkeys(LETTERS, 0.0))
        base = self._base()
        upright = not oriented and (self.tcp or swivelled or not self.tilted)
        if before is None or base is None or not upright:
            self.forget()
            return
        point = [a - b for a, b in zip(before.tip, base, strict=True)]
        self.place.update(zip(LINEAR, frame.inside(point) if frame is not None else point, strict=True))

    def set_shift(self, shift: Vector) -> None:
        """Shift the coordinates; the tool stays where it is. Raises ToolpathError within a turned frame."""
        if self.frame is not None:
            raise ToolpathError("a shift within a turned frame", remedy="export it applied")
        for letter, old, new in zip(LINEAR, self.shift, shift, strict=True):
            if letter in self.place:
                self.place[letter] += old - new
        self.shift = shift

    def set_offset(self, system: str, offset: Vector) -> None:
        """Set where a system of coordinates is; the tool stays where it is."""
        old = self.offsets.get(system)
        self.offsets[system] = offset
        if system == self.system and old != offset:
            for letter, a, b in zip(LINEAR, old or offset, offset, strict=True):
                if letter in self.place:
                    self.place[letter] += a - b

    def set_system(self, system: str) -> None:
        """Change to another system of coordinates; the place in it is known only where both offsets are."""
        if system == self.system:
            return
        old, new = self.offsets.get(self.system), self.offsets.get(system)
        self.system = system
        if old is None or new is None:
            self.forget()
            return
        for letter, a, b in zip(LINEAR, old, new, strict=True):
            if letter in self.place:
                self.place[letter] += a - b
