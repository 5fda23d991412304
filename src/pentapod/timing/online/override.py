"""Feed override: the trajectory that follows when the operator changes the override of a running program.

The remaining path is planned anew with its feeds scaled, and the motion changes from the old plan to the new one in a
short transition: the speed at each station is blended from the one to the other. A feed hold slows the clock of the old
plan down to a stop. Setpoints until then stay as they were; speed and acceleration have no step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from pentapod.base.arrays import Ints
from pentapod.base.errors import InputError
from pentapod.base.refusal import Refusal, stage
from pentapod.machine.machine import Machine
from pentapod.timing.online.remaining_path import RemainingPath, RemainingPiece
from pentapod.timing.online.splice import LawSegment, spliced
from pentapod.timing.online.transition import Transition, TransitionSearch
from pentapod.timing.retime import retime
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.time_law.refusals import STILL_M
from pentapod.timing.time_law.trajectory import Profile, Trajectory

LEAST_SHARE, LARGEST_SHARE = 0.01, 1.5
TRANSITION = "feed override"
"""The active limit during a transition, in the profile."""

Replan: TypeAlias = Callable[[int, float], "Trajectory | Refusal"]
"""The plan with overridden feeds, from rest at a station of a piece to the end of the path."""


@stage
def override(
    trajectory: Trajectory, machine: Machine, time: float, share: float, **options: Any
) -> Trajectory | Refusal:
    """Return the trajectory after a feed override at `time` seconds of a running one.

    share: factor on all feeds, and on the rapid rate where it is below 1: 0, or 0.01 to 1.5; the legs' limits stay.
    0 is a feed hold: the result ends where the machine comes to rest, on the path. Given a held trajectory and a time
    not before its end, the motion resumes from there, after standing until `time`. The override takes effect at the
    next setpoint; earlier setpoints are those of the old plan. Speed and acceleration are continuous, and the limits
    hold on the setpoints as the controller interpolates them; only a lowered feed may be exceeded until it is reached.
    Where no transition keeps the limits, the old plan continues to its next exact stop. options: as for `retime`.

    Returns a Refusal where the rest cannot be timed. Raises InputError: a share out of range, a negative time, or a
    time after the end of the path.

    >>> slower = override(trajectory, machine, time=2.0, share=0.5).unwrap()
    >>> slower.duration > trajectory.duration
    True
    """
    if not (share == 0.0 or LEAST_SHARE <= share <= LARGEST_SHARE):
        expected = f"0 (hold), or {LEAST_SHARE:g} to {LARGEST_SHARE:g}"
        raise InputError("an override is a factor on the feeds", key="share", value=share, expected=expected)
    if not (np.isfinite(time) and time >= 0.0):
        raise InputError("must be a time of the trajectory", key="time", value=time, expected="seconds ≥ 0")
    options = {"limits": trajectory.limits, **options}
    period = machine.controller.period
    start = float(np.ceil(time / period - 1e-6)) * period
    starts = trajectory.starts

    def replan(first: int, station: float) -> Trajectory | Refusal:
        pieces, rapid = trajectory.path.pieces[first:], machine.rapid_velocity
        parts = (RemainingPiece.of(piece, 0.0 if k else station, share, rapid) for k, piece in enumerate(pieces))
        dwells = np.append(0.0, trajectory.path.dwells[first + 1 :])
        return retime(RemainingPath(tuple(parts), dwells), machine, **options)

    if start >= trajectory.duration - 0.5 * period:
        return _resumed(trajectory, replan, max(start, trajectory.duration), hold=share == 0.0)
    k = max(int(np.searchsorted(starts, start + 0.5 * period, side="right")) - 1, 0)
    local = start - float(starts[k])
    if local > trajectory.laws[k].duration - 0.5 * period:  # within the dwell behind law k
        k, local = k + 1, 0.0
    if local < 0.5 * period:  # at an exact stop the new plan starts from rest, too
        return _ended(trajectory, k, period) if share == 0.0 else _continued(trajectory, replan, k)
    search = TransitionSearch(trajectory, machine, k)
    if share == 0.0:
        found = search.stop(local)
        return _ended(trajectory, k + 1, period) if found is None else _changed(trajectory, None, k, found)
    rest = replan(trajectory.indices[k], 0.0)
    if isinstance(rest, Refusal):
        return rest
    found = search.change(rest.laws[0], local)
    return _continued(trajectory, replan, k + 1) if found is None else _changed(trajectory, rest, k, found)


def _resumed(trajectory: Trajectory, replan: Replan, start: float, *, hold: bool) -> Trajectory | Refusal:
    """Return a trajectory that has come to rest, standing until `start`, and then continued unless on hold."""
    k = len(trajectory.laws) - 1
    station, index = trajectory.laws[k].length, trajectory.indices[k]
    dwell = start - trajectory.duration
    if station < trajectory.path.pieces[index].length - STILL_M:
        return trajectory if hold else _continued(trajectory, replan, k, station, dwell)
    if not _moves(trajectory, index + 1):
        raise InputError("the trajectory is over", key="time", value=start, expected=f"< {trajectory.duration:g} s")
    return trajectory if hold else _continued(trajectory, replan, k + 1, 0.0, dwell)


def _moves(trajectory: Trajectory, first: int) -> bool:
    """Return whether the path has a piece that moves, from piece `first` on."""
    return any(piece.length > STILL_M for piece in trajectory.path.pieces[first:])


def _continued(
    trajectory: Trajectory, replan: Replan, k: int, station: float = 0.0, dwell: float = 0.0
) -> Trajectory | Refusal:
    """Return the first k laws, and law k up to `station`, then a dwell and the new plan from rest."""
    following = trajectory.indices[k] if k < len(trajectory.indices) else trajectory.indices[-1] + 1
    if not _moves(trajectory, following):
        return trajectory
    rest = replan(following, station)
    if isinstance(rest, Refusal):
        return rest
    before = [LawSegment.of(trajectory.laws[k])] if station > 0.0 else []
    pause = [LawSegment.at_rest(dwell, station)] if dwell > 0.0 else []
    first = spliced([*before, *pause, LawSegment.of(rest.laws[0]).shifted(station)])
    stopped = float(trajectory.starts[k + 1 if station > 0.0 else k])
    offset = float(trajectory.path.starts[following]) + station
    later = _moved(rest.profile, stopped + dwell, offset)
    return _assembled(trajectory, rest, k, following, first, [_clip(trajectory.profile, 0.0, stopped), later])


def _ended(trajectory: Trajectory, k: int, period: float) -> Trajectory:
    """Return the first k laws: at rest at an exact stop."""
    if k == 0:  # not started: standing at the start for one period is a motion of no length
        still = spliced([LawSegment.at_rest(period, 0.0)])
        dwells = np.array([trajectory.dwells[0], 0.0])
        profile = _clip(trajectory.profile, 0.0, 0.0).extended(0.0, float(dwells[0]) + period)
        indices = trajectory.indices[:1]
        return replace(trajectory, indices=indices, laws=(still,), profile=profile, dwells=dwells, slowed=())
    profile = _clip(trajectory.profile, 0.0, float(trajectory.starts[k]))
    indices, laws, dwells = trajectory.indices[:k], trajectory.laws[:k], trajectory.dwells[: k + 1]
    return replace(trajectory, indices=indices, laws=laws, profile=profile, dwells=dwells, slowed=())


def _changed(trajectory: Trajectory, rest: Trajectory | None, k: int, found: Transition) -> Trajectory:
    """Return the trajectory with the transition in law k, and the new plan behind it."""
    law = spliced([LawSegment.of(trajectory.laws[k], 0.0, found.leave), *found.segments])
    start, index = float(trajectory.starts[k]), trajectory.indices[k]
    offset, bridge = float(trajectory.path.starts[index]), found.segments[0]
    count = len(bridge.times)
    during = Profile(
        bridge.times, bridge.stations, bridge.speeds, np.zeros(count, dtype=np.intp), np.ones(count), (TRANSITION,)
    )
    profiles = [_clip(trajectory.profile, 0.0, start + found.leave), _moved(during, start + found.leave, offset)]
    if rest is None:
        return _assembled(trajectory, None, k, index, law, profiles)
    joins, end = float(found.segments[1].times[0]), rest.laws[0].duration
    first = _moved(_clip(rest.profile, joins / found.slower, end), 0.0, offset)
    others = _moved(_clip(rest.profile, end, np.inf), 0.0, offset)
    first = replace(first, times=start + found.arrival + first.times * found.slower - joins)
    others = replace(others, times=start + law.duration + others.times - end)
    return _assembled(trajectory, rest, k, index, law, [*profiles, first, others])


def _assembled(
    trajectory: Trajectory, rest: Trajectory | None, k: int, index: int, law: MotionLaw, profiles: list[Profile]
) -> Trajectory:
    """Return the first k laws, then `law` on piece `index`, then the other laws of the new plan."""
    indices: tuple[int, ...] = () if rest is None else tuple(index + i for i in rest.indices[1:])
    laws = () if rest is None else rest.laws[1:]
    names = (*(name for name in profiles[0].constraint_names if name != TRANSITION), TRANSITION)
    return replace(
        trajectory,
        indices=(*trajectory.indices[:k], index, *indices),
        laws=(*trajectory.laws[:k], law, *laws),
        profile=Profile(
            *(np.concatenate([getattr(p, name) for p in profiles]) for name in ("times", "stations", "speeds")),
            active=np.concatenate([_renumbered(p, names) for p in profiles]),
            shares=np.concatenate([p.shares for p in profiles]),
            constraint_names=names,
        ),
        dwells=np.append(trajectory.dwells[: k + 1], 0.0 if rest is None else rest.dwells[1:]),
        slowed=(),
    )


def _renumbered(profile: Profile, names: tuple[str, ...]) -> Ints:
    """Return the active limits (K,) as indices into `names`."""
    index = np.array([names.index(name) for name in profile.constraint_names], dtype=np.intp)
    return index[profile.active]


def _clip(profile: Profile, start: float, end: float) -> Profile:
    """Return the gridpoints between two times."""
    return profile.at((profile.times >= start) & (profile.times <= end))


def _moved(profile: Profile, later: float, further: float) -> Profile:
    """Return a profile moved by seconds and metres."""
    return replace(profile, times=profile.times + later, stations=profile.stations + further)
