"""The quadratic family's condition: platform offsets proportional to the base attachments' x."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import MachineError


def fit_delta(base: Floats, offsets: Floats) -> float:
    """Return the δ that fits offsets (5,) to z_0 + δ x_i best in the least-squares sense; base (5, 2).

    Raises MachineError where all x_i are equal: no δ is better than another.
    """
    x, z = base[:, 0] - base[:, 0].mean(), offsets - offsets.mean()
    spread = float(x @ x)
    if not spread > 0.0:
        raise MachineError("all base attachments have the same x: they lie on one line", key="base")
    return float(x @ z) / spread


def check_offsets(base: Floats, offsets: Floats, delta: float, tolerance: float) -> Floats:
    """Return z_3 + δ (x_i − x_3), (5,) metres, which the offsets (5,) must equal within `tolerance` metres.

    Raises MachineError that names the leg which is farthest off, by how much, and the δ that fits best.
    """
    fitting = offsets[2] + delta * (base[:, 0] - base[2, 0])
    deviation = offsets - fitting
    worst = int(np.argmax(np.abs(deviation)))
    if abs(deviation[worst]) > tolerance:
        raise MachineError(
            f"leg {worst + 1}: its offset is {deviation[worst] * 1e3:+.6g} mm off z_3 + delta (x − x_3), "
            f"delta = {delta:.9g}",
            key="offsets",
            value=float(offsets[worst]),
            expected=f"{fitting[worst]:.9g} m within {tolerance * 1e3:.3g} mm",
            remedy=f"correct the offset, or delta: {fit_delta(base, offsets):.9g} fits these offsets best",
        )
    return fitting
