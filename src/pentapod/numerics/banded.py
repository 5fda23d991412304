"""Symmetric banded matrices in SciPy's lower form (B, n): row k holds the k-th diagonal below the main one."""

from __future__ import annotations

from typing import Any

import numpy as np

from pentapod.base.arrays import Floats


def banded(matrix: Any, bands: int) -> Floats:
    """Return a symmetric sparse matrix (n, n) in this form; what lies beyond its `bands` diagonals must be zero."""
    lower = np.zeros((bands, matrix.shape[0]))
    for k in range(min(bands, matrix.shape[0])):
        diagonal = matrix.diagonal(-k)
        lower[k, : len(diagonal)] = diagonal
    return lower


def banded_product(lower: Floats, x: Floats) -> Floats:
    """Return H x (n,) of a matrix in this form."""
    y = lower[0] * x
    for k in range(1, min(len(lower), len(x))):
        y[k:] += lower[k, :-k] * x[:-k]
        y[:-k] += lower[k, :-k] * x[k:]
    return y
