"""Pentapods with manufacturing errors."""

import numpy as np

from pentapod.kinematics import AsBuiltPentapod, FiveLegs


def with_errors(nominal: FiveLegs, size: float, seed: int) -> AsBuiltPentapod:
    rng = np.random.default_rng(seed)
    return AsBuiltPentapod.of(
        nominal,
        base_errors=rng.normal(size=(5, 3)) * size,
        offset_errors=rng.normal(size=5) * size,
        radii=np.abs(rng.normal(size=5)) * size,
        zeros=rng.normal(size=5) * size,
    )
