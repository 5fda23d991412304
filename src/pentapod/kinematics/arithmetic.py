"""Formulas for numbers and symbols alike: the functions that differ between NumPy arrays and casadi expressions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

Vector: TypeAlias = Sequence[Any]
"""Three components, each a number, an array or an expression."""

Joints: TypeAlias = tuple[Sequence[Sequence[Any]], Sequence[Any]]
"""Base joints, two or three coordinates each, and the platform offsets along the line, metres."""


@dataclass(frozen=True)
class Arithmetic:
    """Square root, the smaller and the larger of two, and the choice between two by a condition."""

    sqrt: Any
    least: Any
    most: Any
    where: Any

    @classmethod
    def casadi(cls) -> Arithmetic:
        """Return the functions for casadi expressions."""
        import casadi as ca  # noqa: PLC0415  heavy: only when planning

        return cls(ca.sqrt, ca.fmin, ca.fmax, ca.if_else)


NUMPY = Arithmetic(np.sqrt, np.minimum, np.maximum, np.where)


def dot(a: Vector, b: Vector) -> Any:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
