"""Trajectory: the legs as functions of time, a path with its time laws."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, Ints, as_floats, frozen, set_frozen
from pentapod.base.display import plot_axes
from pentapod.base.values import Result, Value
from pentapod.timing.limits.limit import Limit
from pentapod.timing.path.path import LegPathLike, PieceLike
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.time_law.slowed import Slowed


@dataclass(frozen=True, eq=False)
class Profile(Value):
    """Speed profile at the gridpoints, with the active limit at each.

    times (K,) s; stations (K,) global tip arc length, m; speeds (K,) tip, m/s; active (K,): index into
    `constraint_names`; shares (K,): used share of that limit (less the margin). Where laws are not limited in jerk but
    averaged for a cubic controller, active and shares are those of the law before that.
    """

    times: Floats
    stations: Floats
    speeds: Floats
    active: Ints
    shares: Floats
    constraint_names: tuple[str, ...]

    def at(self, rows: Ints | Bools) -> Profile:
        """Return some of its gridpoints."""
        times, stations, speeds, shares = (y[rows] for y in (self.times, self.stations, self.speeds, self.shares))
        return Profile(times, stations, speeds, self.active[rows], shares, self.constraint_names)

    def extended(self, start: float, end: float) -> Profile:
        """Return the profile from `start` to `end` seconds, at a stand where it begins later or ends sooner."""
        rows, times = np.arange(len(self.times)), self.times
        if start < times[0]:
            rows, times = np.append(0, rows), np.append(start, times)
        if end > times[-1]:
            rows, times = np.append(rows, rows[-1]), np.append(times, end)
        return replace(self.at(rows), times=times)


@dataclass(frozen=True, eq=False)
class Trajectory(Result):
    """Legs as functions of time, at rest at each stop between pieces, and at the ends unless speeds are given there.

    path: the leg path; indices: those of its pieces that move; laws: their motion laws in order, each a whole number of
    controller periods long, so that exact stops fall on setpoints. dwells (L + 1,): seconds of standing before each law
    and after the last, whole periods too. slowed: pieces that last more than 1.02 times as long as their first
    jerk-limited law. limits: those added to the machine's.

    >>> trajectory(trajectory.duration / 2).shape  # the legs at a time
    (1, 5)
    """

    summary = ("duration",)

    path: LegPathLike
    indices: tuple[int, ...]
    laws: tuple[MotionLaw, ...]
    profile: Profile
    dwells: Floats
    slowed: tuple[Slowed, ...] = ()
    limits: tuple[Limit, ...] = ()

    def __post_init__(self) -> None:
        set_frozen(self, indices=tuple(self.indices), laws=tuple(self.laws))
        set_frozen(self, dwells=frozen(self.dwells, "dwells", (len(self.laws) + 1,)))

    @property
    def starts(self) -> Floats:
        """Time (L + 1,) in seconds at which each law starts, and the end, final dwell included."""
        lasting = [law.duration for law in self.laws] + self.dwells[1:]
        return self.dwells[0] + np.concatenate([[0.0], np.cumsum(lasting)])

    def dwelling(self, t: ArrayLike) -> Bools:
        """Return at which times (n,) in seconds the machine stands in a dwell."""
        time, starts = np.asarray(t, dtype=np.float64), self.starts
        ends = np.append(0.0, starts[:-1] + [law.duration for law in self.laws])
        begun = np.minimum(np.searchsorted(starts, time, side="right"), len(self.laws))
        return np.asarray((time >= ends[begun]) & (self.dwells[begun] > 0.0))

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.starts[-1])

    @property
    def n_legs(self) -> int:
        """How many legs the machine has."""
        return self.path.pieces[self.indices[0]](np.zeros(1)).shape[1]

    def __call__(self, t: ArrayLike, order: int = 0) -> Floats:
        """Return legs in m, m/s or m/s² (n, legs), order 0, 1, 2, at times (n,) in seconds.

        At rest before the start and after the end. Raises ArrayError for times that are not finite.
        """

        def legs(piece: PieceLike, law: MotionLaw, time: Floats) -> Floats:
            s = law(time)
            if order == 0:
                return piece(s, 0)
            if order == 1:
                return piece(s, 1) * law(time, 1)[:, None]
            return piece(s, 1) * law(time, 2)[:, None] + piece(s, 2) * np.square(law(time, 1))[:, None]

        return self._piecewise(t, legs, (self.n_legs,))

    def pose(self, t: ArrayLike) -> tuple[Floats, Floats]:
        """Return tips and tool axes (n, 3), machine frame, at times (n,) in seconds."""
        both = self._piecewise(t, lambda piece, law, time: np.hstack(piece.pose(law(time))), (6,))
        return both[:, :3], both[:, 3:]

    def plot(self, axes: Any = None, samples: int = 2000) -> Any:
        """Draw tip speed and leg rates against time into two matplotlib axes, one below the other; return both.

        Raises InputError where matplotlib is not installed.
        """
        speed, rates = plot_axes(axes, rows=2)
        times = np.linspace(0.0, self.duration, samples)
        speed.plot(times, 6e4 * self.station(times, 1), lw=1, label="tip")
        rates.plot(times, 1e3 * self(times, 1), lw=1)
        speed.set(ylabel="speed, mm/min")
        rates.set(xlabel="time, s", ylabel="leg rates, mm/s")
        rates.legend([f"leg {leg + 1}" for leg in range(len(rates.lines))])
        return speed, rates

    def station(self, t: ArrayLike, order: int = 0) -> Floats:
        """Return the tip's global arc length s (n,) in metres or its derivative in time, order 0, 1, 2."""
        starts = np.asarray(self.path.starts)[list(self.indices)]

        def stations(piece: PieceLike, law: MotionLaw, time: Floats, start: float) -> Floats:
            return law(time, order) + (start if order == 0 else 0.0)

        return self._piecewise(t, stations, (), starts)

    def segment(self, t: ArrayLike) -> Ints:
        """Return the index (n,) of the toolpath's segment at each time."""
        return self._of_section(t, "section_segments").astype(np.intp)

    def feeds(self, t: ArrayLike) -> Floats:
        """Return the feed (n,) in m/s of the segment at each time, infinite on rapids."""
        return self._of_section(t, "section_feeds")

    def feed_rates(self, t: ArrayLike) -> Floats:
        """Return `feed_rate` (n,) of the path at each time: travel of the feed's point for each metre of s."""
        return self._piecewise(t, lambda piece, law, time: piece.feed_rate(law(time)), ())

    def _of_section(self, t: ArrayLike, name: str) -> Floats:
        def values(piece: PieceLike, law: MotionLaw, time: Floats) -> Floats:
            section = np.searchsorted(piece.section_ends, law(time), side="left")
            return np.asarray(getattr(piece, name), dtype=np.float64)[np.minimum(section, len(piece.section_ends) - 1)]

        return self._piecewise(t, values, ())

    def _piecewise(
        self,
        t: ArrayLike,
        evaluate: Callable[..., Floats],
        shape: tuple[int, ...],
        extra: Floats | None = None,
    ) -> Floats:
        """Return evaluate(piece, law, times in the piece[, extra]) for times (n,), piece by piece."""
        time = np.atleast_1d(as_floats(t, "t"))
        starts = self.starts
        index = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(self.laws) - 1)
        result = np.empty((len(time), *shape))
        order = np.argsort(index, kind="stable")
        borders = np.searchsorted(index[order], np.arange(len(self.laws) + 1))
        for k in np.unique(index):
            here = order[borders[k] : borders[k + 1]]
            more = () if extra is None else (extra[k],)
            piece, law = self.path.pieces[self.indices[k]], self.laws[k]
            local = time[here] - starts[k]
            # The sum of durations is rounded: its end must be the law's end.
            local = np.where(time[here] >= starts[k + 1] - self.dwells[k + 1], np.maximum(local, law.duration), local)
            result[here] = evaluate(piece, law, local, *more)
        return result
