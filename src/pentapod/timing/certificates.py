"""Certificates: the largest share of each limit that a sampled program uses, by exact extrema of its interpolation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.interpolant import largest_length
from pentapod.machine.machine import Machine
from pentapod.timing.limits.feed import Feed
from pentapod.timing.limits.limit import Limit, Reading
from pentapod.timing.limits.limits import machine_limits
from pentapod.timing.path.setpoints import InterpolatedSetpoints, SetpointRows, spline_padding
from pentapod.timing.time_law.trajectory import Trajectory


@dataclass(frozen=True)
class LimitUse(Value):
    """The largest share of one limit. quantity: "leg velocity", ...; value and bound in `unit` (SI).

    leg: from 1, where the limit is a leg's. time: seconds, of the row at or after which the share is reached; segment:
    the toolpath's segment there; station: global s in metres. above: why the value may be above the bound by little.
    """

    quantity: str
    value: float
    bound: float
    unit: str
    leg: int | None
    time: float
    station: float
    segment: int
    above: str = ""

    @property
    def share(self) -> float:
        """Value over bound: 1 is the limit."""
        return self.value / self.bound

    def __str__(self) -> str:
        whose = f"leg {self.leg}: " if self.leg else ""
        why = f": {self.above}" if self.above and self.share > 1.0 else ""
        return (
            f"{self.quantity} {100.0 * self.share:.2f} % ({whose}{self.value:.4g} of {self.bound:.4g} {self.unit}) "
            f"at {self.time:.3f} s, segment {self.segment}{why}"
        )


def certify(
    trajectory: Trajectory,
    machine: Machine,
    *,
    legs: Floats | None = None,
    tips: Floats | None = None,
    axes: Floats | None = None,
    spot: float = 0.0,
) -> tuple[LimitUse, ...]:
    """Return the largest share of every limit of the machine and of those added to it, as far as it is set.

    Of the setpoints as the controller joins them: every polynomial's exact extrema, no samples between. legs (N, legs)
    m, tips (N, 3) m and axes (N, 3): the program's rows, at the controller's period; without them the trajectory is
    sampled, and for the feed its station stands for the tip, which is never faster. spot: metres from the given tips
    along the given axes to where a tool with a stand-off meets the surface, whose speed the feed is; rapids are judged
    by the tip. Jerk counts the step of acceleration at either end over one period. An interval that two sections share
    is judged by the slower feed.
    """
    period, interpolation = machine.controller.period, machine.controller.interpolation
    count = max(1, round(trajectory.duration / period)) if legs is None else len(legs) - 1
    times = np.minimum(np.arange(count + 1) * period, trajectory.duration)
    stations, segments = trajectory.station(times), trajectory.segment(times)
    limits, given = (*machine_limits(machine), *trajectory.limits), tips
    of_tool = any(limit.of_tool for limit in limits)
    if of_tool and (tips is None or axes is None):
        posed = trajectory.pose(times)
        tips, axes = posed[0] if tips is None else tips, posed[1] if axes is None else axes
    # A motion that starts or ends at a speed is part of a longer one, which the controller's spline goes through.
    before, after = _paddings(trajectory, period, tool=tips is not None)
    rows = SetpointRows(trajectory(times) if legs is None else legs, stations, tips, axes)
    rows = SetpointRows.concatenated([part for part in (before, rows, after) if part is not None])
    first = 0 if before is None else len(before)
    joined = InterpolatedSetpoints(
        rows, trajectory.path.pieces[trajectory.indices[0]], period, interpolation, first, count
    )
    uses: list[LimitUse] = []
    for limit in limits:
        if isinstance(limit, Feed):
            found = _feed(trajectory, machine, joined, times, spot, of_tip=given is not None)
        else:
            added = any(limit is one for one in trajectory.limits)
            found = _piecewise(limit, trajectory, joined) if added else limit.largest(joined)
        if found is not None:
            leg = found.index + 1 if limit.of_legs else None
            where = (float(times[found.row]), float(stations[found.row]), int(segments[found.row]))
            uses.append(LimitUse(limit.quantity, found.value, found.bound, limit.unit, leg, *where, limit.above))
    return tuple(uses)


def _paddings(trajectory: Trajectory, period: float, *, tool: bool) -> tuple[SetpointRows | None, SetpointRows | None]:
    """Return the rows before the start and after the end, None where these are rests."""
    first, last = (trajectory.path.pieces[k] for k in (trajectory.indices[0], trajectory.indices[-1]))
    start, end = trajectory.laws[0].speeds[0], trajectory.laws[-1].speeds[-1]
    before = spline_padding(first, start, period, start=True, tool=tool)[:-1] if start > 0.0 else None
    after = spline_padding(last, end, period, start=False, tool=tool)[1:] if end > 0.0 else None
    return before, after


def _feed(
    trajectory: Trajectory, machine: Machine, joined: InterpolatedSetpoints, times: Floats, spot: float, *, of_tip: bool
) -> Reading:
    """Return the largest share of the feed, or of the rapid rate on rapids."""
    feeds, own = trajectory.feeds(times), joined.own_intervals
    speeds = np.where(np.isfinite(feeds), feeds, machine.rapid_velocity)
    slower = np.minimum(speeds[:-1], speeds[1:])
    if not of_tip:
        rates = trajectory.feed_rates(times)
        steps = joined.station.steps[own] * np.maximum(rates[:-1], rates[1:])[:, None, None]
    else:
        steps = joined.tip.steps[own]
        if spot != 0.0:
            on_feed = np.isfinite(feeds)
            of_spot = steps + spot * joined.axis.steps[own]
            steps = np.where((on_feed[:-1] | on_feed[1:])[:, None, None], of_spot, steps)
    share, row = largest_length(steps / slower[:, None, None])
    return Reading(share * float(slower[row]), float(slower[row]), row, 0)


def _piecewise(limit: Limit, trajectory: Trajectory, joined: InterpolatedSetpoints) -> Reading | None:
    """Return the largest share of a limit that asks for the path, piece by piece."""
    found: list[Reading] = []
    starts = np.minimum(np.rint(trajectory.starts / joined.period).astype(int), joined.count)
    starts[0] = 0
    for index, low, high in zip(trajectory.indices, starts[:-1].tolist(), starts[1:].tolist(), strict=True):
        piece, rows = trajectory.path.pieces[index], joined.rows.shifted(-float(trajectory.path.starts[index]))
        own = rows.stations[joined.first + low : joined.first + high + 1]
        np.clip(own, 0.0, piece.length, out=own)
        part = replace(joined, rows=rows, piece=piece, first=joined.first + low, count=high - low)
        reading = limit.largest(part)
        if reading is not None:
            found.append(replace(reading, row=reading.row + low))
    return max(found, key=lambda reading: reading.value / reading.bound, default=None)
