"""Splicing of time laws: cutting them at times, and joining the segments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.time_law.motion_law import MotionLaw


@dataclass(frozen=True, eq=False)
class LawSegment:
    """A time interval of a law: cubics between times (K,) s, with stations (K,) m and speeds (K,) m/s there.

    accelerations and jerks (K − 1,) just after each time but the last.
    """

    times: Floats
    stations: Floats
    speeds: Floats
    accelerations: Floats
    jerks: Floats

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.times[-1] - self.times[0])

    @classmethod
    def through(cls, times: Floats, stations: Floats, speeds: Floats) -> LawSegment:
        """Return the Hermite cubics through these stations and speeds."""
        h, rise = np.diff(times), np.diff(stations)
        a = (6.0 * rise / h - 4.0 * speeds[:-1] - 2.0 * speeds[1:]) / h
        j = (6.0 * (speeds[:-1] + speeds[1:]) - 12.0 * rise / h) / h**2
        return cls(times, stations, speeds, a, j)

    @classmethod
    def of(cls, law: MotionLaw, start: float = 0.0, end: float = np.inf) -> LawSegment:
        """Return a law between two of its times, seconds."""
        end = min(end, law.duration)
        inner = law.times[(law.times > start) & (law.times < end)]
        times = np.concatenate([[start], inner, [end]])
        stage = np.clip(np.searchsorted(law.times, times[:-1], side="right") - 1, 0, len(law.jerks) - 1)
        return cls(times, law(times), law(times, 1), law(times[:-1], 2), law.jerks[stage])

    @classmethod
    def at_rest(cls, seconds: float, station: float) -> LawSegment:
        """Return a standstill."""
        still = np.zeros(2)
        return cls(np.array([0.0, seconds]), np.full(2, station), still, still[:1], still[:1])

    def shifted(self, distance: float) -> LawSegment:
        """Return the same motion `distance` metres further along."""
        return LawSegment(self.times, self.stations + distance, self.speeds, self.accelerations, self.jerks)


def spliced(segments: Sequence[LawSegment]) -> MotionLaw:
    """Return one law, from time 0, of segments of which each begins at the station where the one before ends."""
    parts = [part for part in segments if part.times[-1] > part.times[0]]
    starts = np.cumsum([0.0, *(part.duration for part in parts)])
    # Where two segments meet the node of the later one is kept.
    heads = [slice(None, -1)] * (len(parts) - 1) + [slice(None)]
    return MotionLaw(
        np.concatenate([t + p.times[h] - p.times[0] for t, p, h in zip(starts, parts, heads, strict=False)]),
        np.concatenate([p.stations[h] for p, h in zip(parts, heads, strict=True)]),
        np.concatenate([p.speeds[h] for p, h in zip(parts, heads, strict=True)]),
        np.concatenate([p.accelerations for p in parts]),
        np.concatenate([p.jerks for p in parts]),
    )


def times_at(law: MotionLaw, stations: Floats) -> Floats:
    """Return the times (n,) at which a law without standstill passes stations (n,): Newton within a bracket."""
    s = np.clip(stations, 0.0, law.length)
    k = np.clip(np.searchsorted(law.stations, s, side="right") - 1, 0, len(law.jerks) - 1)
    distance, longest = s - law.stations[k], np.diff(law.times)[k]
    v, a, j = law.speeds[k], law.accelerations[k], law.jerks[k]
    # Start from the solution without jerk.
    root = v + np.sqrt(np.maximum(v * v + 2.0 * a * distance, 0.0))
    tau = np.clip(np.where(root > 0.0, 2.0 * distance / np.where(root > 0.0, root, 1.0), 0.5 * longest), 0.0, longest)
    low, high = np.zeros_like(tau), longest.copy()
    for _ in range(60):
        off = tau * (v + tau * (0.5 * a + tau * j / 6.0)) - distance
        speed = v + tau * (a + 0.5 * tau * j)
        low, high = np.where(off < 0.0, tau, low), np.where(off < 0.0, high, tau)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = tau - off / speed
        step = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high)) - tau
        tau = tau + step
        if (np.abs(step) <= 1e-16 * law.duration).all():
            break
    return law.times[k] + tau
