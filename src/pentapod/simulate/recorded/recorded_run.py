"""RecordedRun: a recorded run compared with its program: contour, legs, drift, pace and forces of the drives."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.values import Value
from pentapod.program.posts.motion import lengths_at
from pentapod.simulate.measures import Measure, measured_dict, measured_lines
from pentapod.simulate.recorded.alignment import Alignment
from pentapod.simulate.recorded.leg_errors import LegErrors
from pentapod.simulate.recorded.run_log import RunLog
from pentapod.simulate.reference import Reference

STANDING, HELD_S, SPAN_S = 0.02, 0.1, 0.25
"""Pace below which a run is on hold, seconds that a hold lasts at least, seconds over which the pace is measured."""


@dataclass(frozen=True)
class Hold(Value):
    """A feed hold: when it began in the log, where in the program, and how long it lasted, seconds."""

    time: float
    program_time: float
    duration: float


@dataclass(frozen=True, eq=False)
class RecordedRun(Value):
    """A log, as readings of the legs, with its program. times (n,), seconds of the log: of the rows that are compared.

    measures: at these rows. legs (n, n_legs): errors of the legs in metres; in time, or across the path where the run
    was held or overridden. expected, measured (n, n_legs): forces of the drives, newtons; None where they are not
    known. cutting (n,): rows on cuts; none where the toolpath is not known. start: time of the program's first row in
    the log, None as in `Alignment`.
    """

    log: RunLog
    reference: Reference
    alignment: Alignment
    start: float | None
    measures: tuple[Measure, ...]
    legs: Floats
    errors: LegErrors
    expected: Floats | None
    measured: Floats | None
    cutting: Bools

    @property
    def times(self) -> Floats:
        """Times (n,) of the rows that are compared, seconds of the log."""
        return self.log.times[self.alignment.first : self.alignment.last]

    @property
    def covered(self) -> tuple[float, float]:
        """First and last time of the program that the log holds, seconds."""
        places = self.alignment.places[[0, -1]] * self.reference.program.period
        return float(places[0]), float(places[1])

    @property
    def complete(self) -> bool:
        """Whether the log holds the whole program, up to ends that hardly move."""
        first, last = self.covered
        ends = lengths_at(self.reference.program, np.array([0.0, first, last, self.reference.program.duration]))
        return bool(np.abs(ends[[0, 2]] - ends[[1, 3]]).max() < 1e-4)

    @cached_property
    def pace(self) -> Floats:
        """Seconds of the program in a second of the log, at each row (n,)."""
        times, places = self.times, self.alignment.places * self.reference.program.period
        half = 0.5 * SPAN_S
        ends = [np.clip(times + side, times[0], times[-1]) for side in (-half, half)]
        early, late = (np.interp(end, times, places) for end in ends)
        return (late - early) / (ends[1] - ends[0])

    @cached_property
    def holds(self) -> tuple[Hold, ...]:
        """Where the run stood still and its program moves."""
        moving = np.zeros(len(self.times), dtype=bool)
        moving[self.alignment.moving] = True
        steps = np.diff(self.alignment.places, prepend=self.alignment.places[0])
        late = np.diff(self.times, prepend=self.times[0])
        still = moving & (steps * self.reference.program.period <= STANDING * late)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]])))
        found = list[Hold]()
        for a, b in edges.reshape(-1, 2):
            duration = float(self.times[b - 1] - self.times[a])
            if duration >= HELD_S:
                place = float(self.alignment.places[a]) * self.reference.program.period
                found.append(Hold(float(self.times[a]), place, duration))
        return tuple(found)

    def largest(self, name: str) -> float:
        """Return the largest value of a measure, on cuts where they are known."""
        measure = next(measure for measure in self.measures if measure.name == name)
        return float(measure.values[self.cutting].max()) if self.cutting.any() else measure.largest

    def to_dict(self) -> dict[str, Any]:
        """Return all figures, with units in their names."""
        pace = self.pace[self.alignment.moving]
        first, last = self.covered
        forces = {
            name: {"least": f.min(axis=0).tolist(), "most": f.max(axis=0).tolist(), "rms": _rms(f).tolist()}
            for name, f in (("expected_forces_n", self.expected), ("measured_forces_n", self.measured))
            if f is not None
        }
        return {
            "rows": len(self.times),
            "lost_rows": self.log.lost,
            "period_ms": round(1e3 * self.log.period, 9),
            "program_s": [first, last],
            "complete": self.complete,
            "in_time": self.start is not None,
            "start_s": self.start,
            "pace": {"median": float(np.median(pace)), "least": float(pace.min()), "most": float(pace.max())},
            "holds": [
                {"time_s": h.time, "program_s": h.program_time, "duration_s": h.duration} for h in self.holds
            ],
            **measured_dict(self.measures, self.times, self.cutting),
            "legs": self.errors.to_dict(),
            **forces,
        }  # fmt: skip

    def lines(self) -> list[str]:
        """Return all figures as text, a line for each."""
        (first, last), pace = self.covered, self.pace[self.alignment.moving]
        duration = self.reference.program.duration
        lines = [f"  {len(self.times)} rows of {1e3 * self.log.period:g} ms, {self.log.lost} lost"]
        part = "" if self.complete else f": only {first:.3f} to {last:.3f} s of it"
        lines[0] += f"; the program of {duration:.3f} s{part}"
        if self.start is not None:
            lines.append(f"  at the program's pace, from {self.start:.4f} s of the log on")
        else:
            low, most = float(pace.min()), float(pace.max())
            lines.append(f"  held or overridden: pace {low:.2f} to {most:.2f}, median {np.median(pace):.2f}")
            lines.append("  errors are across the path; not compared in time")
        lines += [
            f"  hold at {h.time:.3f} s of the log, {h.program_time:.3f} s of the program, for {h.duration:.3f} s"
            for h in self.holds
        ]
        lines += measured_lines(self.measures, self.times, self.cutting)
        lines += self.errors.lines()
        for name, forces in (("forces expected", self.expected), ("forces measured", self.measured)):
            if forces is not None:
                ends = (f"{a:.0f} to {b:.0f}" for a, b in zip(forces.min(axis=0), forces.max(axis=0), strict=True))
                lines.append(f"  {name}, N: {', '.join(ends)}")
        return lines


def _rms(values: Floats) -> Floats:
    return np.sqrt(np.square(values).mean(axis=0))
