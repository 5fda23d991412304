"""Exact Gaussian elimination of a few rational equations, for constants that are rounded once."""

from __future__ import annotations

from fractions import Fraction
from math import prod

import numpy as np

LEAST_EXTENT_M = 1e-30
"""Attachments as near as this count as one: quotients of their distances could leave the range of float64."""


def eliminate(rows: list[list[Fraction]]) -> list[list[Fraction]]:
    """Return the right-hand sides (n, m) after Gauss-Jordan elimination of (n, n + m). Raises LinAlgError."""
    n, rows = len(rows), [list(row) for row in rows]
    for column in range(n):
        pivot = next((r for r in range(column, n) if rows[r][column] != 0), None)
        if pivot is None:
            raise np.linalg.LinAlgError("the linear equations of the legs are dependent")
        rows[column], rows[pivot] = rows[pivot], rows[column]
        rows[column] = [entry / rows[column][column] for entry in rows[column]]
        for r in range(n):
            if r != column and rows[r][column] != 0:
                factor = rows[r][column]
                rows[r] = [a - factor * b for a, b in zip(rows[r], rows[column], strict=True)]
    return [row[n:] for row in rows]


def determinant(rows: list[list[Fraction]]) -> Fraction:
    """Return the determinant of a square matrix (n, n)."""
    rows, sign = [list(row) for row in rows], 1
    for column in range(len(rows)):
        pivot = next((r for r in range(column, len(rows)) if rows[r][column] != 0), None)
        if pivot is None:
            return Fraction(0)
        if pivot != column:
            rows[column], rows[pivot], sign = rows[pivot], rows[column], -sign
        for r in range(column + 1, len(rows)):
            factor = rows[r][column] / rows[column][column]
            rows[r] = [a - factor * b for a, b in zip(rows[r], rows[column], strict=True)]
    return prod((rows[k][k] for k in range(len(rows))), start=Fraction(sign))
