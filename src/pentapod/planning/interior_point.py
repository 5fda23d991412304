"""A convex program along a path, solved by an interior-point method on banded matrices.

Smallest xᵀHx/2 + gᵀx of coefficients c (K, 2), x = c.ravel(), with every c_k in the unit disc and within a trust
region, and linear inequalities at waypoints that reach over four neighbouring coefficients. All matrices are banded,
so an iteration costs time in proportion to the length of the path. Mehrotra's predictor and corrector (SIAM J. Optim.
2, 1992), with the discs as they are: their curvature adds to the Hessian, by their multipliers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from pentapod.arrays import Floats, Ints
from pentapod.planning.axis_course import banded_product

_ITERATIONS = 80
_GAP = 1e-6
"""Duality gap, as a share of the cost's scale, at which the answer is good."""
_OFF_ROWS, _OFF_DISCS = 1e-6, 1e-3
_TO_BOUNDARY = 0.995
_FOUR = 4


@dataclass(frozen=True, eq=False)
class AxisProgram:
    """The program. hessian (B, 2K) in lower banded form, gradient (2K,): of the cost, whose size is about `scale`.

    basis (W, K) sparse, four neighbours a row: leans b = basis @ c. Inequality r: slopes[r] · b[point[r]] ≤ upper[r];
    point (R,) ascending. The trust region: |c_k − centre_k| ≤ reach.
    """

    hessian: Floats
    gradient: Floats
    scale: float
    basis: Any
    point: Ints
    slopes: Floats
    upper: Floats
    centre: Floats
    reach: float

    def solved(self) -> Floats | None:
        """Return the coefficients (K, 2), or None where no interior of the constraints was found."""
        return _Solver(self).solved()


class _Solver:
    """One solution: coefficients c, slacks s and multipliers z of rows, cone discs and trust discs, in this order."""

    def __init__(self, program: AxisProgram) -> None:
        self.p = program
        self.rows, self.coefficients = len(program.upper), len(program.centre)
        self.u, self.v = np.ascontiguousarray(program.slopes.T)
        self.gather = _block_gather(program.basis)
        self.starts = np.flatnonzero(np.diff(program.point, prepend=-1))
        self.touched = program.point[self.starts]

    def solved(self) -> Floats | None:
        p = self.p
        c = 0.98 * p.centre
        value = self.constraints(c)
        s = np.maximum(value, 1e-2)
        z = p.scale / len(s) / s
        for _ in range(_ITERATIONS):
            value = self.constraints(c)
            off, gap = value - s, float(s @ z)
            dual = banded_product(p.hessian, c.ravel()) + p.gradient - self.transposed(c, z)
            if gap < _GAP * p.scale and np.abs(dual).max() < 1e-5 * p.scale and self.keeps(off):
                return c
            try:
                factor = cholesky_banded(self.matrix(c, s, z), lower=True, overwrite_ab=True, check_finite=False)
            except LinAlgError:
                return None
            affine = self.step(factor, c, s, z, dual, off, np.zeros_like(s))
            least = min(longest_step(s, affine[1]), longest_step(z, affine[2]))
            target = float((s + least * affine[1]) @ (z + least * affine[2]))
            # No further than the gap that is good enough: beyond it the matrix only loses digits.
            centring = max((target / gap) ** 3 * gap, 0.3 * _GAP * p.scale) / len(s)
            dc, ds, dz = self.step(factor, c, s, z, dual, off, centring - affine[1] * affine[2])
            length = _TO_BOUNDARY * min(longest_step(s, ds), longest_step(z, dz), 1.0 / _TO_BOUNDARY)
            if length < 1e-9:
                return None
            c, s, z = c + length * dc, s + length * ds, z + length * dz
        return None

    def keeps(self, off: Floats) -> bool:
        """Tell whether constraints are met as near as is of use: whoever asked scales back into the discs."""
        return float(np.abs(off[: self.rows]).max(initial=0.0)) < _OFF_ROWS and float(np.abs(off).max()) < _OFF_DISCS

    def constraints(self, c: Floats) -> Floats:
        """Return what must not be negative."""
        p = self.p
        e = c - p.centre
        rows = p.upper - self.along(c)
        discs = 1.0 - c[:, 0] ** 2 - c[:, 1] ** 2
        trust = p.reach**2 - e[:, 0] ** 2 - e[:, 1] ** 2
        return np.concatenate([rows, discs, trust])

    def parts(self, y: Floats) -> tuple[Floats, Floats, Floats]:
        rows, k = self.rows, self.coefficients
        return y[:rows], y[rows : rows + k], y[rows + k :]

    def derivative(self, c: Floats, d: Floats) -> Floats:
        """Return the change of the constraints along d (K, 2)."""
        e = c - self.p.centre
        discs = -2.0 * (c[:, 0] * d[:, 0] + c[:, 1] * d[:, 1])
        trust = -2.0 * (e[:, 0] * d[:, 0] + e[:, 1] * d[:, 1])
        return np.concatenate([-self.along(d), discs, trust])

    def along(self, c: Floats) -> Floats:
        """Return the rows' left sides."""
        first, second = (self.p.basis @ c).T
        return self.u * first[self.p.point] + self.v * second[self.p.point]

    def transposed(self, c: Floats, y: Floats) -> Floats:
        """Return Jᵀy (2K,) of the constraints' Jacobian J."""
        p = self.p
        rows, discs, trust = self.parts(y)
        b = np.zeros((p.basis.shape[0], 2))
        if len(self.starts):
            b[self.touched, 0] = np.add.reduceat(self.u * rows, self.starts)
            b[self.touched, 1] = np.add.reduceat(self.v * rows, self.starts)
        total = -(p.basis.T @ b) - 2.0 * discs[:, None] * c - 2.0 * trust[:, None] * (c - p.centre)
        return np.asarray(total, dtype=np.float64).ravel()

    def matrix(self, c: Floats, s: Floats, z: Floats) -> Floats:
        """Return H + 2Z + Jᵀ(Z/S)J in lower banded form."""
        p = self.p
        rows, discs, trust = self.parts(z / s)
        _, disc_z, trust_z = self.parts(z)
        blocks = np.zeros((p.basis.shape[0], 3))
        if len(self.starts):
            for k, product in enumerate((self.u * self.u, self.u * self.v, self.v * self.v)):
                blocks[self.touched, k] = np.add.reduceat(rows * product, self.starts)
        near = (self.gather @ blocks).reshape(_FOUR, self.coefficients, 3)
        out = p.hessian.copy()
        for d in range(_FOUR):
            out[2 * d, 0::2] += near[d, :, 0]
            out[2 * d, 1::2] += near[d, :, 2]
            out[2 * d + 1, 0::2] += near[d, :, 1]
            if d > 0:
                out[2 * d - 1, 1::2] += near[d, :, 1]
        e = c - p.centre
        curved = 2.0 * (disc_z + trust_z)
        for k in range(2):
            out[0, k::2] += curved + 4.0 * (discs * c[:, k] ** 2 + trust * e[:, k] ** 2)
        out[1, 0::2] += 4.0 * (discs * c[:, 0] * c[:, 1] + trust * e[:, 0] * e[:, 1])
        return out

    def step(
        self, factor: Floats, c: Floats, s: Floats, z: Floats, dual: Floats, off: Floats, centring: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return the Newton step of x, s and z towards s·z = centring."""
        wanted = (centring - s * z) / s
        right = -dual + self.transposed(c, wanted - (z / s) * off)
        d = np.asarray(cho_solve_banded((factor, True), right, check_finite=False), dtype=np.float64).reshape(-1, 2)
        ds = self.derivative(c, d) + off
        return d, ds, wanted - (z / s) * ds


def longest_step(values: Floats, change: Floats) -> float:
    """Return the largest step in [0, 1] that keeps values ≥ 0."""
    falling = change < 0.0
    return min(1.0, float((-values[falling] / change[falling]).min(initial=1.0)))


def _block_gather(basis: Any) -> Any:
    """Return the matrix (4K, W) that adds up waypoints' products: row d·K + k holds basis[w, k] · basis[w, k + d]."""
    count, size = basis.shape
    weights, columns = basis.data.reshape(count, _FOUR), basis.indices.reshape(count, _FOUR)
    values, rows, points = [], [], []
    for d in range(_FOUR):
        for a in range(_FOUR - d):
            values.append(weights[:, a] * weights[:, a + d])
            rows.append(d * size + columns[:, a])
            points.append(np.arange(count))
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(points)))
    return sparse.csr_matrix(entries, shape=(_FOUR * size, count))
