"""Splicing of time laws: cutting them at times, and joining the parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.time_law.motion_law import MotionLaw


@dataclass(frozen=True, eq=False)
class Nodes:
    """A stretch of a motion: times (K,) s, stations (K,) m and speeds (K,) m/s at its nodes, cubic in between.

    accelerations and jerks (K − 1,) just after each node but the last.
    """

    times: Floats
    stations: Floats
    speeds: Floats
    accelerations: Floats
    jerks: Floats

    @classmethod
    def through(cls, times: Floats, stations: Floats, speeds: Floats) -> Nodes:
        """Return the cubics that have these stations and speeds at the nodes."""
        h, rise = np.diff(times), np.diff(stations)
        a = (6.0 * rise / h - 4.0 * speeds[:-1] - 2.0 * speeds[1:]) / h
        j = (6.0 * (speeds[:-1] + speeds[1:]) - 12.0 * rise / h) / h**2
        return cls(times, stations, speeds, a, j)

    @classmethod
    def of(cls, law: MotionLaw, start: float = 0.0, end: float = np.inf) -> Nodes:
        """Return a law between two of its times, seconds."""
        end = min(end, law.duration)
        inner = law.times[(law.times > start) & (law.times < end)]
        times = np.concatenate([[start], inner, [end]])
        return cls(times, law(times), law(times, 1), law(times[:-1], 2), _jerks(law, times[:-1]))

    @classmethod
    def resting(cls, seconds: float, station: float) -> Nodes:
        """Return standing still."""
        still = np.zeros(2)
        return cls(np.array([0.0, seconds]), np.full(2, station), still, still[:1], still[:1])

    def shifted(self, station: float) -> Nodes:
        """Return the same motion `station` metres further along."""
        return Nodes(self.times, self.stations + station, self.speeds, self.accelerations, self.jerks)


def joined(parts: Sequence[Nodes]) -> MotionLaw:
    """Return one law, from time 0, of parts that follow each other; each begins where the one before ends."""
    parts = [part for part in parts if part.times[-1] > part.times[0]]
    clock = np.cumsum([0.0, *(part.times[-1] - part.times[0] for part in parts)])
    # The next part says better than the last how its own first node is.
    heads = [slice(None, -1)] * (len(parts) - 1) + [slice(None)]
    return MotionLaw(
        np.concatenate([t + p.times[h] - p.times[0] for t, p, h in zip(clock, parts, heads, strict=False)]),
        np.concatenate([p.stations[h] for p, h in zip(parts, heads, strict=True)]),
        np.concatenate([p.speeds[h] for p, h in zip(parts, heads, strict=True)]),
        np.concatenate([p.accelerations for p in parts]),
        np.concatenate([p.jerks for p in parts]),
    )


def times_at(law: MotionLaw, stations: Floats) -> Floats:
    """Return the times (n,) at which a law that does not stand still passes stations (n,)."""
    s = np.clip(stations, 0.0, law.length)
    k = np.clip(np.searchsorted(law.stations, s, side="right") - 1, 0, len(law.jerks) - 1)
    way, longest = s - law.stations[k], np.diff(law.times)[k]
    v, a, j = law.speeds[k], law.accelerations[k], law.jerks[k]
    # Without jerk this is the answer; with it, Newton within a bracket starts from here.
    root = v + np.sqrt(np.maximum(v * v + 2.0 * a * way, 0.0))
    tau = np.clip(np.where(root > 0.0, 2.0 * way / np.where(root > 0.0, root, 1.0), 0.5 * longest), 0.0, longest)
    low, high = np.zeros_like(tau), longest.copy()
    for _ in range(60):
        off = tau * (v + tau * (0.5 * a + tau * j / 6.0)) - way
        speed = v + tau * (a + 0.5 * tau * j)
        low, high = np.where(off < 0.0, tau, low), np.where(off < 0.0, high, tau)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = tau - off / speed
        step = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high)) - tau
        tau = tau + step
        if (np.abs(step) <= 1e-16 * law.duration).all():
            break
    return law.times[k] + tau


def _jerks(law: MotionLaw, times: Floats) -> Floats:
    return law.jerks[np.clip(np.searchsorted(law.times, times, side="right") - 1, 0, len(law.jerks) - 1)]
