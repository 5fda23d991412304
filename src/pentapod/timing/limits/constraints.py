"""The limits of one piece as functions of its arc length: legs, feed, rapid rate, and the tool's own motion.

With x = ṡ² and u = s̈, leg i moves at q_i′ √x and accelerates with q_i′ u + q_i″ x; the tip moves at √x at most.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.machine.machine import Machine
from pentapod.machine.rounding import TIP_ROUNDING, jerk_of_rounding
from pentapod.machine.tool_limits import ToolLimits
from pentapod.timing.law.paths import PieceLike
from pentapod.timing.limits.path_derivatives import PathDerivatives, legs_along, tip_along, turn_along
from pentapod.timing.limits.polytopes import DIRECTIONS, across_path, polygon, polyhedron

CONSTRAINTS = (
    *(f"leg {i} velocity" for i in range(1, 6)),
    *(f"leg {i} acceleration" for i in range(1, 6)),
    "tip acceleration",
    "axis acceleration",
    "axis velocity",
    "feed",
    "rapid rate",
    *(f"leg {i} jerk" for i in range(1, 6)),
    "tip jerk",
)
"""Names of the constraints: first those of the columns that `Limits.shares` returns, last those of `jerk_shares`."""

FEED = CONSTRAINTS.index("feed")
RAPID = CONSTRAINTS.index("rapid rate")
_RINGING = 0.975
"""Share of a jerk limit that is planned with: where jerk steps, the spline through setpoints rings above it."""

_LEAST_LEFT = 0.25
"""Share of a jerk limit that is planned with at least, however much rounding may add."""

PUSHES = slice(5, 12)
"""Columns of the accelerations; the others are speeds."""

_PAIRS = np.triu_indices(5, 1)


@dataclass(frozen=True, eq=False)
class Limits:
    """What the plan may use: the machine's limits less the margins.

    velocity (5,) m/s, acceleration (5,) m/s² and jerk (5,) m/s³ of the legs; tool: of the tip and the axis; rapid: the
    tip's speed on rapids, m/s; feed_fraction of each feed; guard: seconds by which a slower section's feed reaches
    into its faster neighbours, so that no interval between two setpoints straddles the step too fast; period: seconds
    between setpoints. Jerks leave room for what rounding setpoints adds; jerk_fraction of what is left is planned with.
    """

    velocity: Floats
    acceleration: Floats
    jerk: Floats
    tool: ToolLimits
    rapid: float
    feed_fraction: float
    guard: float
    jerk_fraction: float = 1.0
    period: float = 0.0

    @classmethod
    def of(cls, machine: Machine, velocity_margin: float, acceleration_margin: float, guard: float) -> Limits:
        """Return the machine's limits less the margins (fractions)."""
        slower, softer = 1.0 - velocity_margin, 1.0 - acceleration_margin
        smoother = softer * _RINGING
        tool, controller = machine.tool_limits, machine.controller
        rounding = jerk_of_rounding(controller.period, controller.interpolation)
        return cls(
            velocity=machine.legs.max_velocity * slower,
            acceleration=machine.legs.max_acceleration * softer,
            jerk=_less(machine.legs.max_jerk, rounding) * smoother,
            tool=ToolLimits(
                tool.max_tip_acceleration * softer,
                float(_less(tool.max_tip_jerk, TIP_ROUNDING * rounding)) * smoother,
                tool.max_axis_velocity * slower,
                tool.max_axis_acceleration * softer,
            ),
            rapid=machine.rapid_velocity * slower,
            feed_fraction=slower,
            jerk_fraction=smoother,
            guard=guard,
            period=controller.period,
        )

    @property
    def row_names(self) -> tuple[str, ...]:
        """Which constraint each row of `rows` belongs to."""
        tip = ("tip acceleration",) * (DIRECTIONS if self.tool.limits_tip_acceleration else 0)
        axis = ("axis acceleration",) * (DIRECTIONS if self.tool.limits_axis_acceleration else 0)
        return (*CONSTRAINTS[5:10], *tip, *axis)

    def derivatives(self, piece: PieceLike, s: Floats, order: int = 2) -> PathDerivatives:
        """Return what the limits need to know of a piece at sorted stations s (n,), legs and tip up to `order`."""
        tip = self.tool.limits_tip_acceleration or (order > 2 and self.tool.limits_tip_jerk)
        return PathDerivatives(
            legs_along(piece, s, order),
            tip_along(piece, s, order) if tip else (),
            turn_along(piece, s) if self.tool.limits_axis else (),
            *self.tip_speed(piece, s),
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

    def rows(self, path: PathDerivatives) -> tuple[Floats, Floats]:
        """Return the accelerations' rows (n, R), |first u + second x| ≤ 1: five of the legs, polygons of the tool."""
        first, second = [path.legs[0] / self.acceleration], [path.legs[1] / self.acceleration]
        if self.tool.limits_tip_acceleration:
            parts = polygon(path.tip[0], path.tip[1], self.tool.max_tip_acceleration)
            first, second = [*first, parts[0]], [*second, parts[1]]
        if self.tool.limits_axis_acceleration:
            parts = polygon(path.turn[0], path.turn[1], self.tool.max_axis_acceleration)
            first, second = [*first, parts[0]], [*second, parts[1]]
        return np.concatenate(first, axis=1), np.concatenate(second, axis=1)

    def jerk_rows(self, path: PathDerivatives) -> Floats:
        """Return the jerks' rows (n, K, 3) of x, x′, x″, by √x: five of the legs, a polyhedron around the tip's."""
        one, two, three = (y / self.jerk for y in path.legs)
        legs = np.stack([three, 1.5 * two, 0.5 * one], axis=-1)
        if not self.tool.limits_tip_jerk:
            return legs
        return np.concatenate([legs, polyhedron(path.tip[0], path.tip[1], path.tip[2], self.tool.max_tip_jerk)], axis=1)

    def ceiling(self, path: PathDerivatives) -> Floats:
        """Return a bound of x (n,): what speeds allow, and accelerations at their best u.

        Leg accelerations are strips in the (u, x) plane. For one x each strip leaves an interval of u, and
        intervals have a point in common when each two of them have: hence the minimum over pairs of legs of
        (a_i |q_j′| + a_j |q_i′|) / |q_i″ q_j′ − q_j″ q_i′|. Of the tool each limit counts alone.
        """
        a, (i, j) = self.acceleration, _PAIRS
        one, two = np.abs(path.legs[0]), path.legs[1]
        above = a[i] * one[:, j] + a[j] * one[:, i]
        below = np.abs(two[:, i] * path.legs[0][:, j] - two[:, j] * path.legs[0][:, i])
        # Where legs hardly bend at all a quotient beyond all numbers is no bound, as it should be.
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            bounds = [
                np.where(below > 0.0, above / below, np.inf).min(axis=1),
                np.square(self.velocity / one).min(axis=1),  # the limit over 0 is infinite, as it should be
                np.square(path.speed),
            ]
            if self.tool.limits_tip_acceleration:
                bounds.append(self.tool.max_tip_acceleration / across_path(path.tip[0], path.tip[1]))
            if self.tool.limits_axis:
                bounds.append(np.square(self.tool.max_axis_velocity / np.linalg.norm(path.turn[0], axis=1)))
                bounds.append(self.tool.max_axis_acceleration / across_path(path.turn[0], path.turn[1]))
        return np.min(bounds, axis=0)

    def shares(self, path: PathDerivatives, x: Floats, u: Floats) -> Floats:
        """Return how much of each limit is used (n, 14), in the order of `CONSTRAINTS`; nothing of those not set."""
        root, x, u = np.sqrt(x)[:, None], x[:, None], u[:, None]
        shares = np.zeros((len(x), FEED + 1))
        shares[:, :5] = np.abs(path.legs[0]) * root / self.velocity
        shares[:, 5:10] = np.abs(path.legs[0] * u + path.legs[1] * x) / self.acceleration
        tool = self.tool
        if tool.limits_tip_acceleration:
            pushes = path.tip[0] * u + path.tip[1] * x
            shares[:, 10] = np.linalg.norm(pushes, axis=1) / tool.max_tip_acceleration
        if tool.limits_axis:
            pushes = path.turn[0] * u + path.turn[1] * x
            shares[:, 11] = np.linalg.norm(pushes, axis=1) / tool.max_axis_acceleration
            shares[:, 12] = np.linalg.norm(path.turn[0], axis=1) * root[:, 0] / tool.max_axis_velocity
        shares[:, FEED] = root[:, 0] / path.speed
        return shares

    def jerk_shares(self, path: PathDerivatives, v: Floats, a: Floats, j: Floats) -> Floats:
        """Return how much of each jerk limit is used (n, 6) at ṡ, s̈ and s⃛ (n,): legs, tip."""
        v, a, j = v[:, None], a[:, None], j[:, None]

        def jerk(one: Floats, two: Floats, three: Floats) -> Floats:
            return one * j + 3.0 * two * v * a + three * v**3

        shares = np.zeros((len(v), 6))
        shares[:, :5] = np.abs(jerk(*path.legs)) / self.jerk
        if self.tool.limits_tip_jerk:
            shares[:, 5] = np.linalg.norm(jerk(*path.tip), axis=1) / self.tool.max_tip_jerk
        return shares


def _less(jerk: Floats | float, rounding: float) -> Floats:
    """Return what rounding leaves of a jerk."""
    return np.maximum(np.asarray(jerk) - rounding, _LEAST_LEFT * np.asarray(jerk))
