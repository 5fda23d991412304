"""Certificates: the largest used share of each limit, by exact extrema of the interpolated setpoints."""

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

AT_ONCE = 1 << 16
"""Intervals that are measured together: a few hundred bytes each."""


@dataclass(frozen=True)
class LimitUse(Value):
    """The largest used share of one limit. quantity: "leg velocity", ...; value and bound in `unit` (SI).

    leg: from 1, for limits of legs. time: seconds, of the row at or after which the share is reached; segment: the
    toolpath's segment there; station: global s in metres. above: why the value may slightly exceed the bound.
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
    """Return the largest used share of each limit that the machine sets or that was added to it.

    Judged are the setpoints as the controller interpolates them, by the exact extrema of every polynomial. legs
    (N, legs) m, tips (N, 3) m and axes (N, 3): the program's rows, at the controller's period; by default the
    trajectory is sampled, and the feed is judged by its station, since the tip is never faster. spot: metres from the
    given tips along the given axes to the spot on the surface whose speed is the feed (tools with a stand-off); rapids
    are judged by the tip. A step of acceleration at either end counts as jerk over one period. An interval with two
    sections is judged by the slower feed.
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
    # A motion that starts or ends at a speed is part of a longer one: the controller's spline continues there.
    before, after = _paddings(trajectory, period, tool=tips is not None)
    rows = SetpointRows(trajectory(times) if legs is None else legs, stations, tips, axes)
    rows = SetpointRows.concatenated([part for part in (before, rows, after) if part is not None])
    first = 0 if before is None else len(before)
    setpoints = InterpolatedSetpoints(
        rows, trajectory.path.pieces[trajectory.indices[0]], period, interpolation, first, count
    )
    largest: list[Reading | None] = [None] * len(limits)
    for start, part in setpoints.parts(AT_ONCE):
        for k, limit in enumerate(limits):
            if isinstance(limit, Feed):
                own = times[start : start + part.count + 1]
                found = _feed(trajectory, machine, part, own, spot, of_tip=given is not None)
            elif limit.of_path or any(limit is one for one in trajectory.limits):
                found = _piecewise(limit, trajectory, part, start)
            else:
                found = limit.largest(part)
            known = largest[k]
            if found is not None and (known is None or found.value / found.bound > known.value / known.bound):
                largest[k] = replace(found, row=found.row + start)
    uses: list[LimitUse] = []
    for limit, found in zip(limits, largest, strict=True):
        if found is not None:
            leg = found.index + 1 if limit.of_legs else None
            where = (float(times[found.row]), float(stations[found.row]), int(segments[found.row]))
            uses.append(LimitUse(limit.quantity, found.value, found.bound, limit.unit, leg, *where, limit.above))
    return tuple(uses)


def _paddings(trajectory: Trajectory, period: float, *, tool: bool) -> tuple[SetpointRows | None, SetpointRows | None]:
    """Return the rows before the start and after the end, None where these are rests."""

    def padding(law: int, speed: float, *, start: bool) -> SetpointRows | None:
        index = trajectory.indices[law]
        if speed <= 0.0:
            return None
        rows = spline_padding(trajectory.path.pieces[index], speed, period, start=start, tool=tool)
        return rows.shifted(float(trajectory.path.starts[index]))[slice(-1) if start else slice(1, None)]

    first, last = trajectory.laws[0].speeds[0], trajectory.laws[-1].speeds[-1]
    return padding(0, first, start=True), padding(-1, last, start=False)


def _feed(
    trajectory: Trajectory,
    machine: Machine,
    setpoints: InterpolatedSetpoints,
    times: Floats,
    spot: float,
    *,
    of_tip: bool,
) -> Reading:
    """Return the largest share of the feed, or of the rapid rate on rapids."""
    feeds, own = trajectory.feeds(times), setpoints.own_intervals
    speeds = np.where(np.isfinite(feeds), feeds, machine.rapid_velocity)
    slower = np.minimum(speeds[:-1], speeds[1:])
    if not of_tip:
        rates = trajectory.feed_rates(times)
        steps = setpoints.station.steps[own] * np.maximum(rates[:-1], rates[1:])[:, None, None]
    else:
        steps = setpoints.tip.steps[own]
        if spot != 0.0:
            on_feed = np.isfinite(feeds)
            of_spot = steps + spot * setpoints.axis.steps[own]
            steps = np.where((on_feed[:-1] | on_feed[1:])[:, None, None], of_spot, steps)
    share, row = largest_length(steps / slower[:, None, None])
    return Reading(share * float(slower[row]), float(slower[row]), row, 0)


def _piecewise(limit: Limit, trajectory: Trajectory, setpoints: InterpolatedSetpoints, start: int) -> Reading | None:
    """Return the largest share of a limit that depends on the path, judged piece by piece.

    start: number of the first interval of these setpoints.
    """
    found: list[Reading] = []
    starts = np.rint(trajectory.starts / setpoints.period).astype(int) - start
    starts[0] = -start
    for index, begin, end in zip(trajectory.indices, starts[:-1].tolist(), starts[1:].tolist(), strict=True):
        low, high = max(begin, 0), min(end, setpoints.count)
        if high < low or (high == low and end > begin):
            continue
        piece, rows = trajectory.path.pieces[index], setpoints.rows.shifted(-float(trajectory.path.starts[index]))
        own = rows.stations[setpoints.first + low : setpoints.first + high + 1]
        np.clip(own, 0.0, piece.length, out=own)
        part = replace(setpoints, rows=rows, piece=piece, first=setpoints.first + low, count=high - low)
        reading = limit.largest(part)
        if reading is not None:
            found.append(replace(reading, row=reading.row + low))
    return max(found, key=lambda reading: reading.value / reading.bound, default=None)
