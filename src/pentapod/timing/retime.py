"""Time-optimal retiming: from a leg path to the fastest trajectory within the machine's limits and the feeds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.base.progress import Progress, silent
from pentapod.base.refusal import Refusal, stage
from pentapod.machine.machine import Machine
from pentapod.numerics.threads import in_threads
from pentapod.timing.jerk.options import DEFAULTS, JerkOptions
from pentapod.timing.limits.limit import Limit
from pentapod.timing.limits.limits import Limits
from pentapod.timing.path.path import LegPathLike
from pentapod.timing.pieces.boundary_speeds import whole_periods
from pentapod.timing.pieces.piece import PieceProfile
from pentapod.timing.pieces.refinement import time_piece
from pentapod.timing.pieces.repair import WINDOW_PERIODS, NotRepaired, repaired_laws
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.time_law.refusals import STILL_M, refusal, unfit
from pentapod.timing.time_law.slowed import slowed
from pentapod.timing.time_law.trajectory import Profile, Trajectory
from pentapod.timing.topp.engine import Engine
from pentapod.timing.topp.stages import Failure

MOST_ROWS = 2e8
"""Rows of a program for which memory has room."""


@stage
def retime(
    path: LegPathLike,
    machine: Machine,
    *,
    progress: Progress = silent,
    velocity_margin: float = 0.002,
    acceleration_margin: float = 0.005,
    engine: Engine = "core",
    limit_jerk: bool = True,
    start_speed: float = 0.0,
    end_speed: float = 0.0,
    limits: Sequence[Limit] = (),
    jerk_options: JerkOptions = DEFAULTS,
) -> Trajectory | Refusal:
    """Return the fastest trajectory along a path within the machine's limits, or a refusal that names the cause.

    Leg velocities, accelerations and (limit_jerk) jerks, the feed on cuts and links and the rapid rate on rapids are
    kept at and between the gridpoints, and by the setpoints as the controller interpolates them
    (`machine.controller`). Each piece goes from rest to rest and lasts a whole number of periods; between pieces the
    machine stands as long as the path asks (`dwells`), in whole periods. Pieces of no length are skipped. Method:
    TOPP-RA (Pham and Pham 2018), by a compiled core; engine "toppra" takes the reference implementation instead.

    velocity_margin, acceleration_margin: fractions of the limits that the plan leaves free; the rounding of setpoints
    and what happens between gridpoints use part of them.
    start_speed, end_speed: ṡ in m/s at the path's start and end, where the motion is part of a longer one; with
    limit_jerk the acceleration there is 0. Speeds that the limits less the margins do not allow are refused.
    limits: further ones (`Limit`), kept beside those of the machine, less the same margins. One that is exceeded at
    rest is refused. jerk_options: how long faster laws within the jerk limits are searched for.

    `Trajectory.slowed` lists pieces that must be slower than their first jerk-limited law, so that their setpoints keep
    the limits; one that would last more than 20 times as long is refused.

    Raises InputError where a margin is not in (0, 0.5), for an unknown engine, for a speed below 0 or next to a dwell,
    or for a speed with a cubic controller whose jerks are not limited.

    >>> trajectory = retime(path, machine).unwrap()
    >>> trajectory.duration > 0.0
    True
    """
    _check_options(
        {"velocity_margin": velocity_margin, "acceleration_margin": acceleration_margin},
        {"start_speed": start_speed, "end_speed": end_speed},
    )
    cubic, moving_ends = machine.controller.interpolation == "cubic", max(start_speed, end_speed) > 0.0
    if cubic and moving_ends and not limit_jerk:
        raise InputError(
            "start_speed and end_speed need limited jerks where the controller interpolates by cubic splines, which "
            "overshoot where accelerations jump", key="limit_jerk", value=limit_jerk, expected="true",
        )  # fmt: skip
    period = machine.controller.period
    added, guard = tuple(limits), period * (1.5 + (WINDOW_PERIODS / 2 if cubic else 0.0))
    kept = Limits.of(machine, velocity_margin, acceleration_margin, guard, added)
    wrong = unfit(path)
    if wrong is not None:
        return wrong
    indices = [k for k, piece in enumerate(path.pieces) if piece.length > STILL_M]
    dwells = dwells_of(path, indices, period)
    _check_standing(start_speed, end_speed, dwells)
    _check_rows(path, dwells, period)
    total = sum(path.pieces[k].length for k in indices)
    profiles: list[PieceProfile] = []
    slacks, done = (0.5 * velocity_margin, 0.7 * acceleration_margin), 0.0

    def profile_of(k: int) -> PieceProfile | Failure:
        speeds = (start_speed if k == indices[0] else 0.0, end_speed if k == indices[-1] else 0.0)
        return time_piece(path.pieces[k], kept, *slacks, engine, speeds)

    for k, profile in zip(indices, in_threads(profile_of, indices, ahead=len(indices)), strict=True):
        if isinstance(profile, Failure):
            return refusal(path, k, profile)
        profiles.append(profile)
        done += path.pieces[k].length
        progress("timing", done / total, f"piece {len(profiles)} of {len(indices)}")
    if cubic or limit_jerk or moving_ends:
        smoothed = repaired_laws(profiles, machine, dwells, jerk_options if limit_jerk else None)
        if isinstance(smoothed, NotRepaired):
            return refusal(path, indices[smoothed.index], smoothed.failure)
        profiles, laws, firsts = smoothed.profiles, smoothed.laws, smoothed.firsts
    else:
        plain = [MotionLaw.from_profile(profile.s, profile.x) for profile in profiles]
        firsts = laws = [law.stretched(whole_periods(law.duration, period)) for law in plain]
    profile = _profile(path, indices, profiles, laws, dwells, smooth=limit_jerk)
    reports = (slowed(path, *both, period) for both in zip(indices, firsts, laws, strict=True)) if limit_jerk else ()
    slower = tuple(report for report in reports if report is not None)
    return Trajectory(path, tuple(indices), tuple(laws), profile, dwells, slower, added)


def _check_options(margins: dict[str, float], speeds: dict[str, float]) -> None:
    """Raise InputError for margins or speeds out of range."""
    for name, margin in margins.items():
        if not 0.0 < margin < 0.5:
            raise InputError("a margin is a fraction of a limit", key=name, value=margin, expected="0 < margin < 0.5")
    for name, speed in speeds.items():
        if not 0.0 <= speed < np.inf:
            raise InputError("must be a speed", key=name, value=speed, expected="m/s, 0 or more")


def _check_rows(path: LegPathLike, dwells: Floats, period: float) -> None:
    """Raise InputError where the feeds alone make a program of more rows than memory has room for."""
    steps = (np.diff(piece.section_ends, prepend=0.0) / piece.section_feeds for piece in path.pieces)
    rows = (sum(float(step.sum()) for step in steps) + float(dwells.sum())) / period
    if rows > MOST_ROWS:
        what = f"the program would have {rows:.3g} rows of {period:g} s"
        raise InputError(what, key="feed", expected=f"at most {MOST_ROWS:.0e} rows", remedy="a faster feed")


def _check_standing(start: float, end: float, dwells: Floats) -> None:
    """Raise InputError for a start or end speed next to a dwell; dwells (L + 1,)."""
    for name, speed, dwell in (("start_speed", start, dwells[0]), ("end_speed", end, dwells[-1])):
        if speed > 0.0 and dwell > 0.0:
            what = f"the path stands there for {dwell:.6g} s"
            raise InputError(what, key=name, value=speed, expected="0 m/s", remedy="or take the dwell out of the path")


def dwells_of(path: LegPathLike, indices: list[int], period: float) -> Floats:
    """Return the seconds (L + 1,) of dwell before each moving piece and after the last, in whole periods."""
    owner = np.searchsorted(indices, np.arange(len(path.pieces) + 1), side="left")
    periods = np.bincount(owner, np.ceil(np.asarray(path.dwells) / period - 1e-9), len(indices) + 1)
    return np.asarray(periods * period, dtype=np.float64)


def _profile(
    path: LegPathLike,
    indices: list[int],
    profiles: list[PieceProfile],
    laws: list[MotionLaw],
    dwells: Floats,
    *,
    smooth: bool,
) -> Profile:
    starts = dwells[0] + np.concatenate([[0.0], np.cumsum([law.duration for law in laws] + dwells[1:])])
    times = [np.interp(p.s, law.stations, law.times) for p, law in zip(profiles, laws, strict=True)]
    active = [p.active(law if smooth else None) for p, law in zip(profiles, laws, strict=True)]
    profile = Profile(
        times=np.concatenate([start + t for start, t in zip(starts, times, strict=False)]),
        stations=np.concatenate([float(path.starts[k]) + p.s for k, p in zip(indices, profiles, strict=True)]),
        speeds=np.concatenate([law(t, 1) for law, t in zip(laws, times, strict=True)]),
        active=np.concatenate([a for a, _ in active]),
        shares=np.concatenate([share for _, share in active]),
        constraint_names=profiles[0].limits.names,
    )
    return profile.extended(0.0, float(starts[-1]))
