"""Checks that the parts of a machine share: numbers for each leg, positive numbers."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import frozen, set_frozen
from pentapod.base.errors import MachineError


def per_leg(owner: object, *names: str) -> None:
    """Replace scalars or five numbers by read-only arrays (5,). Raises MachineError naming the field."""
    for name in names:
        value = np.asarray(getattr(owner, name), dtype=np.float64)
        if value.shape not in {(), (1,), (5,)}:
            raise MachineError(
                "wrong count", key=name, value=value.shape, expected="one number, or one for each of 5 legs"
            )
        if not np.isfinite(value).all():
            raise MachineError("not finite", key=name, value=value.tolist())
        set_frozen(owner, **{name: frozen(np.broadcast_to(value, (5,)), name, (5,))})


def positive(owner: object, *names: str) -> None:
    """Raise MachineError where a field is not finite and positive."""
    for name in names:
        value = getattr(owner, name)
        if not (np.isfinite(value).all() and np.min(value) > 0.0):
            raise MachineError("must be positive", key=name, value=np.asarray(value).tolist())


def not_negative(owner: object, *names: str) -> None:
    """Raise MachineError where a field is not finite, or negative."""
    for name in names:
        value = getattr(owner, name)
        if not (np.isfinite(value).all() and np.min(value) >= 0.0):
            raise MachineError("must not be negative", key=name, value=np.asarray(value).tolist())
