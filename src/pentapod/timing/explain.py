"""Explanation of a cycle time: the active limit at each place, and its cost in time against a lower bound."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.refusal import stage
from pentapod.base.values import Value
from pentapod.machine.machine import Machine
from pentapod.timing.certificates import LimitUse
from pentapod.timing.limits.limit import Constraint
from pentapod.timing.process import Unheld
from pentapod.timing.time_law.slowed import Slowed
from pentapod.timing.time_law.trajectory import Trajectory

STANDING = "standing still"
MOST_PLACES = 10
_GAUSS = 0.5 + np.array([-0.5, 0.0, 0.5]) * np.sqrt(0.6)
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
_NEIGHBOURS = 2  # segments between two of the same cause: cuts and links take turns
_NEAR = 0.02  # of the path: what is nearer is one place
_WORTH = 1e-4  # of the gap: what costs less is not told


@dataclass(frozen=True)
class Cause(Value):
    """An active limit: the seconds during which it limits the motion, and its cost in seconds.

    cost: time beyond the lower bound of these stretches of the path.
    """

    name: str
    time: float
    cost: float


@dataclass(frozen=True)
class CostlyPlace(Value):
    """A stretch of the path where one limit costs time.

    cost in seconds; segments: first and last of the toolpath; stations: from and to, global s in metres; time: when it
    costs most, seconds; subject: how a sentence calls the cause.
    """

    cause: str
    cost: float
    segments: tuple[int, int]
    stations: tuple[float, float]
    time: float
    subject: str

    def __str__(self) -> str:
        (a, b), (low, high) = self.segments, (1e3 * s for s in self.stations)
        where = f"segment {a}" if a == b else f"segments {a}–{b}"
        most = f"{low:.1f} to {high:.1f} mm along the path, most at {self.time:.2f} s"
        return f"{self.subject} costs {self.cost:.3g} s in {where} ({most})"


@dataclass(frozen=True)
class Explanation(Value):
    """Analysis of a cycle time: active limits, costly places, and shares of the limits.

    duration (s); lower_bound (s): ∫ max(1/feed, max_i |l_i′|/v_i) ds, which no motion along this path can beat; causes:
    most costly first, their times add up to the duration and their costs to the gap; places: the ten
    that cost most; uses: how much of each limit the sampled program uses; slow_cuts: where a process that wants
    constant speed on the surface does not get it; slowed: pieces that had to be slower than their first law.
    """

    duration: float
    lower_bound: float
    causes: tuple[Cause, ...]
    places: tuple[CostlyPlace, ...]
    uses: tuple[LimitUse, ...] = ()
    slow_cuts: tuple[Unheld, ...] = ()
    slowed: tuple[Slowed, ...] = ()

    @property
    def gap(self) -> float:
        """Seconds beyond the lower bound."""
        return self.duration - self.lower_bound

    def __str__(self) -> str:
        lines = [
            f"cycle time {self.duration:.3f} s, {100.0 * self.gap / self.lower_bound:.1f} % above what feeds and leg "
            f"velocities alone would take ({self.lower_bound:.3f} s)"
        ]
        lines += [
            f"  {c.name}: limits the motion for {c.time:.3g} s; without it at most {c.cost:.3g} s shorter"
            for c in self.causes
        ]
        lines += [f"  {place}" for place in self.places]
        lines += [f"  {use}" for use in self.uses]
        if self.slow_cuts:
            seconds = sum(place.seconds for place in self.slow_cuts)
            lines.append(f"cutting below the feed for {seconds:.3g} s, at {len(self.slow_cuts)} places")
            lines += [f"  {place}" for place in self.slow_cuts[:MOST_PLACES]]
        lines += [str(piece) for piece in self.slowed[:MOST_PLACES]]
        if len(self.slowed) > MOST_PLACES:
            lines.append(f"{len(self.slowed) - MOST_PLACES} more pieces last longer than their first laws")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON tells it: SI units."""
        content = asdict(self)
        content["gap"] = self.gap
        content["words"] = [str(place) for place in self.places]
        for use, told in zip(self.uses, content["uses"], strict=True):
            told["share"] = use.share
        return content


@stage
def explain(
    trajectory: Trajectory,
    machine: Machine,
    uses: tuple[LimitUse, ...] = (),
    slow_cuts: tuple[Unheld, ...] = (),
) -> Explanation:
    """Return the analysis of a trajectory's cycle time, from its profile at the gridpoints.

    uses: by `certify`; slow_cuts: by `unheld`; both are only told on.
    """
    profile = trajectory.profile
    taken, steps = np.diff(profile.times), np.diff(profile.stations)
    least, segments = _least_times(trajectory, machine, steps)
    cost = taken - least
    told = (*profile.constraints, Constraint(STANDING, STANDING))
    # A stage belongs by halves to the constraints of its two ends; what stands still belongs to neither.
    ends = np.where(steps > 0.0, np.stack([profile.active[:-1], profile.active[1:]]), len(told) - 1)
    times, costs = (np.bincount(ends.ravel(), np.tile(0.5 * y, 2), len(told)) for y in (taken, cost))
    causes = [
        Cause(one.name, float(time), float(lost)) for one, time, lost in zip(told, times, costs, strict=True) if time
    ]
    places: list[CostlyPlace] = []
    for k in np.flatnonzero(times):
        share = 0.5 * ((ends[0] == k).astype(float) + (ends[1] == k)) * cost
        places += _places(told[k], share, segments, profile.times, profile.stations, _WORTH * float(cost.sum()))
    return Explanation(
        float(profile.times[-1]),
        float(least.sum()),
        tuple(sorted(causes, key=lambda c: -c.cost)),
        tuple(sorted(places, key=lambda p: -p.cost)[:MOST_PLACES]),
        uses,
        slow_cuts,
        tuple(sorted(trajectory.slowed, key=lambda piece: piece.first - piece.duration)),
    )


def _least_times(trajectory: Trajectory, machine: Machine, steps: Floats) -> tuple[Floats, Ints]:
    """Return the least time (K − 1,) of each stage by feed and leg velocities, and its segment (K − 1,)."""
    stations, starts = trajectory.profile.stations, np.asarray(trajectory.path.starts)
    middle = 0.5 * (stations[:-1] + stations[1:])
    piece_of = np.clip(np.searchsorted(starts, middle, side="right") - 1, 0, len(starts) - 2)
    slowness, segments = np.zeros((len(steps), len(_GAUSS))), np.zeros(len(steps), dtype=np.intp)
    for k in np.unique(piece_of):
        rows, piece = piece_of == k, trajectory.path.pieces[k]
        s = (stations[:-1][rows, None] + _GAUSS * steps[rows, None]).ravel() - starts[k]
        section = np.minimum(np.searchsorted(piece.section_ends, s, side="left"), len(piece.section_ends) - 1)
        feeds = np.asarray(piece.section_feeds, dtype=np.float64)[section]
        by_feed = np.maximum(piece.feed_rate(s) / feeds, 1.0 / machine.rapid_velocity)
        by_legs = (np.abs(piece(s, 1)) / machine.legs.max_velocity).max(axis=1)
        slowness[rows] = np.maximum(by_feed, by_legs).reshape(-1, len(_GAUSS))
        segments[rows] = np.asarray(piece.section_segments)[section.reshape(-1, len(_GAUSS))[:, 1]]
    return steps * (slowness @ _WEIGHTS), segments


def _places(
    cause: Constraint, cost: Floats, segments: Ints, times: Floats, stations: Floats, worth: float
) -> list[CostlyPlace]:
    """Return the runs of stages, near to each other along the path, in which a cause costs at least `worth` s."""
    rows = np.flatnonzero(cost > 0.0)
    if not len(rows):
        return []
    far = stations[rows[1:]] - stations[rows[:-1] + 1] > _NEAR * (stations[-1] - stations[0])
    breaks = np.flatnonzero(far | (np.diff(segments[rows]) > _NEIGHBOURS)) + 1
    places: list[CostlyPlace] = []
    for run in np.split(rows, breaks):
        total, worst = float(cost[run].sum()), int(run[np.argmax(cost[run])])
        if total > worth:
            reach = (float(stations[run[0]]), float(stations[run[-1] + 1]))
            within = (int(segments[run[0]]), int(segments[run[-1]]))
            places.append(CostlyPlace(cause.name, total, within, reach, float(times[worst]), cause.subject))
    return places
