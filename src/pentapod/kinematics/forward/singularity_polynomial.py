"""The singularities of any linear pentapod: the paper's polynomial (2) and its six cofactors.

Source: J. Borràs, F. Thomas, C. Torras, "A Family of Quadratically-Solvable 5-SPU Parallel Robots", ICRA
2010, equations (1) and (2). A pose is singular where the polynomial is zero; a geometry is architecturally
singular where all six cofactors are.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats
from pentapod.kinematics.batches import as_poses
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.numerics.rationals import determinant


def singularity_cofactors(pentapod: FiveLegs) -> Floats:
    """Return C1 … C6 (6,) of the paper's matrix (1): C1, C2, C3 in m⁶, C4 and C5 in m⁵, C6 in m⁷.

    Rounded once from the exact ones of the given geometry.
    """
    columns = [[Fraction(float(c)) for c in column] for column in (*pentapod.base.T, pentapod.offsets)]
    return np.array([float(c) for c in exact_cofactors(*columns)])


def singularity_polynomial(pentapod: FiveLegs, position: ArrayLike, direction: ArrayLike) -> Floats:
    """Return the polynomial (2) (...) in m⁷ at poses (..., 3): zero on the singularities; δ² w F S where z_i = δ x_i.

    It is evaluated relative to leg 3, which changes no value and keeps the digits of a machine far from the origin.
    """
    p, i = as_poses(position, direction)
    cofactors = np.array([float(c) for c in exact_cofactors(*reduced(pentapod.base, pentapod.offsets))])
    return polynomial_terms(pentapod, p, i) @ cofactors


def polynomial_terms(pentapod: FiveLegs, position: Floats, direction: Floats) -> Floats:
    """Return the first row (..., 6) of the matrix (1), for poses (..., 3) seen from leg 3's attachments."""
    px, py, pz = np.moveaxis(position + pentapod.offsets[2] * direction, -1, 0)
    u, v, w = np.moveaxis(direction, -1, 0)
    across_x, across_y = pz * u - (px - pentapod.base[2, 0]) * w, pz * v - (py - pentapod.base[2, 1]) * w
    row = (w * pz, w * across_x, w * across_y, -pz * across_x, -pz * across_y, -w * w)
    return np.stack(np.broadcast_arrays(*row), axis=-1)


def reduced(base: Floats, offsets: Floats) -> tuple[list[Fraction], list[Fraction], list[Fraction]]:
    """Return x_i − x_3, y_i − y_3 and z_i − z_3 of base (5, 2) and offsets (5,), exactly."""
    numbers = [[Fraction(float(c)) for c in column] for column in (base[:, 0], base[:, 1], offsets)]
    x, y, z = ([c - column[2] for c in column] for column in numbers)
    return x, y, z


def exact_cofactors(x: list[Fraction], y: list[Fraction], z: list[Fraction]) -> list[Fraction]:
    """Return the cofactors of the first row of the matrix (1), whose other rows are z, x, y, xz, yz, 1."""
    rows = [[c, a, b, a * c, b * c, Fraction(1)] for a, b, c in zip(x, y, z, strict=True)]
    minors = (determinant([[*row[:k], *row[k + 1 :]] for row in rows]) for k in range(6))
    return [minor if k % 2 == 0 else -minor for k, minor in enumerate(minors)]
