"""Plans without limited jerks, eased around the places where their setpoints would exceed a limit."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.pieces.piece import PieceProfile
from pentapod.timing.pieces.setpoints import EDGE, Setpoints
from pentapod.timing.pieces.use import GOAL, Use
from pentapod.timing.topp.stages import Failure

_EXTRA, _EXTRA_PER_ROUND = 0.99, 0.01
"""Each easing moves the setpoints against the corners of the path: a place that comes back gets more room."""

_SPREAD = 3
"""Rows on either side of one that exceeds to which it spreads: the averaging's own, and one more."""


def eased(piece: Setpoints, use: Use, machine: Machine, attempt: int) -> PieceProfile | Failure:
    """Return the profile of a piece with limits lowered around the rows where a share exceeds the goal, solved anew."""
    # Easing shifts all later setpoints against the path: ease for the rows between as well.
    profile, count = piece.profile, piece.count
    between = piece.use(piece.rows(0, count, 0.5), machine, 0, count)
    between = between.without_edges(EDGE * (profile.x_start > 0.0), EDGE * (profile.x_end > 0.0))
    rows, room = piece.rows(0, count).stations, _EXTRA - attempt * _EXTRA_PER_ROUND
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
