"""Boundary speeds: time laws with given speeds at their ends, stretched to whole periods of the controller."""

from __future__ import annotations

from typing import cast

import numpy as np
from scipy.optimize import brentq

from pentapod.timing.pieces.piece import PieceProfile
from pentapod.timing.time_law.motion_law import MotionLaw, SpeedNodes
from pentapod.timing.topp.stages import Failure

LARGEST_REDUCTION = 0.9
"""Largest share of x that may be taken from the middle of the way."""


def law_between(
    profile: PieceProfile, slower: float, period: float, nodes: SpeedNodes | None = None
) -> MotionLaw | Failure:
    """Return the law of a profile with given speeds at its ends, `slower` times slower, in whole periods.

    x = ṡ² is reduced by a share that rises from 0 at the given ends with two vanishing derivatives: so these speeds
    stay, and no limit of speed is exceeded. nodes: of the jerk-limited law, instead. A Failure where a tenth of x is
    still too fast.
    """
    s, x = (profile.s, profile.x) if nodes is None else (nodes.s, nodes.x)
    far = np.minimum(
        s / s[-1] if profile.x_start > 0.0 else np.ones_like(s),
        1.0 - s / s[-1] if profile.x_end > 0.0 else np.ones_like(s),
    )
    both = 2.0 if profile.x_start > 0.0 and profile.x_end > 0.0 else 1.0
    u = both * far
    share = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    uphill = np.where(2.0 * s < s[-1], 1.0, -1.0) if both == 2.0 else (1.0 if profile.x_start > 0.0 else -1.0)
    rise = 30.0 * (u * (1.0 - u)) ** 2 * uphill * both / s[-1]

    def law(less: float) -> MotionLaw:
        kept = 1.0 - less * share
        if nodes is None:
            return MotionLaw.from_profile(s, x * kept)
        return MotionLaw.through(s, x * kept, nodes.slope * kept - less * rise * x)

    goal = whole_periods(law(0.0).duration * slower, period)
    if law(LARGEST_REDUCTION).duration < goal * (1.0 - 1e-12):
        return Failure(-1, "no whole number of periods fits the speeds that are given at the ends")
    less = cast("float", brentq(lambda less: law(less).duration - goal, 0.0, LARGEST_REDUCTION, xtol=1e-15))
    return law(less).stretched(goal)


def whole_periods(duration: float, period: float) -> float:
    """Return the duration rounded up to a whole number of periods, at least one."""
    return max(1.0, float(np.ceil(duration / period - 1e-9))) * period
