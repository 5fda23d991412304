"""Constant surface speed for processes such as laser or spray: where it is not reached, and the active limit there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.runs import equal_runs, marked_runs
from pentapod.timing.time_law.trajectory import Trajectory
from pentapod.toolpath.toolpath import SegmentKind

HELD = 0.98
"""Share of the feed from which it counts as held."""


@dataclass(frozen=True)
class Unheld(Value):
    """A stretch of a cut whose surface speed is below the feed.

    segment: of the toolpath; stations: from and to, global s in metres; seconds: how long; share: the least speed over
    the feed; constraint: the active limit there.
    """

    segment: int
    stations: tuple[float, float]
    seconds: float
    share: float
    constraint: str

    def __str__(self) -> str:
        low, high = (1e3 * s for s in self.stations)
        return (
            f"segment {self.segment}, {low:.1f} to {high:.1f} mm along the path: down to {100.0 * self.share:.0f} % "
            f"of the feed, for {self.seconds:.3g} s, by {self.constraint}"
        )


def unheld(
    trajectory: Trajectory,
    period: float,
    surface_rate: Callable[[Floats], Floats] | None = None,
    *,
    held: float = HELD,
) -> tuple[Unheld, ...]:
    """Return where on cuts the speed on the surface is below `held` of the feed, the longest first.

    Judged every `period` seconds; standing that the toolpath asks for does not count. surface_rate: how far the spot on
    the surface moves for each metre of global s, at stations (n,); without it the tip's own way counts.
    """
    times = np.arange(int(np.ceil(trajectory.duration / period)) + 1) * period
    stations, segments, profile = trajectory.station(times), trajectory.segment(times), trajectory.profile
    rate = np.ones(len(times)) if surface_rate is None else surface_rate(stations)
    feeds = trajectory.feeds(times)
    wanted = np.isfinite(feeds) & ~trajectory.standing(times)
    share = np.where(wanted, trajectory.station(times, 1) * rate / feeds, 1.0)
    cuts = {
        int(segment)
        for k in trajectory.indices
        for kind, segment in zip(
            trajectory.path.pieces[k].section_kinds, trajectory.path.pieces[k].section_segments, strict=True
        )
        if kind == SegmentKind.CUT
    }
    slow = (share < held) & np.isin(segments, sorted(cuts))
    found: list[Unheld] = []
    for start, stop in marked_runs(slow).tolist():
        for a, b in (start + equal_runs(segments[start:stop])).tolist():
            worst = a + int(np.argmin(share[a:b]))
            gridpoint = min(int(np.searchsorted(profile.times, times[worst])), len(profile.times) - 1)
            found.append(
                Unheld(
                    int(segments[worst]),
                    (float(stations[a]), float(stations[b - 1])),
                    (b - a) * period,
                    float(share[worst]),
                    profile.constraint_names[int(profile.active[gridpoint])],
                )
            )
    return tuple(sorted(found, key=lambda u: -u.seconds))
