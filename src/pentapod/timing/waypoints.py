"""Time-optimal motion through waypoints: a cubic spline under velocity and acceleration limits, and its samples.

For rows of joint positions that come from elsewhere, dense enough to be the path: no toolpath, no feed, no jerk limit.
Limits hold at the waypoints and, accelerations being linear in what changes, nearly so between them; what is proven
between samples is `retime`'s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, frozen, set_frozen
from pentapod.base.errors import InputError
from pentapod.base.refusal import Refusal, Shortfall
from pentapod.base.values import Result
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.topp.engine import Engine, fastest
from pentapod.timing.topp.stages import Failure


@dataclass(frozen=True, eq=False)
class WaypointMotion(Result):
    """Rows (n, d) each `period` seconds, from the first waypoint at rest to the last at rest, and the law between.

    The last row is the first one at or after the law's end.
    """

    rows: Floats
    period: float
    law: MotionLaw

    def __post_init__(self) -> None:
        set_frozen(self, rows=frozen(self.rows, "rows", (None, None)))


def through_waypoints(
    stations: ArrayLike,
    waypoints: ArrayLike,
    *,
    velocity: ArrayLike,
    acceleration: ArrayLike,
    period: float,
    engine: Engine = "core",
) -> WaypointMotion | Refusal:
    """Return the fastest motion, at rest at both ends, along the C2 cubic spline through waypoints, and its samples.

    stations (n,) rise, four or more; waypoints (n, d), any units; velocity and acceleration, (d,) or one for all:
    the limits |q̇| and |q̈| in these units and seconds; period in seconds. The spline is the "not a knot" one; the law's
    gridpoints are the waypoints. Engines are those of `retime`.

    Raises InputError: arrays of wrong shape or not finite, stations that do not rise, limits or a period not above 0.
    """
    s, y = as_floats(stations, "stations", (None,)), as_floats(waypoints, "waypoints", (None, None))
    if s.ndim != 1 or y.ndim != 2 or len(s) < 4 or len(s) != len(y) or not (np.diff(s) > 0.0).all():
        raise InputError("stations must rise", key="stations", expected="four or more, one for each waypoint")
    fast, push = (_limits(x, name, y.shape[1]) for x, name in ((velocity, "velocity"), (acceleration, "acceleration")))
    if not 0.0 < period < np.inf:
        raise InputError("a period is a time", key="period", value=period, expected="seconds, above 0")
    spline = _Spline.through(s, y)
    x = fastest(s, *spline.rows(fast, push), engine=engine)
    if isinstance(x, Failure):
        k = max(x.gridpoint, 0)
        return Refusal("timing", f"{x.reason}; waypoint {k}", (Shortfall("time law", ((k, k),), 0.0, ""),))
    law = MotionLaw.from_profile(s, x)
    count = int(np.ceil(law.duration / period - 1e-9)) + 1
    return WaypointMotion(spline.along(law, period, count), period, law)


def _limits(given: ArrayLike, name: str, count: int) -> Floats:
    limits = np.asarray(given, dtype=np.float64)
    if limits.shape not in {(), (count,)} or not ((limits > 0.0) & (limits < np.inf)).all():
        raise InputError("limits are above 0", key=name, value=given, expected=f"one, or {count}")
    return np.array(np.broadcast_to(limits, count))


@dataclass(frozen=True, eq=False)
class _Spline:
    """The spline through waypoints y (n, d) at s (n,) by its slopes m (n, d) there."""

    s: Floats
    y: Floats
    m: Floats

    @classmethod
    def through(cls, s: Floats, y: Floats) -> _Spline:
        """Return it; the arrays in the one layout for which the kernels are compiled."""
        from pentapod.timing.waypoint_kernels import not_a_knot_slopes  # noqa: PLC0415  (compiled)

        s, y = (np.require(x, requirements=["C", "W"]) for x in (s, y))
        m = np.empty_like(y)
        not_a_knot_slopes(s, y, m, np.empty_like(s))
        return cls(s, y, m)

    def rows(self, velocity: Floats, acceleration: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the accelerations' rows, first and second (n, d), and the largest ṡ² (n,) by velocities."""
        from pentapod.timing.waypoint_kernels import limit_rows  # noqa: PLC0415  (compiled)

        first, second, ceiling = np.empty_like(self.y), np.empty_like(self.y), np.empty_like(self.s)
        limit_rows(self.s, self.y, self.m, velocity, acceleration, first, second, ceiling)
        return first, second, ceiling

    def along(self, law: MotionLaw, period: float, count: int) -> Floats:
        """Return the rows (count, d) each period."""
        from pentapod.timing.waypoint_kernels import rows_along  # noqa: PLC0415  (compiled)

        rows = np.empty((count, self.y.shape[1]))
        rows_along(self.s, self.y, self.m, law.times, law.speeds, period, rows)
        return rows
