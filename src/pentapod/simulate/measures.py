"""Tracking errors of a simulated machine at each row of a program, contour errors among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, frozen, set_frozen
from pentapod.base.values import Value
from pentapod.geometry.directions import angle_between
from pentapod.simulate.reference import Played, Reference
from pentapod.toolpath.toolpath import SegmentKind, Toolpath
from pentapod.verify.replay.free_space import PosedPolyline
from pentapod.verify.replay.path_matching import PathMatch, match

TO_TOOLPATH = "toolpath deviation"
"""Name of the measure that the tolerance of a job bounds in its verdict."""


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
    """A simulated motion compared with its program and toolpath.

    tolerance: metres, of the path, for matching motion and toolpath. more: further measures. time_constants: how late
    the tool may be, in time constants of the position loop, when its nearest point on the path is sought.
    """

    played: Played
    reference: Reference
    toolpath: Toolpath
    tolerance: float
    more: tuple[Measure, ...] = ()
    time_constants: float = 3.0

    @cached_property
    def measures(self) -> tuple[Measure, ...]:
        """Contour errors, errors with lag, the deviation from the toolpath as the verdict measures it, leg errors."""
        played, reference = self.played, self.reference
        rows, drives = len(played.tips), reference.machine.drives
        late = self.time_constants / float(drives.position_gain.min()) + drives.dead_time
        window = 2 * max(4, round(late / reference.program.period))
        due = 2 * np.arange(rows)
        contour, turned = contour_errors(
            played.tips, played.directions, reference.tips, reference.directions, due, min(window, 2 * rows)
        )
        off = np.linalg.norm(played.tips - reference.tips[::2], axis=1)
        twist = angle_between(played.directions, reference.directions[::2])
        return (
            Measure("contour error", "mm", 1e3 * contour, "tip to the programmed path, at any time"),
            Measure("axis contour error", "deg", np.degrees(turned), "axis to the programmed one at that point"),
            Measure("tip error", "mm", 1e3 * off, "tip to where it is due at that time"),
            Measure("axis error", "deg", np.degrees(twist), "axis to the one due at that time"),
            Measure(TO_TOOLPATH, "mm", 1e3 * self._match.distances, "tip (or tilt centre) to the toolpath"),
            Measure("leg error", "mm", 1e3 * np.abs(played.legs - reference.program.legs).max(axis=1), "of any leg"),
            *self.more,
        )

    @cached_property
    def cutting(self) -> Bools:
        """Whether each row (N,) belongs to a cut of the toolpath."""
        return on_cuts(self._match, self.toolpath)

    def to_dict(self) -> dict[str, Any]:
        """Return the measures as JSON takes them, by name with unit."""
        return measured_dict(self.measures, self.reference.program.times, self.cutting)

    def lines(self) -> list[str]:
        """Return the measures as text, a line for each."""
        lines = measured_lines(self.measures, self.reference.program.times, self.cutting)
        bounded = [measure.name for measure in self.measures].index(TO_TOOLPATH)
        beyond = self.measures[bounded].largest > 1e3 * self.tolerance
        lines[bounded] += f" ({'beyond' if beyond else 'within'} the tolerance of the job: {1e3 * self.tolerance:g} mm)"
        return lines

    @cached_property
    def _match(self) -> PathMatch:
        home = self.reference.program.placement.inverse()
        axes = home.rotate(-self.played.directions)
        course = PosedPolyline(home.apply(self.played.tips) + self.toolpath.tilt_centre * axes, axes)
        return match(course, PosedPolyline(self.toolpath.tilt_centres, self.toolpath.axes), self.tolerance)


def on_cuts(matched: PathMatch, toolpath: Toolpath) -> Bools:
    """Return whether each sample (M,) of a motion that was matched with a toolpath belongs to a cut."""
    kinds = np.array([segment.kind == SegmentKind.CUT for segment in toolpath.segments])
    intervals = np.minimum(matched.places.astype(np.intp), len(toolpath) - 2)
    return kinds[toolpath.segment_of_interval[intervals]]


def measured_dict(measures: Sequence[Measure], times: Floats, cutting: Bools) -> dict[str, Any]:
    """Return measures at rows with times (N,) as JSON takes them, by name with unit. cutting (N,): rows on cuts."""
    return {
        measure.key: {
            "largest": measure.largest,
            "rms": measure.rms,
            "time_s": round(float(times[measure.row]), 9),
            **({"largest_on_cuts": float(measure.values[cutting].max())} if cutting.any() else {}),
        }
        for measure in measures
    }


def _figure(value: float) -> str:
    """Return a number in two digits, and all its digits before the point."""
    return f"{value:.2g}" if value < 100.0 else f"{value:.0f}"


def measured_lines(measures: Sequence[Measure], times: Floats, cutting: Bools) -> list[str]:
    """Return measures as text, a line for each; see `measured_dict`."""
    lines: list[str] = []
    for measure in measures:
        line = f"  {measure.name + ':':<20} largest {measure.largest:.3g} {measure.unit}"
        line += f" at {times[measure.row]:.3f} s, rms {_figure(measure.rms)} {measure.unit}"
        if cutting.any():
            line += f"; on cuts at most {measure.values[cutting].max():.3g} {measure.unit}"
        lines.append(line)
    return lines


def contour_errors(
    tips: Floats, directions: Floats, path: Floats, path_directions: Floats, due: Ints, window: int
) -> tuple[Floats, Floats]:
    """Return contour errors: distances (N,), metres, from tips (N, 3) to a path (M, 3), and angles (N,), radians.

    A tip is compared with the path's chords at most `window` before or after the sample due (N,) at its time, so that
    neighbouring passes do not count. The angle is that between the directions (N, 3) and (M, 3) at the nearest point.
    """
    last = len(path) - 2
    best, at = np.full(len(tips), np.inf), np.zeros(len(tips))
    for shift in sorted(range(-window, window), key=abs, reverse=True):
        k = np.clip(due + shift, 0, last)
        step, offset = path[k + 1] - path[k], tips - path[k]
        square = np.einsum("ij,ij->i", step, step)
        along = np.clip(np.einsum("ij,ij->i", step, offset) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
        offset -= along[:, None] * step
        distance = np.einsum("ij,ij->i", offset, offset)
        # Where the tool stands several points are equally near: the one due counts, which comes last.
        nearer = distance <= best
        best, at = np.where(nearer, distance, best), np.where(nearer, k + along, at)
    k = np.minimum(at.astype(np.intp), last)
    f = (at - k)[:, None]
    wanted = (1.0 - f) * path_directions[k] + f * path_directions[k + 1]
    return np.sqrt(best), angle_between(directions, wanted)
