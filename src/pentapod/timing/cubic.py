"""Time laws for controllers that join setpoints by a cubic spline.

The spline overshoots where accelerations jump: by 27 % at a reversal from full acceleration to full
braking. So the law is averaged over a few periods, which makes accelerations continuous; then the spline that
the controller will make is measured exactly, and where it exceeds a limit the plan is eased around that
place and solved again. After a bounded number of rounds the pieces that still exceed are run slower.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.interpolant import cubic_extrema
from pentapod.timing.law import MotionLaw
from pentapod.timing.piece import PieceProfile
from pentapod.timing.stages import Failure

WINDOW_PERIODS = 4
"""Periods over which the law is averaged: fewer leave overshoot, more cost time at each stop."""

_EASINGS = 8
_SLOWINGS = 6
_GOAL = 0.999
_EXTRA = 0.99
_EXTRA_PER_ROUND = 0.01
"""Each easing moves the setpoints against the corners of the path: a place that comes back gets more room."""


@dataclass(frozen=True)
class Unmended:
    """The index of the profile that could not be mended, and why."""

    index: int
    failure: Failure


@dataclass(frozen=True, eq=False)
class _Timed:
    """A piece's profile, and by which factor its law is run slower."""

    profile: PieceProfile
    slower: float

    def law(self, period: float) -> MotionLaw:
        law = MotionLaw.from_profile(self.profile.s, self.profile.x).smoothed(WINDOW_PERIODS * period)
        return law.stretched(whole_periods(law.duration * self.slower, period))


def whole_periods(duration: float, period: float) -> float:
    """Return the duration rounded up to a whole number of periods, at least one."""
    return max(1.0, float(np.ceil(duration / period - 1e-9))) * period


def smooth_laws(
    profiles: list[PieceProfile], machine: Machine
) -> tuple[list[PieceProfile], list[MotionLaw]] | Unmended:
    """Return profiles and laws whose cubic interpolant keeps the machine's limits and the feeds."""
    period = machine.controller.period
    timed = [_Timed(profile, 1.0) for profile in profiles]
    exceeding: list[int] = []
    for attempt in range(_EASINGS + _SLOWINGS):
        laws = [piece.law(period) for piece in timed]
        shares = _shares(timed, laws, machine)
        exceeding = [
            k for k, (speed, acceleration) in enumerate(shares) if max(speed.max(), acceleration.max()) > _GOAL
        ]
        if not exceeding:
            return [piece.profile for piece in timed], laws
        if attempt < _EASINGS:
            # Easing shifts all later setpoints against the path: ease for the rows between as well.
            between = _shares(timed, laws, machine, 0.5)
            shares = [(np.maximum(a[0], b[0]), np.maximum(a[1], b[1])) for a, b in zip(shares, between, strict=True)]
        for k in exceeding:
            if attempt < _EASINGS:
                rows = laws[k](np.arange(len(shares[k][0])) * period)
                eased = _eased(timed[k].profile, rows, shares[k], _EXTRA - attempt * _EXTRA_PER_ROUND)
                if isinstance(eased, Failure):
                    return Unmended(k, eased)
                timed[k] = replace(timed[k], profile=eased)
            else:
                worst = max(float(shares[k][0].max()), float(np.sqrt(shares[k][1].max())))
                timed[k] = replace(timed[k], slower=timed[k].slower * worst / _EXTRA)
    return Unmended(exceeding[0], Failure(-1, "the cubic interpolant exceeds a limit however slowly it is run"))


def _shares(
    timed: list[_Timed], laws: list[MotionLaw], machine: Machine, phase: float = 0.0
) -> list[tuple[Floats, Floats]]:
    """Return for each piece the shares (rows,) of the rates or the feed, and of the accelerations.

    phase: by how many periods the rows come later than the program's.
    """
    period = machine.controller.period
    counts = [round(law.duration / period) for law in laws]
    columns: list[Floats] = []
    speeds: list[Floats] = []
    start = 0.0
    for piece, law, count in zip(timed, laws, counts, strict=True):
        s = law((np.arange(count + 1) + phase) * period)
        s[-1] = law.length
        columns.append(np.column_stack([piece.profile.piece(s, 0), start + s])[1 if columns else 0 :])
        limits = piece.profile.limits
        # Against the feeds themselves: the plan's margin is there to be used up.
        speeds.append(limits.tip_speed(piece.profile.piece, s)[0] / limits.feed_fraction)
        start += law.length
    rates, accelerations = cubic_extrema(np.concatenate(columns), period)
    hard = (accelerations[:, :5] / machine.legs.max_acceleration).max(axis=1)
    legs_fast = (rates[:, :5] / machine.legs.max_velocity).max(axis=1)
    shares: list[tuple[Floats, Floats]] = []
    row = 0
    for speed, count in zip(speeds, counts, strict=True):
        feed = rates[row : row + count, 5] / np.minimum(speed[:-1], speed[1:])
        fast = np.maximum(legs_fast[row : row + count], feed)
        at_rows = np.maximum(np.append(fast, 0.0), np.append(0.0, fast))
        shares.append((at_rows, hard[row : row + count + 1]))
        row += count
    return shares


def _eased(profile: PieceProfile, rows: Floats, shares: tuple[Floats, Floats], room: float) -> PieceProfile | Failure:
    """Return the profile with limits lowered around the rows (stations) where a share exceeds the goal."""
    speed, acceleration = (_factors(profile.s, rows, share, room) for share in shares)
    return profile.eased(acceleration, speed)


def _factors(s: Floats, rows: Floats, shares: Floats, room: float) -> Floats:
    """Return factors (N + 1,) at gridpoints s from shares at rows (n,), spread over the smoothing window."""
    near = maximum_filter1d(shares, 2 * (WINDOW_PERIODS // 2 + 1) + 1)
    # From the rows on both sides of a gridpoint, and from the rows inside the stages that it ends.
    after = np.clip(np.searchsorted(rows, s), 1, len(rows) - 1)
    worst = np.maximum(near[after - 1], near[after])
    stage = np.clip(np.searchsorted(s, rows, side="right") - 1, 0, len(s) - 2)
    np.maximum.at(worst, stage, near)
    np.maximum.at(worst, stage + 1, near)
    return np.where(worst > _GOAL, room / np.maximum(worst, _GOAL), 1.0)
