"""Time laws whose limits hold on the sampled program, as the controller joins its setpoints.

A law that keeps the limits at every instant does not yet keep them so: the cubic spline through its setpoints
overshoots where accelerations jump (by 27 % at a reversal from full acceleration to full braking) or jerks do.
What the controller will make is measured exactly, and where it exceeds a limit the plan is eased around that
place and solved again. After a bounded number of rounds the pieces that still exceed are run slower.

Laws limited in jerk are taken as they are. Others, for a cubic controller, are averaged over a few periods first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.arrays import Floats
from pentapod.geometry.interpolant import Interpolant
from pentapod.machine.machine import Machine
from pentapod.timing.given_speeds import law_between, whole_periods
from pentapod.timing.law import MotionLaw
from pentapod.timing.piece import PieceProfile
from pentapod.timing.run_in import run_in
from pentapod.timing.stages import Failure

WINDOW_PERIODS = 4
"""Periods over which a law with steps of acceleration is averaged: fewer overshoot, more cost time at each stop."""

JERK_GOAL = 1.04
"""Share of the jerk limit that a sampled program may use: where jerk steps, the spline through setpoints rings."""

_EASINGS = 8
_SLOWINGS = 12
_GOAL = 0.999
_EXTRA = 0.99
_EDGE = 32
"""Rows beyond which the spline through all rows has forgotten a row: 0.27 of its say is left from each to the next."""

_EXTRA_PER_ROUND = 0.01
"""Each easing moves the setpoints against the corners of the path: a place that comes back gets more room."""


@dataclass(frozen=True)
class Unmended:
    """The index of the profile that could not be mended, and why."""

    index: int
    failure: Failure


@dataclass(frozen=True, eq=False)
class _Timed:
    """A piece's profile, by which factor its law is run slower, and whether its jerk is limited.

    before, after: periods for which the machine stands at its ends; between two pieces they count with the first.
    window: periods over which a law with steps of acceleration is averaged.
    """

    profile: PieceProfile
    slower: float
    smooth: bool
    period: float
    before: int
    after: int
    window: int

    @cached_property
    def found(self) -> MotionLaw | Failure:
        """The law of the piece, in whole periods; a Failure where it cannot have the speeds that are given at its ends.

        Where the passes find no law that keeps the jerk limits, the averaged one is run as slowly as they ask.
        """
        if self.profile.moving:
            return law_between(self.profile, self.slower, self.period, smooth=self.smooth)
        law = self.profile.smooth_law() if self.smooth else None
        if not isinstance(law, MotionLaw):
            law = MotionLaw.from_profile(self.profile.s, self.profile.x)
            law = law.smoothed(self.window * self.period) if self.window else law
        return law.stretched(whole_periods(law.duration * self.slower, self.period))

    @property
    def law(self) -> MotionLaw:
        """The law, where it was found."""
        return cast("MotionLaw", self.found)

    @cached_property
    def whole_rows(self) -> Floats:
        """Legs and station (rows, 6) of the piece's setpoints, metres, and where they count tip and axis (rows, 12)."""
        return self.rows(0.0)

    def rows(self, phase: float) -> Floats:
        """Return the rows as if they came later by `phase` periods, the last one at the end."""
        law, piece = self.law, self.profile.piece
        count = self.before + round(law.duration / self.period) + self.after
        s = self.stations(count + 1, phase)
        s[-1] = law.length
        tool = piece.pose(s) if self.profile.limits.tool.given() else ()
        return np.column_stack([piece(s, 0), s, *tool])

    def run_in(self, *, start: bool) -> Floats:
        """Return rows (n, 6 or 12) that come to the start, or leave the end, at the speed that is given there."""
        profile = self.profile
        speed = (profile.x_start if start else profile.x_end) ** 0.5
        return run_in(profile.piece, speed, self.period, start=start, tool=bool(profile.limits.tool.given()))

    def stations(self, count: int, phase: float = 0.0) -> Floats:
        """Return the stations (count,) of the rows, `phase` periods later."""
        return self.law((np.arange(count) - self.before + phase) * self.period)


@dataclass(frozen=True, eq=False)
class _Use:
    """Shares (rows,) of the limits around the setpoints of a piece: of rates or feed, of accelerations, of jerks."""

    speed: Floats
    acceleration: Floats
    jerk: Floats

    @property
    def exceeds(self) -> bool:
        """Whether a share is above what is aimed at."""
        return max(float(self.speed.max()), float(self.acceleration.max())) > _GOAL or self.jerk.max() > JERK_GOAL

    @property
    def slowing(self) -> float:
        """By which factor the piece must be run slower for every share to be 1 at most."""
        speed, acceleration, jerk = (float(y.max()) for y in (self.speed, self.acceleration, self.jerk))
        return max(speed, acceleration**0.5, (jerk / JERK_GOAL) ** (1.0 / 3.0))

    def worst(self, other: _Use) -> _Use:
        """Return the larger shares of two."""
        return _Use(
            np.maximum(self.speed, other.speed),
            np.maximum(self.acceleration, other.acceleration),
            np.maximum(self.jerk, other.jerk),
        )


def sampled_laws(
    profiles: list[PieceProfile], machine: Machine, dwells: Floats, *, smooth: bool
) -> tuple[list[PieceProfile], list[MotionLaw]] | Unmended:
    """Return profiles and laws whose setpoints keep the machine's limits and the feeds, as they are joined.

    dwells (P + 1,): seconds of standing before each piece, and after the last. smooth: jerks are limited too.
    """
    period = machine.controller.period
    stood = np.rint(dwells / period).astype(int).tolist()
    window = WINDOW_PERIODS if smooth or machine.controller.interpolation == "cubic" else 0
    timed = [
        _Timed(profile, 1.0, smooth, period, stood[0] if k == 0 else 0, stood[k + 1], window)
        for k, profile in enumerate(profiles)
    ]
    uses: list[_Use | None] = [None] * len(timed)
    exceeding: list[int] = []
    for attempt in range(_EASINGS + _SLOWINGS):
        for k, piece in enumerate(timed):
            if isinstance(piece.found, Failure):
                return Unmended(k, piece.found)
        measured = _uses(timed, machine, smooth, uses)
        exceeding = [k for k, use in enumerate(measured) if use.exceeds]
        if not exceeding:
            return [piece.profile for piece in timed], [piece.law for piece in timed]
        uses = _untouched(timed, measured, exceeding)
        for k in exceeding:
            use = measured[k]
            if attempt < _EASINGS:
                # Easing shifts all later setpoints against the path: ease for the rows between as well.
                use = use.worst(_use_between(timed[k], machine, smooth))
                eased = _eased(
                    timed[k].profile, timed[k].stations(len(use.speed)), use, _EXTRA - attempt * _EXTRA_PER_ROUND
                )
                if isinstance(eased, Failure):
                    return Unmended(k, eased)
                timed[k] = replace(timed[k], profile=eased)
            else:
                timed[k] = replace(timed[k], slower=timed[k].slower * use.slowing / _EXTRA)
    return Unmended(exceeding[0], Failure(-1, "the sampled program exceeds a limit however slowly it is run"))


def _uses(timed: list[_Timed], machine: Machine, smooth: bool, known: list[_Use | None]) -> list[_Use]:
    """Return what each piece uses of the limits; what is known is not measured again."""
    uses: list[_Use] = []
    for k, (piece, same) in enumerate(zip(timed, known, strict=True)):
        if same is not None:
            uses.append(same)
        else:
            before, after = _last_rows(timed[:k]), _first_rows(timed[k + 1 :])
            if k == 0 and piece.profile.x_start > 0.0:
                before = piece.run_in(start=True)
            if k == len(timed) - 1 and piece.profile.x_end > 0.0:
                after = piece.run_in(start=False)
                after[:, 5] -= piece.law.length
            if len(before):
                before[:, 5] -= before[-1, 5]
            if len(after):
                after[:, 5] += piece.law.length
            rows = np.concatenate([r for r in (before[:-1], piece.whole_rows, after[1:]) if len(r)])
            uses.append(_use(piece, rows, machine, smooth, max(len(before) - 1, 0)))
    return uses


def _use(piece: _Timed, rows: Floats, machine: Machine, smooth: bool, first: int = 0) -> _Use:
    """Return what a piece uses of the limits where it has the rows (n, 6) from `first` on."""
    count = len(piece.whole_rows) - 1
    interpolation = machine.controller.interpolation
    motion = Interpolant.through(rows[:, :6], machine.controller.period, interpolation)
    here, legs, limits = slice(first, first + count), machine.legs, piece.profile.limits
    hard = (motion.accelerations[first : first + count + 1, :5] / legs.max_acceleration).max(axis=1)
    fast = (motion.rates[here, :5] / legs.max_velocity).max(axis=1)
    jolt = (motion.jerks[here, :5] / legs.max_jerk).max(axis=1) * float(smooth)
    # Against the feeds themselves: the plan's margin is there to be used up.
    speed = limits.tip_speed(piece.profile.piece, rows[first : first + count + 1, 5])[0] / limits.feed_fraction
    fast = np.maximum(fast, motion.rates[here, 5] / np.minimum(speed[:-1], speed[1:]))
    if limits.tool.given():
        tool = machine.tool_limits
        tip, axis = (Interpolant.through(rows[:, k : k + 3], motion.period, interpolation) for k in (6, 9))
        pushes = np.linalg.norm(tip.second, axis=1) / tool.max_tip_acceleration
        pushes = np.maximum(pushes, axis.turn_accelerations / tool.max_axis_acceleration)
        hard = np.maximum(hard, pushes[first : first + count + 1])
        # A bound, by the hull of the coefficients.
        fast = np.maximum(fast, np.linalg.norm(axis.steps, axis=1).max(axis=1)[here] / tool.max_axis_velocity)
        jolt = np.maximum(jolt, tip.jerk_lengths[here] / tool.max_tip_jerk * float(smooth))
    return _Use(_at_rows(fast), hard, _at_rows(jolt))


def _use_between(piece: _Timed, machine: Machine, smooth: bool) -> _Use:
    """Return what a piece would use by rows halfway between its own; nothing near ends that move, for there it goes on.

    Those rows begin and end at rest.
    """
    use, ends = _use(piece, piece.rows(0.5), machine, smooth), (piece.profile.x_start, piece.profile.x_end)
    rows = np.arange(len(use.speed))
    known = ((rows >= _EDGE) | (ends[0] == 0.0)) & ((rows < len(rows) - _EDGE) | (ends[1] == 0.0))
    return _Use(*(np.where(known, shares, 0.0) for shares in (use.speed, use.acceleration, use.jerk)))


def _last_rows(timed: list[_Timed]) -> Floats:
    """Return the last _EDGE + 1 rows (n, 6 or 12) of pieces that follow each other, all where there are fewer."""
    rows = np.empty((0, 6))
    for piece in reversed(timed):
        if len(rows) > _EDGE:
            break
        rows[:, 5] += piece.law.length
        rows = np.concatenate([piece.whole_rows, rows[1:]]) if len(rows) else piece.whole_rows.copy()
    return rows[-_EDGE - 1 :].copy()


def _first_rows(timed: list[_Timed]) -> Floats:
    """Return the first _EDGE + 1 rows (n, 6 or 12) of pieces that follow each other, all where there are fewer."""
    rows, length = np.empty((0, 6)), 0.0
    for piece in timed:
        if len(rows) > _EDGE:
            break
        following = piece.whole_rows[: _EDGE + 1].copy()
        following[:, 5] += length
        rows = np.concatenate([rows[:-1], following]) if len(rows) else following
        length += piece.law.length
    return rows[: _EDGE + 1].copy()


def _untouched(timed: list[_Timed], uses: list[_Use], changed: list[int]) -> list[_Use | None]:
    """Return the uses of the pieces that are not changed and from which no changed one is within _EDGE rows."""
    ends = np.cumsum([len(piece.whole_rows) - 1 for piece in timed])
    begins = np.concatenate([[0], ends[:-1]])
    near = np.zeros(len(timed), dtype=bool)
    for k in changed:
        near |= (begins <= ends[k] + _EDGE) & (ends >= begins[k] - _EDGE)
    return [None if touched else use for touched, use in zip(near.tolist(), uses, strict=True)]


def _at_rows(shares: Floats) -> Floats:
    """Return for each row the larger share of the intervals that it ends."""
    return np.maximum(np.append(shares, 0.0), np.append(0.0, shares))


def _eased(profile: PieceProfile, rows: Floats, use: _Use, room: float) -> PieceProfile | Failure:
    """Return the profile with limits lowered around the rows (stations) where a share exceeds the goal."""
    speed, acceleration = (_factors(profile.s, rows, share, _GOAL, room) for share in (use.speed, use.acceleration))
    return profile.eased(acceleration, speed, _factors(profile.s, rows, use.jerk, JERK_GOAL, room * JERK_GOAL))


def _factors(s: Floats, rows: Floats, shares: Floats, goal: float, room: float) -> Floats:
    """Return factors (N + 1,) at gridpoints s from shares at rows (n,), spread over the smoothing window."""
    near = maximum_filter1d(shares, 2 * (WINDOW_PERIODS // 2 + 1) + 1)
    # From the rows on both sides of a gridpoint, and from the rows inside the stages that it ends.
    after = np.clip(np.searchsorted(rows, s), 1, len(rows) - 1)
    worst = np.maximum(near[after - 1], near[after])
    stage = np.clip(np.searchsorted(s, rows, side="right") - 1, 0, len(s) - 2)
    np.maximum.at(worst, stage, near)
    np.maximum.at(worst, stage + 1, near)
    return np.where(worst > goal, room / np.maximum(worst, goal), 1.0)
