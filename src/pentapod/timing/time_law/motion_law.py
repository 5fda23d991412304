"""MotionLaw: arc length as a function of time, a piecewise cubic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.values import Value


@dataclass(frozen=True, eq=False)
class MotionLaw(Value):
    """Piecewise cubic s(t): s and ṡ continuous, ṡ ≥ 0.

    times (K,) seconds from 0; stations (K,) metres; speeds (K,) m/s; accelerations (K - 1,) m/s² just after each knot;
    jerks (K - 1,) m/s³ between knots. With jerk 0, as in time-optimal laws, ṡ² is linear in s between knots.
    """

    summary = ("duration",)

    times: Floats
    stations: Floats
    speeds: Floats
    accelerations: Floats
    jerks: Floats

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            set_frozen(self, **{name: frozen(getattr(self, name), name, (None,))})

    @classmethod
    def from_profile(cls, stations: Floats, squared_speeds: Floats) -> MotionLaw:
        """Return the law with ṡ² = `squared_speeds` (K,) at `stations` (K,) and constant s̈ between them.

        A stage lasts 2 Δs / (ṡ_a + ṡ_b), also where it starts or ends at rest; at least one of its ends must move.
        """
        speeds = np.sqrt(squared_speeds)
        steps = 2.0 * np.diff(stations) / (speeds[:-1] + speeds[1:])
        times = np.concatenate([[0.0], np.cumsum(steps)])
        return cls(times, stations, speeds, np.diff(speeds) / steps, np.zeros(len(steps)))

    @classmethod
    def through(cls, stations: Floats, squared_speeds: Floats, slopes: Floats) -> MotionLaw:
        """Return the law with ṡ² = `squared_speeds` (K,) and d(ṡ²)/ds = `slopes` (K,) at `stations` (K,).

        In each stage two cubics of equal duration match station, speed and acceleration at both ends, so acceleration
        is continuous. A ramp of constant jerk from or to a rest of slope 0 stays one. At least one end of each stage
        must move.
        """
        v, a, ds = np.sqrt(squared_speeds), 0.5 * slopes, np.diff(stations)
        gain, total = np.diff(a), v[:-1] + v[1:]
        half = 2.0 * ds / (total + np.sqrt(np.maximum(total**2 - 4.0 / 3.0 * gain * ds, 0.0)))
        early = (np.diff(v) - 2.0 * a[:-1] * half) / half**2 - 0.5 * gain / half
        late = gain / half - early
        middle_a = a[:-1] + early * half
        middle_v = v[:-1] + half * (a[:-1] + 0.5 * early * half)
        middle_s = stations[:-1] + half * (v[:-1] + half * (0.5 * a[:-1] + early * half / 6.0))
        times = np.concatenate([[0.0], np.cumsum(np.repeat(half, 2))])
        return cls(
            times,
            np.append(np.column_stack([stations[:-1], middle_s]), stations[-1]),
            np.append(np.column_stack([v[:-1], np.maximum(middle_v, 0.0)]), v[-1]),
            np.column_stack([a[:-1], middle_a]).ravel(),
            np.column_stack([early, late]).ravel(),
        )

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.times[-1])

    @property
    def length(self) -> float:
        """Metres."""
        return float(self.stations[-1])

    def __call__(self, t: ArrayLike, order: int = 0) -> Floats:
        """Return s, ṡ or s̈ (order 0, 1, 2) at times (n,); at rest before the start and after the end."""
        given = np.asarray(t, dtype=np.float64)
        time = np.clip(given, 0.0, self.duration)
        k = np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, len(self.jerks) - 1)
        tau, a, j = time - self.times[k], self.accelerations[k], self.jerks[k]
        if order == 2:
            return np.where(given == time, a + j * tau, 0.0)
        if order == 1:
            speed = np.maximum(self.speeds[k] + tau * (a + tau * j / 2.0), 0.0)
            return np.where(time < self.duration, speed, self.speeds[-1])
        s = self.stations[k] + tau * (self.speeds[k] + tau * (a / 2.0 + tau * j / 6.0))
        # The polynomial may miss its own end by an ulp; a station must never pass the next knot's.
        s = np.clip(s, self.stations[k], self.stations[k + 1])
        return np.where(time < self.duration, s, self.length)

    def stretched(self, duration: float) -> MotionLaw:
        """Return the same motion run uniformly slower (or faster), to last `duration` seconds."""
        c = self.duration / duration
        times = self.times / c
        times[-1] = duration
        return MotionLaw(times, self.stations, self.speeds * c, self.accelerations * c**2, self.jerks * c**3)

    def smoothed(self, window: float) -> MotionLaw:
        """Return the moving average over `window` seconds of a law without jerk, from rest to rest.

        Its length stays, its duration grows by `window`, and its acceleration is continuous:
        s̈(t) = (ṡ(t) − ṡ(t − window)) / window, piecewise linear
        with knots at those of ṡ and the same later by `window`.
        """
        times = np.union1d(self.times, self.times + window)
        # Knots closer than rounding would give arbitrary jerks.
        times = times[np.concatenate([[True], np.diff(times) > 1e-12 * times[-1]])]
        now, before = (np.interp(t, self.times, self.speeds, 0.0, 0.0) for t in (times, times - window))
        a = (now - before) / window
        a[[0, -1]] = 0.0
        dt, da = np.diff(times), np.diff(a)
        jerks = da / dt
        speeds = np.concatenate([[0.0], np.cumsum(dt * (a[:-1] + a[1:]) / 2.0)])
        speeds[-1] = 0.0
        speeds = np.maximum(speeds, 0.0)
        steps = dt * (speeds[:-1] + dt * (a[:-1] / 2.0 + da / 6.0))
        stations = np.concatenate([[0.0], np.cumsum(np.maximum(steps, 0.0))])
        stations *= self.length / stations[-1]
        stations[-1] = self.length
        return MotionLaw(times, stations, speeds, a[:-1], jerks)


@dataclass(frozen=True, eq=False)
class SpeedNodes:
    """Nodes of a jerk-limited law: x = ṡ² (K,) in m²/s² and its slope x′ = 2 s̈ (K,) at stations s (K,)."""

    s: Floats
    x: Floats
    slope: Floats

    def law(self) -> MotionLaw:
        """Return the law through them."""
        return MotionLaw.through(self.s, self.x, self.slope)

    def slower(self, times: Floats, depths: Floats, widths: Floats) -> SpeedNodes:
        """Return it slower around `times` (n,): by shares `depths` (n,) there, by less within `widths` (n,) seconds.

        The speed is multiplied by f = 1 − depth (1 − u²)³, u = (t − time) / width, so x by f², without a step in the
        jerk; x′ = 2 s̈ follows. Factors of overlapping places multiply.
        """
        law = self.law()
        clock, v = np.interp(self.s, law.stations, law.times), np.sqrt(self.x)
        share, change = np.ones_like(v), np.zeros_like(v)
        low, high = np.searchsorted(clock, times - widths, "left"), np.searchsorted(clock, times + widths, "right")
        for k, time in enumerate(times.tolist()):
            here = slice(int(low[k]), int(high[k]))
            u = np.clip((clock[here] - time) / widths[k], -1.0, 1.0)
            left = 1.0 - u * u
            factor = 1.0 - depths[k] * left**3
            change[here] = change[here] * factor + share[here] * (6.0 * depths[k] / widths[k]) * u * left**2
            share[here] *= factor
        return SpeedNodes(self.s, self.x * share**2, self.slope * share**2 + 2.0 * v * share * change)
