"""The limits of one piece as functions of its arc length: leg rates and accelerations, feed, rapid rate.

With x = ṡ² and u = s̈, leg i moves at q_i′ √x and accelerates with q_i′ u + q_i″ x; the tip moves at √x.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.machine.machine import Machine
from pentapod.timing.paths import PieceLike

CONSTRAINTS = (
    *(f"leg {i} velocity" for i in range(1, 6)),
    *(f"leg {i} acceleration" for i in range(1, 6)),
    "feed",
    "rapid rate",
    *(f"leg {i} jerk" for i in range(1, 6)),
)
"""Names of the constraints: first those of the columns that `Limits.shares` returns."""

_PAIRS = np.triu_indices(5, 1)


@dataclass(frozen=True, eq=False)
class Limits:
    """What the plan may use: the machine's limits less the margins.

    velocity (5,) m/s, acceleration (5,) m/s² and jerk (5,) m/s³ of the legs; rapid: the tip's speed on rapids, m/s;
    feed_fraction of each feed; guard: seconds by which a slower section's feed reaches into its faster
    neighbours, so that no interval between two setpoints straddles the step too fast.
    """

    velocity: Floats
    acceleration: Floats
    jerk: Floats
    rapid: float
    feed_fraction: float
    guard: float

    @classmethod
    def of(cls, machine: Machine, velocity_margin: float, acceleration_margin: float, guard: float) -> Limits:
        """Return the machine's limits less the margins (fractions)."""
        return cls(
            velocity=machine.legs.max_velocity * (1.0 - velocity_margin),
            acceleration=machine.legs.max_acceleration * (1.0 - acceleration_margin),
            jerk=machine.legs.max_jerk * (1.0 - acceleration_margin),
            rapid=machine.rapid_velocity * (1.0 - velocity_margin),
            feed_fraction=1.0 - velocity_margin,
            guard=guard,
        )

    def section_speeds(self, piece: PieceLike) -> Floats:
        """Return the feed (M,) of each section, m/s, infinite where the rapid rate alone holds."""
        return np.asarray(piece.section_feeds, dtype=np.float64) * self.feed_fraction

    def guarded_sections(self, piece: PieceLike) -> tuple[Floats, Floats, Floats]:
        """Return where each section's feed holds, from and to (M,) in metres, and how fast s grows by it (M,)."""
        feeds = self.section_speeds(piece)
        ends = np.asarray(piece.section_ends, dtype=np.float64)
        begins = np.concatenate([[0.0], ends[:-1]])
        before, after = (self._by_feed(feeds, piece.feed_rate(s)) for s in (begins, ends))
        low, high = np.maximum(begins - self.guard * before, 0.0), np.minimum(ends + self.guard * after, piece.length)
        return low, high, np.minimum(before, after)

    def _by_feed(self, feeds: Floats, rates: Floats) -> Floats:
        """Return how fast s may grow (n,), m/s, by feeds (n,) of a point that moves by rates (n,) for each metre."""
        with np.errstate(divide="ignore"):
            return np.minimum(feeds / rates, self.rapid)

    def tip_speed(self, piece: PieceLike, s: Floats) -> tuple[Floats, Ints]:
        """Return the largest ṡ (n,), m/s, that feed and rapid rate allow at sorted stations s, and by which section."""
        speed, section = np.full(len(s), np.inf), np.zeros(len(s), dtype=np.intp)
        (begins, ends, _), speeds = self.guarded_sections(piece), self.section_speeds(piece)
        first, last = np.searchsorted(s, begins, "left"), np.searchsorted(s, ends, "right")
        for m in range(len(speeds)):  # sections are few, and overlap their neighbours
            here = slice(int(first[m]), int(last[m]))
            section[here] = np.where(speeds[m] < speed[here], m, section[here])
            speed[here] = np.minimum(speed[here], speeds[m])
        return self._by_feed(speed, piece.feed_rate(s)), section

    def ceiling(self, first: Floats, second: Floats, speed: Floats) -> Floats:
        """Return the largest x (n,) that some u allows: from q′, q″ (n, 5) and the tip's largest speed (n,).

        Leg accelerations are strips in the (u, x) plane. For one x each strip leaves an interval of u, and
        intervals have a point in common when each two of them have: hence the minimum over pairs of legs of
        (a_i |q_j′| + a_j |q_i′|) / |q_i″ q_j′ − q_j″ q_i′|.
        """
        a, (i, j) = self.acceleration, _PAIRS
        one, two = np.abs(first), second
        above = a[i] * one[:, j] + a[j] * one[:, i]
        below = np.abs(two[:, i] * first[:, j] - two[:, j] * first[:, i])
        with np.errstate(divide="ignore", invalid="ignore"):
            pairs = np.where(below > 0.0, above / below, np.inf).min(axis=1)
            rates = np.square(self.velocity / one).min(axis=1)  # the limit over 0 is infinite, as it should be
        return np.minimum(np.minimum(pairs, rates), speed**2)

    def shares(self, first: Floats, second: Floats, x: Floats, u: Floats, speed: Floats) -> Floats:
        """Return how much of each limit is used (n, 11): five velocities, five accelerations, tip speed."""
        root = np.sqrt(x)[:, None]
        return np.concatenate(
            [
                np.abs(first) * root / self.velocity,
                np.abs(first * u[:, None] + second * x[:, None]) / self.acceleration,
                root / speed[:, None],
            ],
            axis=1,
        )
