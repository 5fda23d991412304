"""Transitions between time laws: a smooth stop, or a smooth change from the old plan to the new one.

The shortest transition is found by trial: the first one in a list whose setpoints keep every limit is taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.certificates import certify
from pentapod.timing.limits.limit import Limit
from pentapod.timing.limits.limits import machine_limits
from pentapod.timing.online.splice import LawSegment, spliced, times_at
from pentapod.timing.path.setpoints import InterpolatedSetpoints, SetpointRows
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.time_law.trajectory import Trajectory


@dataclass(frozen=True)
class TransitionOptions:
    """Options of the search for a transition."""

    lengths: tuple[int, ...] = (8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 1024)
    """Durations of a transition that are tried, in periods."""
    delays: tuple[int, ...] = (0, 4, 8, 16, 32, 64, 128)
    """Delays of its begin that are tried, in periods: the old plan may be at its limits just now."""
    nodes_per_period: int = 4
    """Nodes of the transition's cubics in a period."""
    exact_degree: int = 9
    """Degree of polynomials up to which the quadrature of the time between two nodes is exact (Gauss)."""
    edge: int = 24
    """Rows beside a transition after which the spline no longer depends on where its rows begin."""
    least_rest: int = 4
    """Periods of the new plan that must be left behind a transition."""

    @property
    def tries(self) -> list[tuple[int, int]]:
        """Pairs of delay and length in periods, those that end first come first."""
        pairs = [(delay, length) for delay in self.delays for length in self.lengths]
        return sorted(pairs, key=lambda pair: (sum(pair), pair[0]))


DEFAULTS = TransitionOptions()


@dataclass(frozen=True, eq=False)
class Transition:
    """A transition: when the old plan is left, and what follows until the end of the piece.

    leave: seconds from the start of the piece. segments: the transition, its times from `leave` on, and the rest of the
    new plan, none for a hold. slower: factor by which the new plan is slowed to end at a whole period.
    """

    leave: float
    segments: tuple[LawSegment, ...]
    slower: float = 1.0

    @property
    def arrival(self) -> float:
        """Seconds from the start of the piece to the end of the transition."""
        return self.leave + float(self.segments[0].times[-1])

    @property
    def duration(self) -> float:
        """Seconds that the whole piece lasts."""
        return self.leave + sum(segment.duration for segment in self.segments)


@dataclass(frozen=True, eq=False)
class TransitionSearch:
    """Search for the quickest transition out of law k of a trajectory, the old plan.

    Times `local` are seconds from the start of that law, when the transition may begin.
    """

    trajectory: Trajectory
    machine: Machine
    k: int
    options: TransitionOptions = DEFAULTS

    def stop(self, local: float) -> Transition | None:
        """Return the quickest stop on the path, by slowing down the clock; None: the piece's end comes first."""
        law, period, nodes_per_period = self._old, self._period, self.options.nodes_per_period
        for delay, length in self.options.tries:
            leave, seconds = local + delay * period, length * period
            if leave + seconds > law.duration:
                continue
            nodes = np.arange(length * nodes_per_period + 1) / (length * nodes_per_period)
            clock = np.clip(leave + seconds * _slowing(nodes), 0.0, law.duration)
            speeds = law(clock, 1) * (1.0 - _blend(nodes))
            speeds[-1] = 0.0
            found = Transition(leave, (LawSegment.through(seconds * nodes, law(clock), speeds),))
            if self._keeps(found):
                return found
        return None

    def change(self, new: MotionLaw, local: float) -> Transition | None:
        """Return the quickest change to a new law of the piece; None: the piece's end comes first."""
        for delay, length in self.options.tries:
            leave, seconds = local + delay * self._period, length * self._period
            if leave + seconds > self._old.duration - self.options.edge * self._period:
                continue
            found = self._change(new, leave, seconds, 1.0)
            if found is None or not self._keeps(found):
                continue
            whole = self._in_whole_periods(found, new, seconds)
            if whole is not None and self._keeps(whole):
                return whole
        return None

    @property
    def _old(self) -> MotionLaw:
        return self.trajectory.laws[self.k]

    @property
    def _period(self) -> float:
        return self.machine.controller.period

    def _change(self, new: MotionLaw, leave: float, seconds: float, slower: float) -> Transition | None:
        """Return the change to the new law run `slower`; None where hardly any of it would be left."""
        law = new.stretched(new.duration * slower)
        first = self._between(law, leave, seconds)
        joins = float(times_at(law, first.stations[-1:])[0])
        if law.duration - joins < self.options.least_rest * self._period:
            return None
        return Transition(leave, (first, LawSegment.of(law, joins)), slower)

    def _in_whole_periods(self, found: Transition, new: MotionLaw, seconds: float) -> Transition | None:
        """Return the change with the new law slowed so that the piece lasts whole periods (secant method)."""
        target = float(np.ceil(found.duration / self._period - 1e-7)) * self._period
        slope = found.segments[1].duration
        for _ in range(12):
            missing = target - found.duration
            if abs(missing) <= 1e-13 * target:
                return found
            step = missing / slope
            following = self._change(new, found.leave, seconds, found.slower + step)
            if following is None:
                return None
            slope = (following.duration - found.duration) / step
            found = following
            if slope <= 0.0:
                return None
        return found if abs(target - found.duration) <= 1e-11 * target else None

    def _between(self, new: MotionLaw, leave: float, seconds: float) -> LawSegment:
        """Return the motion whose speed at each station is blended from the old law's to the new one's.

        seconds: how long the old law would take for it. The knots of both laws are nodes too.
        """
        old, options = self._old, self.options
        count = int(np.ceil(options.nodes_per_period * seconds / self._period)) + 1
        ends = old(np.array([leave, leave + seconds]))
        inner = new.stations[(new.stations > ends[0]) & (new.stations < ends[1])]
        marks = np.concatenate([np.linspace(leave, leave + seconds, count), old.times, times_at(old, inner)])
        clock = np.unique(marks[(marks >= leave) & (marks <= leave + seconds)])
        clock = clock[np.concatenate([[True], np.diff(clock) > 1e-9 * seconds])]
        x, w = np.polynomial.legendre.leggauss((options.exact_degree + 1) // 2)
        half = 0.5 * np.diff(clock)
        at = clock[:-1, None] + half[:, None] * (1.0 + x)

        def speeds(tau: Floats) -> tuple[Floats, Floats]:
            before = old(tau, 1)
            after = new(times_at(new, old(tau)), 1)
            return before, before + _blend((tau - leave) / seconds) * (after - before)

        before, speed = speeds(at.ravel())
        steps = half * ((before / speed).reshape(at.shape) @ w)
        return LawSegment.through(np.concatenate([[0.0], np.cumsum(steps)]), old(clock), speeds(clock)[1])

    def _keeps(self, found: Transition) -> bool:
        """Return whether the interpolated setpoints around a transition keep all limits but feeds."""
        period, edge = self._period, self.options.edge
        law = spliced([LawSegment.of(self._old, 0.0, found.leave), *found.segments])
        piece = self.trajectory.path.pieces[self.trajectory.indices[self.k]]
        first, last = round(found.leave / period) - 2 * edge, int(np.ceil(found.arrival / period)) + 2 * edge
        limits = [limit for limit in self._limits if not limit.sectional]
        # Before its start and after its end the law stands, as the machine does.
        rows = SetpointRows.at(piece, law(np.arange(first, last + 1) * period), tool=any(x.of_tool for x in limits))
        if not np.isfinite(rows.legs).all():
            return False
        count, interpolation = len(rows) - 1 - 2 * edge, self.machine.controller.interpolation
        setpoints = InterpolatedSetpoints(rows, piece, period, interpolation, edge, count)
        return all((limit.used(setpoints) <= self._allowed.get(limit.quantity, 1.0)).all() for limit in limits)

    @cached_property
    def _limits(self) -> tuple[Limit, ...]:
        return (*machine_limits(self.machine), *self.trajectory.limits)

    @cached_property
    def _allowed(self) -> dict[str, float]:
        """The share of each jerk limit that the trajectory itself uses, where that is above 1."""
        jerks = {limit.quantity for limit in self._limits if limit.group == "jerk"}
        uses = certify(self.trajectory, self.machine)
        return {use.quantity: max(1.0, use.share) for use in uses if use.quantity in jerks}


def _blend(x: Floats) -> Floats:
    """Return the fraction (n,) that rises from 0 to 1 with two vanishing derivatives at both ends."""
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def _slowing(x: Floats) -> Floats:
    """Return the integral (n,) of 1 − `_blend`."""
    return x - x**4 * (2.5 - 3.0 * x + x**2)
