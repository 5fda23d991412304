"""Derivatives of products and roots by Leibniz's rule; a quantity is a list, at [k] its derivative of order k."""

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


def square_roots(square: Sequence[Floats]) -> list[Floats]:
    """Return the square roots and their derivatives: (r²)⁽ⁿ⁾ = 2 r r⁽ⁿ⁾ + products of lower ones."""
    found = [np.sqrt(square[0])]
    for n in range(1, len(square)):
        lower = [comb(n, k) * found[k] * found[n - k] for k in range(1, n)]
        found.append((square[n] - np.sum(lower, axis=0) if lower else square[n]) / (2.0 * found[0]))
    return found


def unit_vectors(vector: Sequence[Floats]) -> list[Floats]:
    """Return the unit vectors (..., 3) along vectors and their derivatives: v = |v| e."""
    length = square_roots(scalar_products(vector, vector))
    found: list[Floats] = []
    for n in range(len(vector)):
        lower = [comb(n, k) * length[n - k][..., None] * found[k] for k in range(n)]
        found.append((vector[n] - np.sum(lower, axis=0) if lower else vector[n]) / length[0][..., None])
    return found
