"""Cutting force: a force on the tip against its motion, where the toolpath cuts."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.errors import InputError
from pentapod.simulate.reference import Reference

_SLOW = 1e-3  # m/s: below it the force fades, so that it turns round without a step


def cutting_forces(reference: Reference, cutting: Bools, newtons: float) -> Floats:
    """Return forces (N, 3) on the tip, machine frame, against its motion at the rows that cut, `cutting` (N,).

    Raises InputError for a force that is negative or not finite.
    """
    if not (np.isfinite(newtons) and newtons >= 0.0):
        raise InputError("must not be negative", key="cutting force", value=newtons, expected="newtons")
    velocity = np.gradient(reference.tips[::2], reference.program.period, axis=0)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    return np.where(cutting[:, None], -newtons * velocity / np.hypot(speed, _SLOW), 0.0)
