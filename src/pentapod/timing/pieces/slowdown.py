"""Local slowing of jerk-limited laws where their setpoints still exceed a limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.pieces.piece import PieceProfile
from pentapod.timing.pieces.setpoints import LimitShares
from pentapod.timing.pieces.violations import law_times, violations
from pentapod.timing.time_law.motion_law import MotionLaw, SpeedNodes

if TYPE_CHECKING:
    from pentapod.timing.jerk.jerk_limited import JerkProfile


@dataclass(frozen=True)
class SlowdownOptions:
    """Local slowing."""

    rounds: int = 30  # how often places that exceed limits are run slower
    extra: float = 0.002  # share by which they are slower than the excess asks for: the spline overshoots beside them
    reaches: float = 4.0  # width in the seconds in which jerk changes velocities by what they are: less exceeds jerks
    least_periods: int = 12  # smallest width in periods, on either side


DEFAULTS = SlowdownOptions()


def slowed_locally(
    profile: PieceProfile, found: JerkProfile, machine: Machine, options: SlowdownOptions = DEFAULTS
) -> SpeedNodes:
    """Return the law of a piece whose setpoints keep the limits at any phase; given end speeds stay.

    Places that exceed limits are run slower, round after round. Running the whole slower is taken where it costs less.
    """
    nodes = given = found.nodes
    if not found.exceeds:
        return given
    law = first = given.law()
    between: Floats | None = None
    uniform = 1.0
    for _ in range(options.rounds):
        at, shares = violations(profile, law, machine, between)
        if not len(at):
            break
        uniform = uniform if uniform > 1.0 else float(shares.slowing.max())
        nodes, changed = slowed_at(nodes, law, profile, at, shares, machine.controller.period, options)
        law = nodes.law()
        between = law_times(law, changed)
    if not profile.moving and law.duration > first.duration * uniform * (1.0 + options.extra):
        slower = 1.0 / (uniform * (1.0 + options.extra)) ** 2
        return SpeedNodes(given.s, given.x * slower, given.slope * slower)
    return nodes


def slowed_at(
    nodes: SpeedNodes,
    law: MotionLaw,
    profile: PieceProfile,
    at: Floats,
    shares: LimitShares,
    period: float,
    options: SlowdownOptions = DEFAULTS,
) -> tuple[SpeedNodes, Floats]:
    """Return a law slower about times (n,) of rows that exceed limits, and the stations (2, k) between which it is.

    Given end speeds stay.
    """
    at, depths, widths = _worst_places(at, shares, period, options)
    for moves, room in ((profile.x_start > 0.0, at), (profile.x_end > 0.0, law.duration - at)):
        if moves:
            widths = np.minimum(widths, np.maximum(room, period))
    return nodes.slower(at, depths, widths), law(np.stack([at - widths, at + widths]))


def _worst_places(
    at: Floats, shares: LimitShares, period: float, options: SlowdownOptions
) -> tuple[Floats, Floats, Floats]:
    """Return times, depths and widths (k,) of slowings, from times (n,) of rows that exceed limits.

    Of rows near to each other the worst counts: what is left beside it is for the next round.
    """
    order = np.argsort(at, kind="stable")
    at, slowing = at[order], shares.slowing[order]
    widths = np.maximum(options.reaches * shares.reach[order], options.least_periods * period)
    cell = np.floor(at / float(np.median(widths)))
    first = np.concatenate([[0], np.flatnonzero(np.diff(cell)) + 1])
    most = np.maximum.reduceat(slowing, first)
    own = np.repeat(most, np.diff(np.append(first, len(at))))
    peak = np.flatnonzero(slowing == own)
    peak = peak[np.concatenate([[True], np.diff(cell[peak]) > 0.0])]
    # A cell beside one that is worse waits.
    beside = np.diff(cell[peak]) == 1.0
    level = slowing[peak]
    waits = np.append(False, beside & (level[1:] < level[:-1])) | np.append(beside & (level[:-1] <= level[1:]), False)
    peak = peak[~waits]
    return at[peak], 1.0 - 1.0 / (slowing[peak] * (1.0 + options.extra)), widths[peak]
