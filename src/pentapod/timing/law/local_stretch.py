"""Local time scaling: a law run slower about single places, and nowhere else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.law.time_law import MotionLaw


@dataclass(frozen=True, eq=False)
class Stretchable:
    """Squared speeds x (K,) in m²/s² and slopes x′ (K,) at stations s (K,): what a law limited in jerk is made of."""

    s: Floats
    x: Floats
    slope: Floats

    def law(self) -> MotionLaw:
        """Return the law through them."""
        return MotionLaw.through(self.s, self.x, self.slope)

    def slower(self, times: Floats, depths: Floats, widths: Floats) -> Stretchable:
        """Return it slower about some of its times (n,): by the shares `depths` there, by less up to `widths` (n,).

        The speed is multiplied by f = 1 − depth (1 − u²)³, u = (t − time) / width, which has no step in the jerk; so x
        by f², and x′ = 2 s̈ follows. Places that overlap multiply.
        """
        law = self.law()
        clock, v = np.interp(self.s, law.stations, law.times), np.sqrt(self.x)
        share, change = np.ones_like(v), np.zeros_like(v)
        low, high = np.searchsorted(clock, times - widths, "left"), np.searchsorted(clock, times + widths, "right")
        for k, time in enumerate(times.tolist()):
            here = slice(int(low[k]), int(high[k]))
            u = np.clip((clock[here] - time) / widths[k], -1.0, 1.0)
            left = 1.0 - u * u
            factor = 1.0 - depths[k] * left**3
            change[here] = change[here] * factor + share[here] * (6.0 * depths[k] / widths[k]) * u * left**2
            share[here] *= factor
        return Stretchable(self.s, self.x * share**2, self.slope * share**2 + 2.0 * v * share * change)
