"""Transitions between two time laws: a smooth stop, or a smooth change from the old plan to the new one.

How short a transition may be is tried, not assumed: the first one whose setpoints keep every limit is taken.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.certificates import certify
from pentapod.timing.limits.limits import machine_limits
from pentapod.timing.online.splice import Nodes, joined, times_at
from pentapod.timing.path.setpoints import InterpolatedSetpoints, SetpointRows
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.time_law.trajectory import Trajectory

_LENGTHS = (8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 1024)
_DELAYS = (0, 4, 8, 16, 32, 64, 128)
"""Periods: how long a transition may take, and how much later it may begin where the old plan is at its limits."""

_NODES_PER_PERIOD = 4
_EXACT_DEGREE = 9  # of polynomials that the quadrature of the time takes exactly
_EDGE = 24  # rows beside a transition that the spline through its rows needs to forget where the rows were cut


@dataclass(frozen=True, eq=False)
class Turn:
    """A transition that holds: when the old plan is left, what follows until the end of the piece.

    parts: nodes from that time on: the transition, and what is left of the new plan; none for a hold. slower: how many
    times slower the new plan is run, for the sake of whole periods.
    """

    leave: float
    parts: tuple[Nodes, ...]
    slower: float = 1.0

    @property
    def arrival(self) -> float:
        """Seconds from the start of the piece to the end of the transition."""
        return self.leave + float(self.parts[0].times[-1])

    @property
    def duration(self) -> float:
        """Seconds that the whole piece lasts."""
        return self.leave + sum(float(part.times[-1] - part.times[0]) for part in self.parts)


def stop(trajectory: Trajectory, machine: Machine, k: int, local: float) -> Turn | None:
    """Return the quickest stop on the path, by a clock that slows down; None: the piece's end comes first."""
    law, period, allowed = trajectory.laws[k], machine.controller.period, _allowed(trajectory, machine)
    for delay, length in _tries():
        leave, seconds = local + delay * period, length * period
        if leave + seconds > law.duration:
            continue
        nodes = np.arange(length * _NODES_PER_PERIOD + 1) / (length * _NODES_PER_PERIOD)
        clock = np.clip(leave + seconds * _slowing(nodes), 0.0, law.duration)
        speeds = law(clock, 1) * (1.0 - _blend(nodes))
        speeds[-1] = 0.0
        parts = (Nodes.through(seconds * nodes, law(clock), speeds),)
        turn = Turn(leave, parts)
        if _keeps(trajectory, machine, k, turn, allowed):
            return turn
    return None


def passage(trajectory: Trajectory, rest: Trajectory, machine: Machine, k: int, local: float) -> Turn | None:
    """Return the quickest passage from the old plan to the new one; None: the piece's end comes first."""
    old, period, allowed = trajectory.laws[k], machine.controller.period, _allowed(trajectory, machine)
    for delay, length in _tries():
        leave, seconds = local + delay * period, length * period
        if leave + seconds > old.duration - _EDGE * period:
            continue
        turn = _turn(old, rest.laws[0], leave, seconds, period, 1.0)
        if turn is None or not _keeps(trajectory, machine, k, turn, allowed):
            continue
        whole = _whole(turn, old, rest.laws[0], seconds, period)
        if whole is not None and _keeps(trajectory, machine, k, whole, allowed):
            return whole
    return None


def _turn(old: MotionLaw, new: MotionLaw, leave: float, seconds: float, period: float, slower: float) -> Turn | None:
    """Return the passage to the new plan run `slower`; None where it is all but over by then."""
    law = new.stretched(new.duration * slower)
    first = _between(old, law, leave, seconds, period)
    joins = float(times_at(law, first.stations[-1:])[0])
    return Turn(leave, (first, Nodes.of(law, joins)), slower) if law.duration - joins >= 4.0 * period else None


def _whole(turn: Turn, old: MotionLaw, new: MotionLaw, seconds: float, period: float) -> Turn | None:
    """Return the passage with the new plan run so much slower that the piece lasts whole periods (secant)."""
    target = float(np.ceil(turn.duration / period - 1e-7)) * period
    slope = float(turn.parts[1].times[-1] - turn.parts[1].times[0])
    for _ in range(12):
        missing = target - turn.duration
        if abs(missing) <= 1e-13 * target:
            return turn
        step = missing / slope
        following = _turn(old, new, turn.leave, seconds, period, turn.slower + step)
        if following is None:
            return None
        slope = (following.duration - turn.duration) / step
        turn = following
        if slope <= 0.0:
            return None
    return turn if abs(target - turn.duration) <= 1e-11 * target else None


def _between(old: MotionLaw, new: MotionLaw, leave: float, seconds: float, period: float) -> Nodes:
    """Return the motion whose speed at each place goes over from the old plan's to the new one's.

    `seconds`: how long the old plan would take for it. Nodes are at the knots of both laws, too.
    """
    even = np.linspace(leave, leave + seconds, int(np.ceil(_NODES_PER_PERIOD * seconds / period)) + 1)
    ends = old(np.array([leave, leave + seconds]))
    inner = new.stations[(new.stations > ends[0]) & (new.stations < ends[1])]
    marks = np.concatenate([even, old.times, times_at(old, inner)])
    clock = np.unique(marks[(marks >= leave) & (marks <= leave + seconds)])
    clock = clock[np.concatenate([[True], np.diff(clock) > 1e-9 * seconds])]
    x, w = np.polynomial.legendre.leggauss((_EXACT_DEGREE + 1) // 2)
    half = 0.5 * np.diff(clock)
    at = clock[:-1, None] + half[:, None] * (1.0 + x)

    def speeds(tau: Floats) -> tuple[Floats, Floats]:
        before = old(tau, 1)
        after = new(times_at(new, old(tau)), 1)
        return before, before + _blend((tau - leave) / seconds) * (after - before)

    before, speed = speeds(at.ravel())
    steps = half * ((before / speed).reshape(at.shape) @ w)
    return Nodes.through(np.concatenate([[0.0], np.cumsum(steps)]), old(clock), speeds(clock)[1])


def _keeps(trajectory: Trajectory, machine: Machine, k: int, turn: Turn, allowed: Mapping[str, float]) -> bool:
    """Return whether the setpoints around a transition keep the limits but feeds, as the controller joins them.

    allowed: shares above 1, by the limit's quantity.
    """
    period, interpolation = machine.controller.period, machine.controller.interpolation
    law = joined([Nodes.of(trajectory.laws[k], 0.0, turn.leave), *turn.parts])
    piece = trajectory.path.pieces[trajectory.indices[k]]
    first, last = round(turn.leave / period) - 2 * _EDGE, int(np.ceil(turn.arrival / period)) + 2 * _EDGE
    limits = [limit for limit in (*machine_limits(machine), *trajectory.limits) if not limit.sectional]
    # The law stands before its start and after its end, as the machine does.
    rows = SetpointRows.at(piece, law(np.arange(first, last + 1) * period), tool=any(limit.of_tool for limit in limits))
    if not np.isfinite(rows.legs).all():
        return False
    setpoints = InterpolatedSetpoints(rows, piece, period, interpolation, _EDGE, len(rows) - 1 - 2 * _EDGE)
    return all((limit.used(setpoints) <= allowed.get(limit.quantity, 1.0)).all() for limit in limits)


def _allowed(trajectory: Trajectory, machine: Machine) -> dict[str, float]:
    """Return the share of each jerk limit that the trajectory itself takes, where that is above 1."""
    jerks = {limit.quantity for limit in (*machine_limits(machine), *trajectory.limits) if limit.group == "jerk"}
    return {use.quantity: max(1.0, use.share) for use in certify(trajectory, machine) if use.quantity in jerks}


def _tries() -> Iterator[tuple[int, int]]:
    """Yield (delay, length) in periods, those that end first come first."""
    yield from sorted(((d, n) for d in _DELAYS for n in _LENGTHS), key=lambda pair: (sum(pair), pair[0]))


def _blend(x: Floats) -> Floats:
    """Return the fraction (n,) that rises from 0 to 1 with two vanishing derivatives at both ends."""
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def _slowing(x: Floats) -> Floats:
    """Return the integral (n,) of 1 − `_blend`."""
    return x - x**4 * (2.5 - 3.0 * x + x**2)
