"""Time-optimal motion through waypoints: TOPP-RA along a cubic spline under velocity and acceleration limits.

For dense rows of joint positions from elsewhere: no toolpath, no feed, no jerk limit. The limits hold at the waypoints
and nearly so between them; `retime` also checks between gridpoints.
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
    """Rows (n, d) at each `period` seconds, from rest at the first waypoint to rest at the last, and the law.

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

    stations (n,): rising, four or more; waypoints (n, d), any units; velocity and acceleration, (d,) or one for all:
    the limits |q̇| and |q̈| in these units and seconds; period in seconds. The spline has "not a knot" ends; the law's
    gridpoints are the waypoints. Engines are those of `retime`.

    Raises InputError: arrays of wrong shape or not finite, stations that do not rise, limits or a period not above 0.
    """
    # The kernels are compiled: they are loaded where they are used.
    from pentapod.timing.waypoint_kernels import limit_rows, not_a_knot_slopes, rows_along  # noqa: PLC0415

    s, y = as_floats(stations, "stations", (None,)), as_floats(waypoints, "waypoints", (None, None))
    if s.ndim != 1 or y.ndim != 2 or len(s) < 4 or len(s) != len(y) or not (np.diff(s) > 0.0).all():
        raise InputError("stations must rise", key="stations", expected="four or more, one for each waypoint")
    fast, push = (_limits(x, name, y.shape[1]) for x, name in ((velocity, "velocity"), (acceleration, "acceleration")))
    if not 0.0 < period < np.inf:
        raise InputError("a period is a time", key="period", value=period, expected="seconds, above 0")
    s, y = (np.require(x, requirements=["C", "W"]) for x in (s, y))  # the layout for which the kernels are compiled
    slopes, first, second = (np.empty_like(y) for _ in range(3))
    not_a_knot_slopes(s, y, slopes, np.empty_like(s))
    ceiling = np.empty_like(s)
    limit_rows(s, y, slopes, fast, push, first, second, ceiling)
    x = fastest(s, first, second, ceiling, engine=engine)
    if isinstance(x, Failure):
        k = max(x.gridpoint, 0)
        return Refusal("timing", f"{x.reason}; waypoint {k}", (Shortfall("time law", ((k, k),), 0.0, ""),))
    law = MotionLaw.from_profile(s, x)
    rows = np.empty((int(np.ceil(law.duration / period - 1e-9)) + 1, y.shape[1]))
    rows_along(s, y, slopes, law.times, law.speeds, period, rows)
    return WaypointMotion(rows, period, law)


def _limits(given: ArrayLike, name: str, count: int) -> Floats:
    limits = np.asarray(given, dtype=np.float64)
    if limits.shape not in {(), (count,)} or not ((limits > 0.0) & (limits < np.inf)).all():
        raise InputError("limits are above 0", key=name, value=given, expected=f"one, or {count}")
    return np.array(np.broadcast_to(limits, count))
