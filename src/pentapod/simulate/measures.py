"""Measures: how far a simulated machine was off, moment by moment."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, frozen, set_frozen
from pentapod.base.values import Value
from pentapod.geometry.directions import angle_between
from pentapod.simulate.contour import contour_errors
from pentapod.simulate.played import Played
from pentapod.simulate.reference import Reference
from pentapod.toolpath.toolpath import SegmentKind, Toolpath
from pentapod.verify.replay.free_space import PosedPolyline
from pentapod.verify.replay.path_matching import PathMatch, match

_MM = 1e3
_TIME_CONSTANTS = 3.0  # of the position loop: so much later than due the tool is looked for


@dataclass(frozen=True, eq=False)
class Measure(Value):
    """One quantity at each row of the program. values (N,) in `unit`, as in files; none negative."""

    name: str
    unit: str
    values: Floats
    about: str

    def __post_init__(self) -> None:
        set_frozen(self, values=frozen(self.values, "values", (None,)))

    @property
    def largest(self) -> float:
        """The largest value."""
        return float(self.values.max())

    @property
    def rms(self) -> float:
        """The root of the mean square."""
        return float(np.sqrt(np.mean(np.square(self.values))))

    @property
    def row(self) -> int:
        """The row with the largest value."""
        return int(np.argmax(self.values))

    @property
    def key(self) -> str:
        """The name in JSON: words joined, the unit last."""
        return f"{self.name} {self.unit}".replace(" ", "_")


@dataclass(frozen=True, eq=False)
class Tracking(Value):
    """A program as it was played, beside what it asks and the toolpath behind it.

    tolerance: metres, of the path; it tells the search how near to look. more: what else was measured.
    """

    played: Played
    reference: Reference
    toolpath: Toolpath
    tolerance: float
    more: tuple[Measure, ...] = ()

    @cached_property
    def measures(self) -> tuple[Measure, ...]:
        """Contour error, axis error, lag, and what the verdict would measure: deviation from the toolpath."""
        played, reference = self.played, self.reference
        rows, drives = len(played.tips), reference.machine.drives
        late = _TIME_CONSTANTS / float(drives.position_gain.min()) + drives.dead_time
        window = 2 * max(4, round(late / reference.program.period))
        due = 2 * np.arange(rows)
        contour, turned = contour_errors(
            played.tips, played.directions, reference.tips, reference.directions, due, min(window, 2 * rows)
        )
        off = np.linalg.norm(played.tips - reference.tips[::2], axis=1)
        twist = angle_between(played.directions, reference.directions[::2])
        return (
            Measure("contour error", "mm", _MM * contour, "tip to the programmed path, whenever it gets there"),
            Measure("axis contour error", "deg", np.degrees(turned), "axis to the programmed one at that place"),
            Measure("tip error", "mm", _MM * off, "tip to where it is due at that moment"),
            Measure("axis error", "deg", np.degrees(twist), "axis to the one due at that moment"),
            Measure(
                "toolpath deviation",
                "mm",
                _MM * self._match.distances,
                "tip (or tilt centre) to the toolpath, as verified",
            ),
            Measure("leg error", "mm", _MM * np.abs(played.legs - reference.program.legs).max(axis=1), "of any leg"),
            *self.more,
        )

    @cached_property
    def cutting(self) -> Bools:
        """Whether each row (N,) belongs to a cut of the toolpath."""
        kinds = np.array([segment.kind == SegmentKind.CUT for segment in self.toolpath.segments])
        intervals = np.minimum(self._match.places.astype(np.intp), len(self.toolpath) - 2)
        return kinds[self.toolpath.segment_of_interval[intervals]]

    def to_dict(self) -> dict[str, Any]:
        """Return the measures as JSON takes them, by name with unit."""
        period = self.reference.program.period
        return {
            measure.key: {
                "largest": measure.largest,
                "rms": measure.rms,
                "time_s": round(measure.row * period, 9),
                **({"largest_on_cuts": float(measure.values[self.cutting].max())} if self.cutting.any() else {}),
            }
            for measure in self.measures
        }

    def lines(self) -> list[str]:
        """Return the measures as text, a line for each."""
        period = self.reference.program.period
        lines: list[str] = []
        for measure in self.measures:
            line = f"  {measure.name + ':':<20} largest {measure.largest:.3g} {measure.unit}"
            line += f" at {measure.row * period:.3f} s, rms {measure.rms:.2g} {measure.unit}"
            if self.cutting.any():
                line += f"; on cuts at most {measure.values[self.cutting].max():.3g} {measure.unit}"
            lines.append(line)
        return lines

    @cached_property
    def _match(self) -> PathMatch:
        home = self.reference.program.placement.inverse()
        axes = home.rotate(-self.played.directions)
        course = PosedPolyline(home.apply(self.played.tips) + self.toolpath.tilt_centre * axes, axes)
        return match(course, PosedPolyline(self.toolpath.tilt_centres, self.toolpath.axes), self.tolerance)
