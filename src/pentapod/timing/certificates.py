"""How much of each limit a sampled program uses at most, and where: exact extrema of what the controller does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.interpolant import Interpolant, largest_length
from pentapod.machine.machine import Machine
from pentapod.timing.law.trajectory import Trajectory
from pentapod.timing.pieces.spline_padding import spline_padding


@dataclass(frozen=True)
class LimitUse(Value):
    """The largest share of one limit. quantity: "leg velocity", ...; value and bound in `unit` (SI).

    leg: 1 to 5 where the limit is a leg's. time: seconds, of the row at or after which the share is reached; segment:
    the toolpath's segment there; station: global s in metres.
    """

    quantity: str
    value: float
    bound: float
    unit: str
    leg: int | None
    time: float
    station: float
    segment: int

    @property
    def share(self) -> float:
        """Value over bound: 1 is the limit."""
        return self.value / self.bound

    def __str__(self) -> str:
        whose = f"leg {self.leg}: " if self.leg else ""
        over = self.share > 1.0 and self.quantity.endswith("jerk")
        why = ": the spline through the setpoints overshoots where the law's jerk steps" if over else ""
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
    """Return the largest share of leg velocity, acceleration and jerk, of feed, and of the tool's limits where set.

    Of the setpoints as the controller joins them: every polynomial's exact extrema, no samples between. legs (N, 5) m,
    tips (N, 3) m and axes (N, 3): the program's rows, at the controller's period; without them the trajectory is
    sampled, and for the feed its station stands for the tip, which is never faster. spot: metres from the given tips
    along the given axes to where a tool with a stand-off meets the surface, whose speed the feed is; rapids are judged
    by the tip. Jerk counts the step of acceleration at either end over one period. An interval that two sections share
    is judged by the slower feed.
    """
    period, interpolation = machine.controller.period, machine.controller.interpolation
    count = max(1, round(trajectory.duration / period)) if legs is None else len(legs) - 1
    times = np.minimum(np.arange(count + 1) * period, trajectory.duration)
    stations, segments = trajectory.station(times), trajectory.segment(times)
    # A motion that starts or ends at a speed is part of a longer one, which the controller's spline goes through.
    limits = machine.tool_limits.given()
    before, after = _spline_paddings(trajectory, period, tool=tips is not None or bool(limits))

    def joined(rows: Floats, columns: slice) -> Interpolant:
        parts = [y[:, columns] for y in (before,) if len(y)] + [rows] + [y[:, columns] for y in (after,) if len(y)]
        return Interpolant.through(np.concatenate(parts), period, interpolation)

    def own(values: Floats) -> Floats:
        return values[len(before) : len(values) - len(after)]

    motion = joined(trajectory(times) if legs is None else legs, slice(5))
    tip = joined(stations[:, None], slice(5, 6)) if tips is None else joined(tips, slice(6, 9))

    def use(quantity: str, unit: str, value: float, bound: float, row: int, leg: int | None = None) -> LimitUse:
        where = (float(times[row]), float(stations[row]), int(segments[row]))
        return LimitUse(quantity, value, bound, unit, leg, *where)

    def of_legs(quantity: str, unit: str, values: Floats, limit: Floats) -> LimitUse:
        row, leg = np.unravel_index(int(np.argmax(values / limit)), values.shape)
        return use(quantity, unit, float(values[row, leg]), float(limit[leg]), int(row), int(leg) + 1)

    uses = [
        of_legs("leg velocity", "m/s", own(motion.rates), machine.legs.max_velocity),
        of_legs("leg acceleration", "m/s²", own(motion.accelerations), machine.legs.max_acceleration),
        of_legs("leg jerk", "m/s³", own(motion.jerks), machine.legs.max_jerk),
    ]
    feeds = _slower(trajectory.feeds(times), machine.rapid_velocity)
    steps = own(tip.steps)
    if tips is None:
        rates = trajectory.feed_rates(times)
        steps = steps * np.maximum(rates[:-1], rates[1:])[:, None, None]
    elif axes is not None and spot != 0.0:
        on_feed = np.isfinite(trajectory.feeds(times))
        of_spot = own(tip.steps + spot * joined(axes, slice(9, 12)).steps)
        steps = np.where((on_feed[:-1] | on_feed[1:])[:, None, None], of_spot, steps)
    share, row = largest_length(steps / feeds[:, None, None])
    uses.append(use("feed", "m/s", share * float(feeds[row]), float(feeds[row]), row))
    if limits:
        posed = trajectory.pose(times) if tips is None or axes is None else (tips, axes)
        for name, unit, values in _of_tool(joined(posed[0], slice(6, 9)), joined(posed[1], slice(9, 12)), own):
            if name in limits:
                row = int(np.argmax(values))
                uses.append(use(_TOOL[name], unit, float(values[row]), limits[name], row))
    return tuple(uses)


def _slower(feeds: Floats, rapid: float) -> Floats:
    """Return for each interval (N − 1,) the slower of the feeds (N,) at its ends; infinite ones are rapids."""
    speeds = np.where(np.isfinite(feeds), feeds, rapid)
    return np.minimum(speeds[:-1], speeds[1:])


_TOOL = {
    "max_tip_acceleration": "tip acceleration",
    "max_tip_jerk": "tip jerk",
    "max_axis_velocity": "axis velocity",
    "max_axis_acceleration": "axis acceleration",
}


def _spline_paddings(trajectory: Trajectory, period: float, *, tool: bool) -> tuple[Floats, Floats]:
    """Return the rows (n, 6 or 12) before the start and after the end, none where these are rests."""
    pieces = [trajectory.path.pieces[k] for k in (trajectory.indices[0], trajectory.indices[-1])]
    speeds = trajectory.laws[0].speeds[0], trajectory.laws[-1].speeds[-1]
    none = np.zeros((0, 12))
    before = spline_padding(pieces[0], speeds[0], period, start=True, tool=tool)[:-1] if speeds[0] > 0.0 else none
    after = spline_padding(pieces[1], speeds[1], period, start=False, tool=tool)[1:] if speeds[1] > 0.0 else none
    return before, after


def _of_tool(
    tip: Interpolant, axis: Interpolant, own: Callable[[Floats], Floats]
) -> tuple[tuple[str, str, Floats], ...]:
    """Return name, unit and values (N or N − 1,) of what may be limited in the motion of tips and axes.

    own: takes the values of the padding away.
    """
    steps = own(axis.steps)
    fastest, row = largest_length(steps)
    speeds = np.zeros(len(steps))
    speeds[row] = fastest
    return (
        ("max_tip_acceleration", "m/s²", own(np.linalg.norm(tip.second, axis=1))),
        ("max_tip_jerk", "m/s³", own(tip.jerk_lengths)),
        ("max_axis_velocity", "rad/s", speeds),
        ("max_axis_acceleration", "rad/s²", own(axis.turn_accelerations)),
    )
