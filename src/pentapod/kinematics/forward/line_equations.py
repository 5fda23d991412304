"""The four linear equations of a general linear pentapod, and the paper's cofactors (kinematics notes, section 5).

Source: J. Borràs, F. Thomas, C. Torras, "A Family of Quadratically-Solvable 5-SPU Parallel Robots", ICRA 2010,
equations (1) to (7). The paper solves for (px, py, u, v) with t as the parameter and must change the
parameter where C1 = 0. Here the solutions are a point plus a multiple of the null vector: nothing to change.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.forward.singularity_polynomial import exact_cofactors, reduced
from pentapod.numerics.rationals import LEAST_EXTENT_M, eliminate

_OTHERS = (0, 1, 3, 4)  # the legs whose equations are taken relative to leg 3


@dataclass(frozen=True, eq=False)
class LineEquations:
    """(t, px, py, u, v) = linear_map @ (squared legs) + constant + τ · null_vector, t = p · i, in the *reduced* frame.

    There leg 3's base attachment and offset are zero: p is leg 3's platform joint, seen from its base
    joint. linear_map (5, 5), constant (5,), null_vector (5,): the first three metres, the last two without
    unit. τ has no unit: null_vector is of length 1 where lengths are measured in `size`, the largest distance
    (metres) of a base attachment from leg 3's, and τ = 0 is the solution closest to zero in that measure.

    null_vector is a positive multiple of (C1, −C2, −C3, −C4, −C5), the cofactors of the reduced geometry, so
    it turns with the design without a jump and the first of two roots is where the polynomial (2) is
    negative. Every entry is rounded once from the exact rational one of the given geometry.
    """

    linear_map: Floats
    constant: Floats
    null_vector: Floats
    size: float

    @classmethod
    def of(cls, base: Floats, offsets: Floats) -> LineEquations:
        """Build them for base attachments (5, 2) and offsets (5,). Raises LinAlgError where all cofactors vanish."""
        x, y, z = reduced(base, offsets)
        exact = exact_cofactors(x, y, z)
        null = [exact[0], *(-c for c in exact[1:5])]
        size = float(np.linalg.norm(base - base[2], axis=1).max())
        if not size > 0.0 or not any(null):
            raise np.linalg.LinAlgError("the linear equations of the legs are dependent")
        weights = [1 / Fraction(size) ** 2] * 3 + [Fraction(1)] * 2
        largest = max(abs(n) for n in null)
        null = [n / largest for n in null]
        rows: list[list[Fraction]] = []
        for row, leg in enumerate(_OTHERS):
            # z t − x px − y py − xz u − yz v = ½ (l_i² − l_3² − x² − y² − z²)
            rhs = [Fraction(1, 2) if column == row else Fraction(0) for column in range(4)]
            square = x[leg] ** 2 + y[leg] ** 2 + z[leg] ** 2
            rows.append([z[leg], -x[leg], -y[leg], -x[leg] * z[leg], -y[leg] * z[leg], *rhs, -square / 2])
        rows.append([*(n * w for n, w in zip(null, weights, strict=True)), *([Fraction(0)] * 5)])
        linear_map, constant = np.zeros((5, 5)), np.zeros(5)
        for row, entries in enumerate(eliminate(rows)):
            linear_map[row, _OTHERS] = [float(entry) for entry in entries[:4]]
            linear_map[row, 2] = float(-sum(entries[:4]))
            constant[row] = float(entries[4])
        vector = np.array([float(n) for n in null])
        vector /= np.linalg.norm(vector / [size, size, size, 1.0, 1.0])
        return cls(linear_map, constant, vector, size)


def line_condition(base: Floats, offsets: Floats) -> float:
    """Return the reciprocal 2-norm condition number of the equations' 4×5 matrix: 0 is architecturally singular.

    base (5, 2) and offsets (5,) are taken relative to leg 3's and each divided by its largest distance from it:
    the figure changes neither with the unit of length nor with the length of the platform.
    """
    others = np.array(_OTHERS)
    relative, axial = base[others] - base[2], offsets[others] - offsets[2]
    size, length = float(np.linalg.norm(relative, axis=1).max()), float(np.abs(axial).max())
    if not min(size, length) > LEAST_EXTENT_M:
        return 0.0
    (x, y), z = (relative / size).T, axial / length
    values = np.linalg.svd(np.stack([z, x, y, x * z, y * z], axis=1), compute_uv=False)
    return float(values[-1] / values[0])
