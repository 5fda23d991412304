"""Reuse of time laws: a path that was moved with its part is run by the laws it had, where the legs keep their limits.

A rigid motion keeps the tip's way, so that a law s(t) fits the moved path as it is; only the legs move otherwise. Each
piece between two stops is judged by itself: its law stays, or is run a little slower, or the piece is timed anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.progress import Progress, silent
from pentapod.base.refusal import Refusal, stage
from pentapod.base.values import Value
from pentapod.machine.machine import Machine
from pentapod.planning.leg_path.leg_path import LegPath
from pentapod.timing.certificates import LimitUse, certify
from pentapod.timing.limits.limit import Limit
from pentapod.timing.pieces.boundary_speeds import whole_periods
from pentapod.timing.retime import dwells_of, retime
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.time_law.refusals import STILL_M
from pentapod.timing.time_law.slowed import Slowed
from pentapod.timing.time_law.trajectory import Profile, Trajectory


@dataclass(frozen=True)
class ReuseOptions:
    """When a law is kept.

    same_length: relative difference of a piece's length up to which it is the piece of the law. slower: factor up to
    which a law is run slower, rather than timed anew. extra: factor beyond what the excess asks for. rounds: how often
    a law is slowed. rounding: share by which limits may be exceeded for the sake of rounded setpoints.
    """

    same_length: float = 1e-6
    slower: float = 1.03
    extra: float = 1.002
    rounds: int = 3
    rounding: float = 5e-4


OPTIONS = ReuseOptions()


@dataclass(frozen=True, eq=False)
class TimeLaws(Value):
    """The laws of a trajectory, and the gridpoints of its profile between times in seconds: starts (L + 1,)."""

    laws: tuple[MotionLaw, ...]
    starts: Floats
    profile: Profile

    @classmethod
    def of(cls, trajectory: Trajectory) -> TimeLaws:
        """Return those of a trajectory."""
        return cls(trajectory.laws, trajectory.starts, trajectory.profile)


@stage
def retime_as_before(
    path: LegPath,
    machine: Machine,
    before: TimeLaws,
    *,
    limits: Sequence[Limit] = (),
    progress: Progress = silent,
) -> Trajectory | Refusal:
    """Return a trajectory along a path by the laws of the same path elsewhere, as far as limits allow, or a refusal.

    limits: as in `retime`, which times the pieces whose laws do not fit, or all of them where the pieces are others.
    """
    indices = [k for k, piece in enumerate(path.pieces) if piece.length > STILL_M]
    lengths = np.array([path.pieces[k].length for k in indices])
    known = np.array([law.length for law in before.laws])
    if len(lengths) != len(known) or (np.abs(lengths - known) > OPTIONS.same_length * known).any():
        return retime(path, machine, limits=limits, progress=progress)
    laws: list[MotionLaw] = []
    profiles: list[Profile] = []
    slowed: list[Slowed] = []
    for number, k in enumerate(indices):
        law = _fitting(path, k, before.laws[number], machine, limits)
        if law is not None:
            laws.append(law)
            profiles.append(_profile(before, number, law, float(path.starts[k])))
        else:
            again = retime(_alone(path, k), machine, limits=limits)
            if isinstance(again, Refusal):
                return retime(path, machine, limits=limits, progress=progress)  # it says where on the whole path
            laws.append(again.laws[0])
            profiles.append(replace(again.profile, stations=again.profile.stations + float(path.starts[k])))
            slowed += [replace(one, piece=k, station=one.station + float(path.starts[k])) for one in again.slowed]
        progress("timing", (number + 1) / len(indices), f"piece {number + 1} of {len(indices)}")
    dwells = dwells_of(path, indices, machine.controller.period)
    starts = dwells[0] + np.concatenate([[0.0], np.cumsum([law.duration for law in laws] + dwells[1:])])
    names = before.profile.constraint_names
    if any(profile.constraint_names != names for profile in profiles):
        return retime(path, machine, limits=limits, progress=progress)
    profile = Profile(
        np.concatenate([start + profile.times for start, profile in zip(starts, profiles, strict=False)]),
        np.concatenate([profile.stations for profile in profiles]),
        np.concatenate([profile.speeds for profile in profiles]),
        np.concatenate([profile.active for profile in profiles]),
        np.concatenate([profile.shares for profile in profiles]),
        names,
    )
    whole = profile.extended(0.0, float(starts[-1]))
    found = Trajectory(path, tuple(indices), tuple(laws), whole, dwells, tuple(slowed), tuple(limits))
    if _excess(found, machine) > 1.0:
        return retime(path, machine, limits=limits, progress=progress)
    return found


def _fitting(path: LegPath, k: int, law: MotionLaw, machine: Machine, limits: Sequence[Limit]) -> MotionLaw | None:
    """Return the law on piece k, run slower where it must be; None where that is too slow."""
    own, longest = _alone(path, k), OPTIONS.slower * law.duration + machine.controller.period
    law = _on(law, path.pieces[k].length)
    for _ in range(OPTIONS.rounds):
        share = _excess(_by(own, law, limits), machine)
        if share <= 1.0:
            return law
        slower = whole_periods(law.duration * share * OPTIONS.extra, machine.controller.period)
        if slower > longest:
            return None
        law = law.stretched(slower)
    return None


def _excess(trajectory: Trajectory, machine: Machine) -> float:
    """Return how many times slower the motion must be to keep all limits; at most 1 where it keeps them.

    A motion that is c times slower has 1/c of its speeds, 1/c² of its accelerations and 1/c³ of its jerks. Limits that
    rounding may exceed a little count as wider by that.
    """
    uses = certify(trajectory, machine)
    return max((use.share / (1.0 + OPTIONS.rounding if use.above else 1.0)) ** (1.0 / _order(use)) for use in uses)


def _order(use: LimitUse) -> int:
    """Return which derivative a limit is of; 1 where its quantity does not say it."""
    return next((k for word, k in (("jerk", 3), ("acceleration", 2)) if word in use.quantity), 1)


def _on(law: MotionLaw, length: float) -> MotionLaw:
    """Return a law on a piece whose length differs by rounding."""
    c = length / law.length
    stations = law.stations * c
    stations[-1] = length
    return MotionLaw(law.times, stations, law.speeds * c, law.accelerations * c, law.jerks * c)


def _alone(path: LegPath, k: int) -> LegPath:
    """Return the path of piece k alone."""
    return LegPath((path.pieces[k],), np.array([0.0, path.pieces[k].length]), np.zeros(2))


def _by(path: LegPath, law: MotionLaw, limits: Sequence[Limit]) -> Trajectory:
    """Return the trajectory of one piece by a law; its profile is empty."""
    ends = np.array([0.0, law.duration])
    none = Profile(ends, np.array([0.0, law.length]), np.zeros(2), np.zeros(2, dtype=np.intp), np.zeros(2), ("",))
    return Trajectory(path, (0,), (law,), none, np.zeros(2), (), tuple(limits))


def _profile(before: TimeLaws, number: int, law: MotionLaw, start: float) -> Profile:
    """Return the profile of a law that was kept: its active limits are those of the plan before."""
    old, first = before.profile, before.starts[number]
    last = first + before.laws[number].duration
    rows = np.flatnonzero((old.times >= first) & (old.times <= last))
    times = (old.times[rows] - first) * law.duration / before.laws[number].duration
    stations, speeds = start + law(times), law(times, 1)
    return Profile(times, stations, speeds, old.active[rows], old.shares[rows], old.constraint_names)
