"""Leibniz's rule: derivatives of products and roots along a curve, from those of their factors.

A quantity is a list: at [k] its derivative of order k, arrays of one shape; vectors have their components last.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np

from pentapod.base.arrays import Floats


def scalar_products(a: Sequence[Floats], b: Sequence[Floats]) -> list[Floats]:
    """Return the scalar products (...) of vectors (..., 3) and their derivatives."""
    return [
        np.sum([comb(n, k) * np.einsum("...c,...c->...", a[k], b[n - k]) for k in range(n + 1)], axis=0)
        for n in range(len(a))
    ]


def cross_products(a: Sequence[Floats], b: Sequence[Floats]) -> list[Floats]:
    """Return the vector products (..., 3) and their derivatives."""
    return [np.sum([comb(n, k) * np.cross(a[k], b[n - k]) for k in range(n + 1)], axis=0) for n in range(len(a))]


def root(square: Sequence[Floats]) -> list[Floats]:
    """Return the square roots and their derivatives: (r²)⁽ⁿ⁾ = 2 r r⁽ⁿ⁾ + what the lower ones make."""
    found = [np.sqrt(square[0])]
    for n in range(1, len(square)):
        lower = [comb(n, k) * found[k] * found[n - k] for k in range(1, n)]
        found.append((square[n] - np.sum(lower, axis=0) if lower else square[n]) / (2.0 * found[0]))
    return found
