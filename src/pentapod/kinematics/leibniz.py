"""Derivatives of products and roots by Leibniz's rule; a quantity is a list, at [k] its derivative of order k."""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np

from pentapod.base.arrays import Floats


def scalar_products(a: Sequence[Floats], b: Sequence[Floats]) -> list[Floats]:
    """Return the scalar products (...) of vectors (..., 3) and their derivatives."""
    found = list[Floats]()
    for n in range(len(a)):
        total = np.zeros(np.broadcast_shapes(a[0].shape, b[0].shape)[:-1])
        for k in range(n + 1) if a is not b else range(n // 2 + 1):  # of a square two terms are equal
            times = float(comb(n, k) * (2 if a is b and 2 * k < n else 1))
            x, y = a[k], b[n - k]
            total += times * (x[..., 0] * y[..., 0] + x[..., 1] * y[..., 1] + x[..., 2] * y[..., 2])
        found.append(total)
    return found


def cross_products(a: Sequence[Floats], b: Sequence[Floats]) -> list[Floats]:
    """Return the vector products (..., 3) and their derivatives."""
    found = list[Floats]()
    for n in range(len(a)):
        total = np.zeros((3, *np.broadcast_shapes(a[0].shape, b[0].shape)[:-1]))  # whole components in one piece
        for k in range(n + 1):
            x, y = a[k], b[n - k]
            for c in range(3):
                d, e = (c + 1) % 3, (c + 2) % 3
                total[c] += float(comb(n, k)) * (x[..., d] * y[..., e] - x[..., e] * y[..., d])
        found.append(np.moveaxis(total, 0, -1))
    return found


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
