"""Explanation of a cycle time: the active limit at each place, and the time lost there against a lower bound."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats, Ints, row_maxima
from pentapod.base.refusal import stage
from pentapod.base.values import Value
from pentapod.machine.machine import Machine
from pentapod.timing.certificates import LimitUse
from pentapod.timing.slow_cuts import SlowCut
from pentapod.timing.time_law.slowed import Slowed
from pentapod.timing.time_law.trajectory import Profile, Trajectory

STANDSTILL = "standing still"
_LEG = re.compile(r"^leg \d+ ")
GAUSS_NODES = 0.5 + np.array([-0.5, 0.0, 0.5]) * np.sqrt(0.6)
GAUSS_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0


@dataclass(frozen=True)
class PlaceOptions:
    """Options of the list of costly places."""

    most: int = 10
    """Places, and slow cuts and slowed pieces, that are listed at most."""
    segments_apart: int = 2
    """Segments between two places of one cause up to which they are one place: cuts and links alternate."""
    share_apart: float = 0.02
    """Distance between two places of one cause, as a share of the path, up to which they are one place."""
    least_share: float = 1e-4
    """Cost of a place, as a share of the gap to the lower bound, below which it is not listed."""


DEFAULT_PLACES = PlaceOptions()


@dataclass(frozen=True)
class Cause(Value):
    """An active limit. time: seconds during which it limits the motion; cost: seconds lost there to the lower bound."""

    name: str
    time: float
    cost: float

    def __str__(self) -> str:
        if self.name == STANDSTILL:
            return f"{self.name} for {self.time:.3g} s"
        return f"{self.name}-limited for {self.time:.3g} s; {self.gain}"

    @property
    def gain(self) -> str:
        """What the program would gain without this limit; for those of the lower bound, that it would."""
        if self.name in ("feed", "rapid rate"):
            return f"shorter with a higher {self.name}"
        if self.name.startswith("leg ") and self.name.endswith(" velocity"):
            return "shorter with a faster leg"
        return f"without this limit at most {self.cost:.3g} s shorter"


@dataclass(frozen=True)
class CostlyPlace(Value):
    """A stretch of the path where time is lost to one limit.

    cost in seconds; segments: first and last of the toolpath; stations: from and to, global s in metres; time: seconds,
    when most is lost.
    """

    cause: str
    cost: float
    segments: tuple[int, int]
    stations: tuple[float, float]
    time: float

    def __str__(self) -> str:
        (a, b), (low, high) = self.segments, (1e3 * s for s in self.stations)
        where = f"segment {a}" if a == b else f"segments {a}–{b}"
        most = f"{low:.1f} to {high:.1f} mm along the path, most at {self.time:.2f} s"
        return f"{self.cause}: {self.cost:.3g} s lost in {where} ({most})"


@dataclass(frozen=True)
class Explanation(Value):
    """Analysis of a cycle time: active limits, costly places, and used shares of the limits.

    duration (s); lower_bound (s): ∫ max(1/feed, max_i |l_i′|/v_i) ds, which no motion along this path can beat; causes:
    most costly first, their times add up to the duration and their costs to the gap; places: the ten most costly;
    uses: share of each limit that the sampled program uses; slow_cuts: where a cut is slower than its feed; slowed:
    pieces that had to be slower than their first law.

    >>> story.duration > story.lower_bound
    True
    """

    duration: float
    lower_bound: float
    causes: tuple[Cause, ...]
    places: tuple[CostlyPlace, ...]
    uses: tuple[LimitUse, ...] = ()
    slow_cuts: tuple[SlowCut, ...] = ()
    slowed: tuple[Slowed, ...] = ()

    @property
    def gap(self) -> float:
        """Seconds beyond the lower bound."""
        return self.duration - self.lower_bound

    def __str__(self) -> str:
        return f"{self._total()}\n{self.details()}"

    def details(self) -> str:
        """Return each limit by itself, the places where most time is lost, and the largest share used of each limit."""
        lines = [f"  {line}" for line in (*self.causes, *self.places, *self.uses)]
        if self.slow_cuts:
            lines += [self._slow(), *(f"  {cut}" for cut in self.slow_cuts[: DEFAULT_PLACES.most])]
        return "\n".join([*lines, *self._slowed(DEFAULT_PLACES.most)])

    def _total(self) -> str:
        return (
            f"cycle time {self.duration:.3f} s, {100.0 * self.gap / self.lower_bound:.1f} % above what feeds and leg "
            f"velocities alone would take ({self.lower_bound:.3f} s)"
        )

    def _slow(self) -> str:
        seconds, places = sum(cut.seconds for cut in self.slow_cuts), len(self.slow_cuts)
        return f"cutting below the feed for {seconds:.3g} s, at {places} {'place' if places == 1 else 'places'}"

    def _slowed(self, most: int) -> list[str]:
        lines, more = [str(piece) for piece in self.slowed[:most]], len(self.slowed) - most
        if more > 0:
            verb = "piece lasts longer than its first law" if more == 1 else "pieces last longer than their first laws"
            lines.append(f"{more} more {verb}")
        return lines

    def in_short(self) -> str:
        """Return the cycle time, how long each kind of limit decides the speed, and what fell short of its feed."""
        kinds: dict[str, Cause] = {}
        for cause in self.causes:
            name = _LEG.sub("leg ", cause.name)
            other = kinds.get(name, Cause(name, 0.0, 0.0))
            kinds[name] = Cause(name, other.time + cause.time, other.cost + cause.cost)
        longest = sorted(kinds.values(), key=lambda cause: -cause.time)
        lines = [self._total(), *(f"  {cause}" for cause in longest)]
        if self.slow_cuts:
            lines += [self._slow(), f"  {max(self.slow_cuts, key=lambda cut: cut.seconds)}"]
        return "\n".join([*lines, *self._slowed(1)])

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON, SI units."""
        content = asdict(self)
        content["gap"] = self.gap
        content["words"] = [str(place) for place in self.places]
        for use, content_of_use in zip(self.uses, content["uses"], strict=True):
            content_of_use["share"] = use.share
        return content


@stage
def explain(
    trajectory: Trajectory,
    machine: Machine,
    uses: tuple[LimitUse, ...] = (),
    slow_cuts: tuple[SlowCut, ...] = (),
) -> Explanation:
    """Return the analysis of a trajectory's cycle time, from its profile at the gridpoints.

    uses: by `certify`; slow_cuts: by `slow_cuts`; both are only passed on.

    >>> story = explain(trajectory, machine)
    >>> "feed" in [cause.name for cause in story.causes]
    True
    """
    profile = trajectory.profile
    taken, steps = np.diff(profile.times), np.diff(profile.stations)
    least, segments = _least_times(trajectory, machine, steps)
    cost = taken - least
    names = (*profile.constraint_names, STANDSTILL)
    # A stage counts half for the limit at each of its ends; one without length is a standstill.
    ends = np.where(steps > 0.0, np.stack([profile.active[:-1], profile.active[1:]]), len(names) - 1)
    times, costs = (np.bincount(ends.ravel(), np.tile(0.5 * y, 2), len(names)) for y in (taken, cost))
    causes: list[Cause] = []
    places: list[CostlyPlace] = []
    for k in np.flatnonzero(times):
        causes.append(Cause(names[k], float(times[k]), float(costs[k])))
        share = 0.5 * ((ends[0] == k).astype(float) + (ends[1] == k)) * cost
        least_cost = DEFAULT_PLACES.least_share * float(cost.sum())
        places += _places(names[k], share, segments, profile, least_cost, DEFAULT_PLACES)
    return Explanation(
        float(profile.times[-1]),
        float(least.sum()),
        tuple(sorted(causes, key=lambda c: -c.cost)),
        tuple(sorted(places, key=lambda p: -p.cost)[: DEFAULT_PLACES.most]),
        uses,
        slow_cuts,
        tuple(sorted(trajectory.slowed, key=lambda piece: piece.first - piece.duration)),
    )


def _least_times(trajectory: Trajectory, machine: Machine, steps: Floats) -> tuple[Floats, Ints]:
    """Return the least time (K − 1,) of each stage by feed and leg velocities, and its segment (K − 1,)."""
    stations, starts = trajectory.profile.stations, np.asarray(trajectory.path.starts)
    middle = 0.5 * (stations[:-1] + stations[1:])
    piece_of = np.clip(np.searchsorted(starts, middle, side="right") - 1, 0, len(starts) - 2)
    slowness, segments = np.zeros((len(steps), len(GAUSS_NODES))), np.zeros(len(steps), dtype=np.intp)
    for k in np.unique(piece_of):
        rows, piece = piece_of == k, trajectory.path.pieces[k]
        s = (stations[:-1][rows, None] + GAUSS_NODES * steps[rows, None]).ravel() - starts[k]
        section = np.minimum(np.searchsorted(piece.section_ends, s, side="left"), len(piece.section_ends) - 1)
        feeds = np.asarray(piece.section_feeds, dtype=np.float64)[section]
        by_feed = np.maximum(piece.feed_rate(s) / feeds, 1.0 / machine.rapid_velocity)
        by_legs = row_maxima(np.abs(piece(s, 1)) / machine.legs.max_velocity)
        slowness[rows] = np.maximum(by_feed, by_legs).reshape(-1, len(GAUSS_NODES))
        segments[rows] = np.asarray(piece.section_segments)[section.reshape(-1, len(GAUSS_NODES))[:, 1]]
    return steps * (slowness @ GAUSS_WEIGHTS), segments


def _places(
    cause: str, cost: Floats, segments: Ints, profile: Profile, least_cost: float, options: PlaceOptions
) -> list[CostlyPlace]:
    """Return the runs of neighbouring stages in which a cause costs more than `least_cost` seconds."""
    rows, stations = np.flatnonzero(cost > 0.0), profile.stations
    if not len(rows):
        return []
    far = stations[rows[1:]] - stations[rows[:-1] + 1] > options.share_apart * (stations[-1] - stations[0])
    breaks = np.flatnonzero(far | (np.diff(segments[rows]) > options.segments_apart)) + 1
    places: list[CostlyPlace] = []
    for run in np.split(rows, breaks):
        total, worst = float(cost[run].sum()), int(run[np.argmax(cost[run])])
        if total > least_cost:
            reach = (float(stations[run[0]]), float(stations[run[-1] + 1]))
            within = (int(segments[run[0]]), int(segments[run[-1]]))
            places.append(CostlyPlace(cause, total, within, reach, float(profile.times[worst])))
    return places
