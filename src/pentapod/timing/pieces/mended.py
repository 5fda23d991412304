"""Local slowing of jerk-limited laws where their setpoints would still exceed a limit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.pieces.exceeding import exceeding, law_times
from pentapod.timing.pieces.piece import PieceProfile
from pentapod.timing.time_law.motion_law import MotionLaw, Stretchable

if TYPE_CHECKING:
    from pentapod.timing.jerk.limited import SmoothProfile

_ROUNDS = 30
_EXTRA = 0.002
"""Share by which a place is slower than it would have to be: the spline through setpoints rings where it is not."""

_REACHES = 4.0
"""A law is slower about a place over so many times the seconds in which a jerk at its limit would change velocities by
what they are: over fewer, slowing down would itself take jerks beyond the limit."""

_LEAST_WIDTH = 12
"""Periods on either side over which a law is slower about a place, at least."""


def mended(profile: PieceProfile, smooth: SmoothProfile, machine: Machine) -> Stretchable:
    """Return the law of a piece with setpoints that keep the limits at any phase; ends that move are left as they are.

    Places that exceed are run slower, round after round, and what was found before stays. Running the whole slower
    is taken where it costs less.
    """
    nodes, period = Stretchable(smooth.s, smooth.x, smooth.slope), machine.controller.period
    if not smooth.exceeds:
        return nodes
    law = first = nodes.law()
    between: Floats | None = None
    uniform = 1.0
    for _ in range(_ROUNDS):
        at, use = exceeding(profile, law, machine, between)
        if not len(at):
            break
        uniform = uniform if uniform > 1.0 else float(use.slowing.max())
        places = worst_places(at, use.slowing, use.reach, period)
        nodes, changed = about(nodes, law, profile, *places, period)
        law = nodes.law()
        between = law_times(law, changed)
    if not profile.moving and law.duration > first.duration * uniform * (1.0 + _EXTRA):
        slower = 1.0 / (uniform * (1.0 + _EXTRA)) ** 2
        return Stretchable(smooth.s, smooth.x * slower, smooth.slope * slower)
    return nodes


def worst_places(at: Floats, slowing: Floats, reach: Floats, period: float) -> tuple[Floats, Floats, Floats]:
    """Return times, depths and widths of places to run slower, from times (n,) of rows that exceed, and by what.

    Of rows near to each other the worst counts: what is left beside it is for the next round.
    """
    order = np.argsort(at, kind="stable")
    at, slowing = at[order], slowing[order]
    widths = np.maximum(_REACHES * reach[order], _LEAST_WIDTH * period)
    near = float(np.median(widths))
    cell = np.floor(at / near)
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
    return at[peak], 1.0 - 1.0 / (slowing[peak] * (1.0 + _EXTRA)), widths[peak]


def about(
    nodes: Stretchable, law: MotionLaw, profile: PieceProfile, at: Floats, depths: Floats, widths: Floats, period: float
) -> tuple[Stretchable, Floats]:
    """Return a law slower about times (n,), and the stations (2, n) between which it is another one.

    Ends that move keep their speeds.
    """
    for moves, room in ((profile.x_start > 0.0, at), (profile.x_end > 0.0, law.duration - at)):
        if moves:
            widths = np.minimum(widths, np.maximum(room, period))
    return nodes.slower(at, depths, widths), law(np.stack([at - widths, at + widths]))
