"""Slow cuts: where the speed on the surface is below the feed, for processes such as laser or spray that need it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.runs import equal_runs, marked_runs
from pentapod.timing.time_law.trajectory import Trajectory
from pentapod.toolpath.toolpath import SegmentKind


@dataclass(frozen=True)
class SlowCut(Value):
    """A stretch of a cut whose surface speed is below the feed.

    segment: of the toolpath; stations: from and to, global s in metres; seconds: its duration; share: the least speed
    over the feed; constraint: the active limit there.
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
            f"of the feed, for {self.seconds:.3g} s, limited by {self.constraint}"
        )


def slow_cuts(
    trajectory: Trajectory,
    period: float,
    surface_rate: Callable[[Floats], Floats] | None = None,
    *,
    held: float = 0.98,
) -> tuple[SlowCut, ...]:
    """Return where cuts are slower on the surface than the share `held` of the feed, the longest first.

    Sampled every `period` seconds; dwells do not count. surface_rate: travel of the spot on the surface for each metre
    of global s, at stations (n,); 1 by default.
    """
    times = np.arange(int(np.ceil(trajectory.duration / period)) + 1) * period
    stations, segments, profile = trajectory.station(times), trajectory.segment(times), trajectory.profile
    rate = np.ones(len(times)) if surface_rate is None else surface_rate(stations)
    feeds = trajectory.feeds(times)
    wanted = np.isfinite(feeds) & ~trajectory.dwelling(times)
    share = np.where(wanted, trajectory.station(times, 1) * rate / feeds, 1.0)
    pieces = [trajectory.path.pieces[k] for k in trajectory.indices]
    cuts = {
        int(segment)
        for piece in pieces
        for kind, segment in zip(piece.section_kinds, piece.section_segments, strict=True)
        if kind == SegmentKind.CUT
    }
    slow = (share < held) & np.isin(segments, sorted(cuts))
    found: list[SlowCut] = []
    for start, stop in marked_runs(slow).tolist():
        for a, b in (start + equal_runs(segments[start:stop])).tolist():
            worst = a + int(np.argmin(share[a:b]))
            gridpoint = min(int(np.searchsorted(profile.times, times[worst])), len(profile.times) - 1)
            name = profile.constraint_names[int(profile.active[gridpoint])]
            reach = (float(stations[a]), float(stations[b - 1]))
            found.append(SlowCut(int(segments[worst]), reach, (b - a) * period, float(share[worst]), name))
    return tuple(sorted(found, key=lambda cut: -cut.seconds))
