"""Time laws whose setpoints keep the limits as the controller interpolates them.

A law that keeps the limits at every instant does not yet keep them so: the cubic spline through its setpoints
overshoots where accelerations jump (by 27 % at a reversal from full acceleration to full braking) or jerks do. What
the controller will make is measured exactly. Of a law limited in jerk the limits are lowered where it exceeds, and it
is solved anew there (`jerk_eased`); what is left is run slower (`mended`). Other laws, for a cubic controller, are
averaged over a few periods, and the plan is eased around such places and solved again. After a bounded number of
rounds the pieces that still exceed are run slower as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.pieces.boundary_speeds import law_between, whole_periods
from pentapod.timing.pieces.exceeding import over_limits
from pentapod.timing.pieces.mended import about, mended, worst_places
from pentapod.timing.pieces.piece import PieceProfile
from pentapod.timing.pieces.setpoints import EDGE, GOAL, Setpoints, Use, measured, untouched
from pentapod.timing.time_law.motion_law import MotionLaw, Stretchable
from pentapod.timing.time_law.slowed import most_lost
from pentapod.timing.topp.stages import Failure

WINDOW_PERIODS = 4
"""Periods over which a law with steps of acceleration is averaged: fewer overshoot, more cost time at each stop."""

MOST_SLOWER = 20.0
"""A piece that would last so many times as long as its first law is refused."""

_LOCAL = 8
_SLOWINGS = 12
_EXTRA = 1.003
_ROOM, _ROOM_PER_ROUND = 0.99, 0.01
"""Each easing moves the setpoints against the corners of the path: a place that comes back gets more room."""

_SPREAD = 3
"""Rows on either side of one that exceeds to which it spreads: the averaging's own, and one more."""

_EVERYWHERE = "the sampled program exceeds a limit however slowly it is run"
_SLOW = "the sampled program keeps the limits only {:.3g} times slower than the law it is made of"


@dataclass(frozen=True)
class Unmended:
    """The index of the profile that could not be mended, and why."""

    index: int
    failure: Failure


@dataclass(frozen=True, eq=False)
class Sampled:
    """The profiles of pieces, their laws, and the laws with which these began."""

    profiles: list[PieceProfile]
    laws: list[MotionLaw]
    firsts: list[MotionLaw]


@dataclass(frozen=True, eq=False)
class _Plan:
    """A piece's profile, what its law is made of, by which factor it is run slower; first: its first law.

    nodes: of a law limited in jerk; None where it is averaged from the profile, over `window` periods.
    """

    profile: PieceProfile
    nodes: Stretchable | None
    slower: float
    first: MotionLaw
    window: int

    @classmethod
    def of(cls, profile: PieceProfile, machine: Machine, window: int, *, smooth: bool) -> _Plan | Failure:
        """Return the plan of a piece, a Failure where it cannot have the speeds that are given at its ends.

        Where the passes find no law that keeps the jerk limits, the averaged one is run as slowly as they ask.
        """
        found = profile.smooth(partial(over_limits, profile, machine)) if smooth else None
        if not (found is None or isinstance(found, Failure)):
            first = MotionLaw.through(found.s, found.x, found.slope)
            # The first law is the one before limits were lowered where setpoints exceeded.
            first = first.stretched(max(first.duration - found.longer, 0.5 * first.duration))
            return cls(profile, mended(profile, found, machine), 1.0, first, window)
        if isinstance(found, Failure) and profile.moving:
            return found
        return cls(profile, None, 1.0, MotionLaw.from_profile(profile.s, profile.x), window)

    def law(self, period: float) -> MotionLaw | Failure:
        """Return the law, in whole periods; a Failure where it cannot have the speeds that are given at its ends.

        Or where it lasts many times as long as the first one, which is told before its setpoints are made: their number
        grows with its duration.
        """
        law = self._law(period)
        if isinstance(law, Failure) or law.duration <= MOST_SLOWER * self.first.duration + (self.window + 1) * period:
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

    def stretched(self, law: MotionLaw, use: Use, before: int, period: float) -> _Plan:
        """Return the plan run slower about the rows that exceed, `before` of which stand, of its law in periods."""
        if self.nodes is None:
            return self
        raw = self.nodes.law()
        bad = np.flatnonzero(use.slowing > 1.0)
        at = np.asarray(
            np.clip((bad - before) * period, 0.0, law.duration) * (raw.duration / law.duration), dtype=np.float64
        )
        places = worst_places(at, use.slowing[bad], use.reach[bad], period)
        return replace(self, nodes=about(self.nodes, raw, self.profile, *places, period)[0])


def sampled_laws(
    profiles: Sequence[PieceProfile], machine: Machine, dwells: Floats, *, smooth: bool
) -> Sampled | Unmended:
    """Return profiles and laws whose setpoints keep the machine's limits and the feeds, as they are joined.

    dwells (P + 1,): seconds of standing before each piece, and after the last. smooth: jerks are limited too.
    """
    period = machine.controller.period
    stood = np.rint(dwells / period).astype(int).tolist()
    window = WINDOW_PERIODS if smooth or machine.controller.interpolation == "cubic" else 0
    plans: list[_Plan] = []
    for k, profile in enumerate(profiles):
        plan = _Plan.of(profile, machine, window, smooth=smooth)
        if isinstance(plan, Failure):
            return Unmended(k, plan)
        plans.append(plan)

    def timed(k: int) -> Setpoints:
        return Setpoints(
            plans[k].profile, plans[k].law(period), smooth, period, stood[0] if k == 0 else 0, stood[k + 1]
        )

    pieces = [timed(k) for k in range(len(plans))]
    uses: list[Use | None] = [None] * len(plans)
    found: list[Use] = []
    exceeding: list[int] = []
    for attempt in range(_LOCAL + _SLOWINGS):
        for k, piece in enumerate(pieces):
            if isinstance(piece.found, Failure):
                return Unmended(k, piece.found)
        found = measured(pieces, machine, uses)
        exceeding = [k for k, use in enumerate(found) if use.exceeds]
        if not exceeding:
            return Sampled([p.profile for p in plans], [piece.law for piece in pieces], [p.first for p in plans])
        uses = untouched(pieces, found, exceeding)
        for k in exceeding:
            if attempt < _LOCAL and plans[k].nodes is not None:
                plans[k] = plans[k].stretched(pieces[k].law, found[k], pieces[k].before, period)
            elif attempt < _LOCAL and not smooth:
                again = _eased(pieces[k], found[k], machine, attempt)
                if isinstance(again, Failure):
                    return Unmended(k, again)
                plans[k] = replace(plans[k], profile=again)
            else:
                slower = plans[k].slower * float(found[k].slowing.max()) * _EXTRA
                plans[k] = replace(plans[k], slower=slower)
                if slower > MOST_SLOWER:
                    return Unmended(k, Failure(-1, _SLOW.format(slower), station=_worst(pieces[k], found[k])))
            pieces[k] = timed(k)
    k = exceeding[0]
    return Unmended(k, Failure(-1, _EVERYWHERE, station=_worst(pieces[k], found[k])))


def _worst(piece: Setpoints, use: Use) -> float:
    """Return the station of the row that exceeds most, as far as the piece's law is still the one that was measured."""
    return float(piece.law([(int(use.slowing.argmax()) - piece.before) * piece.period])[0])


def _eased(piece: Setpoints, use: Use, machine: Machine, attempt: int) -> PieceProfile | Failure:
    """Return the profile of a piece with limits lowered around the rows where a share exceeds the goal, solved anew."""
    # Easing shifts all later setpoints against the path: ease for the rows between as well.
    profile, count = piece.profile, piece.count
    between = piece.use(piece.rows(0, count, 0.5), machine, 0, count)
    between = between.without_edges(EDGE * (profile.x_start > 0.0), EDGE * (profile.x_end > 0.0))
    rows, room = piece.rows(0, count).stations, _ROOM - attempt * _ROOM_PER_ROUND
    speed, acceleration = (
        _factors(profile.s, rows, np.maximum(here, there), room)
        for here, there in ((use.speed, between.speed), (use.acceleration, between.acceleration))
    )
    return profile.eased(acceleration, speed)


def _factors(s: Floats, rows: Floats, shares: Floats, room: float) -> Floats:
    """Return factors (N + 1,) at gridpoints s from shares at rows (n,), spread over the smoothing window."""
    near = maximum_filter1d(shares, 2 * _SPREAD + 1)
    # From the rows on both sides of a gridpoint, and from the rows inside the stages that it ends.
    after = np.clip(np.searchsorted(rows, s), 1, len(rows) - 1)
    worst = np.maximum(near[after - 1], near[after])
    stage = np.clip(np.searchsorted(s, rows, side="right") - 1, 0, len(s) - 2)
    np.maximum.at(worst, stage, near)
    np.maximum.at(worst, stage + 1, near)
    return np.where(worst > GOAL, room / np.maximum(worst, GOAL), 1.0)
