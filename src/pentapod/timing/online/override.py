"""Feed override: the trajectory that follows when the operator turns the knob on a running program.

The rest of the path is planned anew with its feeds scaled, and the motion passes from the old plan to the new one
within a short transition: the speed at each place goes over from the one to the other by a fraction that rises
smoothly from 0 to 1. A feed hold runs the old plan with a clock that slows down to a stand. What was
commanded before stays as it was; speed and acceleration have no step.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from pentapod.base.arrays import Ints
from pentapod.base.errors import InputError
from pentapod.base.refusal import Refusal, stage
from pentapod.machine.machine import Machine
from pentapod.timing.limits.limit import Constraint
from pentapod.timing.online.piece_part import PathParts, PiecePart
from pentapod.timing.online.splice import Nodes, joined
from pentapod.timing.online.transition import Turn, passage, stop
from pentapod.timing.path.path import LegPathLike
from pentapod.timing.retime import retime
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.time_law.refusals import STILL_M
from pentapod.timing.time_law.trajectory import Profile, Trajectory

LEAST_SHARE, LARGEST_SHARE = 0.01, 1.5
TRANSITION = Constraint("feed override", "feed override")
"""The active limit during a transition, in the profile."""


@stage
def override(
    trajectory: Trajectory, machine: Machine, time: float, share: float, **options: Any
) -> Trajectory | Refusal:
    """Return the trajectory that a feed override at `time` seconds makes of a running one.

    share: factor on all feeds, and on the rapid rate as far as it is below 1: 0, or 0.01 to 1.5; the legs' limits
    stay. 0 is a feed hold: the result ends where the machine comes to rest, on the path. Given a held trajectory and
    a time not before its end, the motion resumes from there, after standing until `time`. The override is heard at
    the next setpoint; setpoints until then are those of the old plan. Speed and acceleration are continuous, and the
    limits hold on the setpoints as the controller joins them; only a feed that was lowered may be exceeded until it
    is reached. Where no transition keeps the limits, the old plan goes on to its next exact stop. options: as for
    `retime`.

    Returns a Refusal where the rest cannot be timed. Raises InputError: a share out of range, a negative time, or a
    time after the end of the path.
    """
    if not (share == 0.0 or LEAST_SHARE <= share <= LARGEST_SHARE):
        expected = f"0 (hold), or {LEAST_SHARE:g} to {LARGEST_SHARE:g}"
        raise InputError("an override is a factor on the feeds", key="share", value=share, expected=expected)
    if not (np.isfinite(time) and time >= 0.0):
        raise InputError("must be a time on the trajectory's clock", key="time", value=time, expected="seconds ≥ 0")
    options = {"limits": trajectory.limits, **options}
    period = machine.controller.period
    start = float(np.ceil(time / period - 1e-6)) * period
    starts = trajectory.starts
    if start >= trajectory.duration - 0.5 * period:
        return _resumed(trajectory, machine, max(start, trajectory.duration), share, options)
    k = max(int(np.searchsorted(starts, start + 0.5 * period, side="right")) - 1, 0)
    local = start - float(starts[k])
    if local > trajectory.laws[k].duration - 0.5 * period:  # standing there; a dwell takes its own time
        k, local = k + 1, 0.0
    if local < 0.5 * period:  # at an exact stop: the new plan starts from rest, too
        return (
            _ended(trajectory, k, period)
            if share == 0.0
            else _continued(trajectory, machine, k, 0.0, share, 0.0, options)
        )
    if share == 0.0:
        turn = stop(trajectory, machine, k, local)
        return _ended(trajectory, k + 1, period) if turn is None else _turned(trajectory, None, k, turn)
    rest = _rest(trajectory.path, trajectory.indices[k], machine, 0.0, share, options)
    if isinstance(rest, Refusal):
        return rest
    turn = passage(trajectory, rest, machine, k, local)
    if turn is None:
        return _continued(trajectory, machine, k + 1, 0.0, share, 0.0, options)
    return _turned(trajectory, rest, k, turn)


def _rest(
    path: LegPathLike, first: int, machine: Machine, station: float, share: float, options: dict[str, Any]
) -> Trajectory | Refusal:
    """Return the plan with overridden feeds from `station` of the piece `first` to the end of the path, from rest."""
    pieces = path.pieces[first:]
    cuts = [station] + [0.0] * (len(pieces) - 1)
    parts = (PiecePart(piece, cut, share, machine.rapid_velocity) for piece, cut in zip(pieces, cuts, strict=True))
    dwells = np.append(0.0, path.dwells[first + 1 :])
    return retime(PathParts(tuple(parts), dwells), machine, **options)


def _resumed(
    trajectory: Trajectory, machine: Machine, start: float, share: float, options: dict[str, Any]
) -> Trajectory | Refusal:
    """Return a trajectory that has come to rest, standing until `start`, and then going on."""
    k = len(trajectory.laws) - 1
    station = trajectory.laws[k].length
    dwell = start - trajectory.duration
    last = trajectory.path.pieces[trajectory.indices[k]]
    if station < last.length - STILL_M:
        return trajectory if share == 0.0 else _continued(trajectory, machine, k, station, share, dwell, options)
    if not any(piece.length > STILL_M for piece in trajectory.path.pieces[trajectory.indices[k] + 1 :]):
        raise InputError("the trajectory is over", key="time", value=start, expected=f"< {trajectory.duration:g} s")
    return trajectory if share == 0.0 else _continued(trajectory, machine, k + 1, 0.0, share, dwell, options)


def _continued(
    trajectory: Trajectory,
    machine: Machine,
    k: int,
    station: float,
    share: float,
    dwell: float,
    options: dict[str, Any],
) -> Trajectory | Refusal:
    """Return the first laws (k of them, and the k-th up to `station`) with the new plan from rest behind them."""
    following = trajectory.indices[k] if k < len(trajectory.indices) else trajectory.indices[-1] + 1
    if not any(piece.length > STILL_M for piece in trajectory.path.pieces[following:]):
        return trajectory
    rest = _rest(trajectory.path, following, machine, station, share, options)
    if isinstance(rest, Refusal):
        return rest
    before = [Nodes.of(trajectory.laws[k])] if station > 0.0 else []
    pause = [Nodes.resting(dwell, station)] if dwell > 0.0 else []
    first = joined([*before, *pause, Nodes.of(rest.laws[0]).shifted(station)])
    stopped = float(trajectory.starts[k + 1 if station > 0.0 else k])
    offset = float(trajectory.path.starts[following]) + station
    later = _clip(rest.profile, 0.0, np.inf, stopped + dwell, offset)
    return _assembled(trajectory, rest, k, following, first, [_clip(trajectory.profile, 0.0, stopped, 0.0, 0.0), later])


def _ended(trajectory: Trajectory, k: int, period: float) -> Trajectory:
    """Return the first k laws: at rest at an exact stop."""
    if k == 0:  # not started: standing at the beginning is a motion of no length, of one period
        begin = trajectory.indices[0]
        still = joined([Nodes.resting(period, 0.0)])
        dwells = np.array([trajectory.dwells[0], 0.0])
        profile = _clip(trajectory.profile, 0.0, 0.0, 0.0, 0.0).standing(0.0, float(dwells[0]) + period)
        return replace(trajectory, indices=(begin,), laws=(still,), profile=profile, dwells=dwells, slowed=())
    profile = _clip(trajectory.profile, 0.0, float(trajectory.starts[k]), 0.0, 0.0)
    indices, laws, dwells = trajectory.indices[:k], trajectory.laws[:k], trajectory.dwells[: k + 1]
    return replace(trajectory, indices=indices, laws=laws, profile=profile, dwells=dwells, slowed=())


def _turned(trajectory: Trajectory, rest: Trajectory | None, k: int, turn: Turn) -> Trajectory:
    """Return the trajectory with the transition in its k-th law, and the new plan behind it."""
    law = joined([Nodes.of(trajectory.laws[k], 0.0, turn.leave), *turn.parts])
    start, index = float(trajectory.starts[k]), trajectory.indices[k]
    offset, bridge = float(trajectory.path.starts[index]), turn.parts[0]
    profiles = [
        _clip(trajectory.profile, 0.0, start + turn.leave, 0.0, 0.0),
        _bridge(bridge, trajectory.profile.constraints, start + turn.leave, offset),
    ]
    if rest is None:
        return _assembled(trajectory, None, k, index, law, profiles)
    joins, end = float(turn.parts[1].times[0]), rest.laws[0].duration
    first, others = (
        _clip(rest.profile, joins / turn.slower, end, 0.0, offset),
        _clip(rest.profile, end, np.inf, 0.0, offset),
    )
    first = replace(first, times=start + turn.arrival + first.times * turn.slower - joins)
    others = replace(others, times=start + law.duration + others.times - end)
    return _assembled(trajectory, rest, k, index, law, [*profiles, first, others])


def _assembled(
    trajectory: Trajectory, rest: Trajectory | None, k: int, index: int, law: MotionLaw, profiles: list[Profile]
) -> Trajectory:
    """Return the first k laws, then `law` on piece `index`, then the rest's other laws."""
    more: tuple[int, ...] = () if rest is None else tuple(index + i for i in rest.indices[1:])
    laws = () if rest is None else rest.laws[1:]
    constraints = (*(one for one in profiles[0].constraints if one != TRANSITION), TRANSITION)
    return replace(
        trajectory,
        indices=(*trajectory.indices[:k], index, *more),
        laws=(*trajectory.laws[:k], law, *laws),
        profile=Profile(
            *(np.concatenate([getattr(p, name) for p in profiles]) for name in ("times", "stations", "speeds")),
            active=np.concatenate([_renumbered(p, constraints) for p in profiles]),
            shares=np.concatenate([p.shares for p in profiles]),
            constraints=constraints,
        ),
        dwells=np.append(trajectory.dwells[: k + 1], 0.0 if rest is None else rest.dwells[1:]),
        slowed=(),
    )


def _renumbered(profile: Profile, constraints: tuple[Constraint, ...]) -> Ints:
    index = np.array([constraints.index(one) for one in profile.constraints], dtype=np.intp)
    return index[profile.active]


def _clip(profile: Profile, start: float, end: float, later: float, further: float) -> Profile:
    """Return a profile between two of its times, moved in time and along the path."""
    part = profile.at((profile.times >= start) & (profile.times <= end))
    return replace(part, times=part.times + later, stations=part.stations + further)


def _bridge(nodes: Nodes, before: tuple[Constraint, ...], later: float, further: float) -> Profile:
    constraints = (*(one for one in before if one != TRANSITION), TRANSITION)
    count = len(nodes.times)
    active = np.full(count, len(constraints) - 1, dtype=np.intp)
    return Profile(nodes.times + later, nodes.stations + further, nodes.speeds, active, np.ones(count), constraints)
