"""Repair of limit violations: time laws whose setpoints keep the limits as the controller interpolates them.

A law that keeps the limits at every instant does not yet do so: the cubic spline through its setpoints overshoots where
accelerations jump (by 27 % at a reversal from full acceleration to full braking) or jerks do. What the controller will
make is measured exactly. Of a jerk-limited law the limits are lowered where it exceeds them, and it is solved again
there (`jerk/tightening.py`); what is left is run slower (`slowdown.py`). Other laws, for a cubic controller, are
averaged over a few periods, and the profile is solved again with lower limits about such places. After a bounded number
of rounds the pieces that still exceed limits are run slower as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.numerics.threads import in_threads
from pentapod.timing.jerk.options import JerkOptions
from pentapod.timing.pieces.boundary_speeds import law_between, whole_periods
from pentapod.timing.pieces.piece import PieceProfile
from pentapod.timing.pieces.setpoints import EDGE, GOAL, LimitShares, Setpoints, measured, unaffected
from pentapod.timing.pieces.slowdown import slowed_at, slowed_locally
from pentapod.timing.pieces.violations import excess
from pentapod.timing.time_law.motion_law import MotionLaw, SpeedNodes
from pentapod.timing.time_law.slowed import most_lost
from pentapod.timing.topp.stages import Failure

WINDOW_PERIODS = 4
"""Periods over which a law with steps of acceleration is averaged: fewer overshoot, more cost time at stops."""


@dataclass(frozen=True)
class RepairOptions:
    """Repair of the setpoints of all pieces."""

    local_rounds: int = 8  # how often laws are changed about places that exceed limits
    uniform_rounds: int = 12  # how often pieces are run slower as a whole after that
    extra: float = 1.003  # factor by which they are slower than the excess asks for
    most_slower: float = 20.0  # factor on a piece's first duration beyond which it is refused
    room: float = 0.99  # share of a limit that is aimed at in the first round
    room_per_round: float = 0.01  # by which it decreases with each round: new setpoints fall elsewhere on the corners
    spread_rows: int = 3  # rows on either side of one that exceeds limits for which these are lowered too


DEFAULTS = RepairOptions()

_EVERYWHERE = "the sampled program exceeds a limit however slowly it is run"
_SLOW = "the sampled program keeps the limits only if it runs {:.3g} times slower than the first time law"


@dataclass(frozen=True)
class NotRepaired:
    """The index of the profile that could not be repaired, and why."""

    index: int
    failure: Failure


@dataclass(frozen=True, eq=False)
class RepairedLaws:
    """The profiles of pieces, their laws, and the laws before the repair."""

    profiles: list[PieceProfile]
    laws: list[MotionLaw]
    firsts: list[MotionLaw]


@dataclass(frozen=True, eq=False)
class _Plan:
    """A piece's profile, what its law is made of, and the factor by which it is run slower; first: its first law.

    nodes: of a jerk-limited law; None where it is averaged from the profile, over `window` periods.
    """

    profile: PieceProfile
    nodes: SpeedNodes | None
    slower: float
    first: MotionLaw
    window: int
    options: RepairOptions

    def law(self, period: float) -> MotionLaw | Failure:
        """Return the law, in whole periods; a Failure where it cannot have the speeds that are given at its ends.

        Or where it lasts many times as long as the first one, which is told before its setpoints are made: their number
        grows with its duration.
        """
        law = self._law(period)
        longest = self.options.most_slower * self.first.duration + (self.window + 1) * period
        if isinstance(law, Failure) or law.duration <= longest:
            return law
        reason = _SLOW.format(law.duration / self.first.duration)
        return Failure(-1, reason, station=most_lost(self.first, law))

    def _law(self, period: float) -> MotionLaw | Failure:
        if self.profile.moving:
            return law_between(self.profile, self.slower, period, self.nodes)
        law = MotionLaw.from_profile(self.profile.s, self.profile.x) if self.nodes is None else self.nodes.law()
        if self.nodes is None and self.window:
            law = law.smoothed(self.window * period)
        return law.stretched(whole_periods(law.duration * self.slower, period))


def repaired_laws(
    profiles: Sequence[PieceProfile],
    machine: Machine,
    dwells: Floats,
    jerk_options: JerkOptions | None,
    options: RepairOptions = DEFAULTS,
) -> RepairedLaws | NotRepaired:
    """Return profiles and laws whose setpoints keep the machine's limits and the feeds, as the controller joins them.

    dwells (P + 1,): seconds of standing before each piece, and after the last. jerk_options: None where jerks are not
    limited.
    """
    period, jerk_limited = machine.controller.period, jerk_options is not None
    stood = np.rint(dwells / period).astype(int).tolist()

    def timed(k: int, plan: _Plan | Failure) -> tuple[_Plan, Setpoints] | Failure:
        if isinstance(plan, Failure):
            return plan
        law = plan.law(period)
        if isinstance(law, Failure):
            return law
        before = stood[0] if k == 0 else 0
        return plan, Setpoints(plan.profile, law, jerk_limited, period, before, stood[k + 1])

    def first(k: int) -> tuple[_Plan, Setpoints] | Failure:
        return timed(k, _planned(profiles[k], machine, jerk_options, options))

    current: list[tuple[_Plan, Setpoints]] = []
    for k, found in enumerate(in_threads(first, range(len(profiles)), ahead=len(profiles))):
        if isinstance(found, Failure):
            return NotRepaired(k, found)
        current.append(found)
    known: list[LimitShares | None] = [None] * len(current)
    k, worst = 0, None
    for attempt in range(options.local_rounds + options.uniform_rounds):
        pieces = [piece for _, piece in current]
        shares = measured(pieces, machine, known)
        exceeding = [k for k, share in enumerate(shares) if share.exceeds]
        if not exceeding:
            plans = [plan for plan, _ in current]
            return RepairedLaws([p.profile for p in plans], [piece.law for piece in pieces], [p.first for p in plans])
        known = unaffected(pieces, shares, exceeding)
        worst = _worst_station(pieces[exceeding[0]], shares[exceeding[0]])
        for k in exceeding:
            found = timed(k, _changed(current[k][0], pieces[k], shares[k], machine, attempt))
            if isinstance(found, Failure):
                return NotRepaired(k, found)
            current[k] = found
        k = exceeding[0]
    return NotRepaired(k, Failure(-1, _EVERYWHERE, station=worst))


def _planned(
    profile: PieceProfile, machine: Machine, jerk_options: JerkOptions | None, options: RepairOptions
) -> _Plan | Failure:
    """Return the first plan of a piece, a Failure where it cannot have the speeds that are given at its ends.

    Where no law is found that keeps the jerk limits, the averaged one is run as slowly as they ask.
    """
    window = WINDOW_PERIODS if jerk_options is not None or machine.controller.interpolation == "cubic" else 0
    if jerk_options is not None:
        from pentapod.timing.pieces.jerk_profile import jerk_limited_profile  # noqa: PLC0415  (compiled: loaded where it is used)

        found = jerk_limited_profile(profile, partial(excess, profile, machine), jerk_options)
        if not isinstance(found, Failure):
            first = found.nodes.law()
            # The first law is the one before limits were lowered where setpoints exceeded them.
            first = first.stretched(max(first.duration - found.longer, 0.5 * first.duration))
            return _Plan(profile, slowed_locally(profile, found, machine), 1.0, first, window, options)
        if profile.moving:
            return found
    return _Plan(profile, None, 1.0, MotionLaw.from_profile(profile.s, profile.x), window, options)


def _changed(plan: _Plan, piece: Setpoints, shares: LimitShares, machine: Machine, attempt: int) -> _Plan | Failure:
    """Return the plan changed where its setpoints exceed limits: slower about there, with lower limits, or slower."""
    options, period = plan.options, piece.period
    if attempt < options.local_rounds and plan.nodes is not None:
        law, raw, bad = piece.law, plan.nodes.law(), np.flatnonzero(shares.slowing > 1.0)
        at = np.clip((bad - piece.before) * period, 0.0, law.duration) * (raw.duration / law.duration)
        at = np.asarray(at, dtype=np.float64)
        return replace(plan, nodes=slowed_at(plan.nodes, raw, plan.profile, at, shares.at(bad), period)[0])
    if attempt < options.local_rounds and not piece.jerk_limited:
        again = _with_lower_limits(piece, shares, machine, options, attempt)
        return again if isinstance(again, Failure) else replace(plan, profile=again)
    slower = plan.slower * float(shares.slowing.max()) * options.extra
    if slower > options.most_slower:
        return Failure(-1, _SLOW.format(slower), station=_worst_station(piece, shares))
    return replace(plan, slower=slower)


def _worst_station(piece: Setpoints, shares: LimitShares) -> float:
    """Return the station of the row that exceeds limits most."""
    return float(piece.law([(int(shares.slowing.argmax()) - piece.before) * piece.period])[0])


def _with_lower_limits(
    piece: Setpoints, shares: LimitShares, machine: Machine, options: RepairOptions, attempt: int
) -> PieceProfile | Failure:
    """Return the profile of a piece solved again with lower limits around the rows where a share exceeds the goal."""
    # Lower limits shift all later setpoints against the path: the rows halfway between count as well.
    profile, count = piece.profile, piece.count
    between = piece.shares(piece.rows(0, count, 0.5), machine, 0, count)
    between = between.without_edges(EDGE * (profile.x_start > 0.0), EDGE * (profile.x_end > 0.0))
    rows, room = piece.rows(0, count).stations, options.room - attempt * options.room_per_round
    speed, acceleration = (
        _scales(profile.s, rows, np.maximum(here, there), room, options.spread_rows)
        for here, there in ((shares.speed, between.speed), (shares.acceleration, between.acceleration))
    )
    return profile.rescaled(acceleration, speed)


def _scales(s: Floats, rows: Floats, shares: Floats, room: float, spread: int) -> Floats:
    """Return factors (N + 1,) on limits at gridpoints s from shares at rows (n,), each spread to its neighbours."""
    near = maximum_filter1d(shares, 2 * spread + 1)
    # From the rows on both sides of a gridpoint, and from the rows inside the stages that it ends.
    after = np.clip(np.searchsorted(rows, s), 1, len(rows) - 1)
    worst = np.maximum(near[after - 1], near[after])
    stage = np.clip(np.searchsorted(s, rows, side="right") - 1, 0, len(s) - 2)
    np.maximum.at(worst, stage, near)
    np.maximum.at(worst, stage + 1, near)
    return np.where(worst > GOAL, room / np.maximum(worst, GOAL), 1.0)
