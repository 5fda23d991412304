"""Banded quadratic program with discs: smallest xᵀHx/2 + gᵀx of the coefficients of a spline in the plane.

Coefficients c (K, 2), x = c.ravel(), each c_k in the unit disc and within a trust region, and linear inequalities at
waypoints that reach over four neighbouring coefficients; others, over five, may be exceeded at a price. All matrices
are banded, so an iteration costs time in proportion to the length of the path. The discs enter as they are: their
curvature adds to the Hessian, by their multipliers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.convex.interior_point import ConvexProgram, InteriorPointOptions

if TYPE_CHECKING:
    from pentapod.numerics.convex.banded_rows_kernels import Rows

NEIGHBOURS = 4
"""Coefficients that a row of the basis combines: those of a cubic spline."""


@dataclass(frozen=True, eq=False)
class SoftRows:
    """Inequalities that may be exceeded: each adds weight · excess² to what is made small.

    Inequality r: windows[r] · x[starts[r]:] ≤ upper[r], of as many neighbouring unknowns as the Hessian has diagonals.
    windows (R, B), starts, upper, weight (R,).
    """

    windows: Floats
    starts: Ints
    upper: Floats
    weight: Floats


NO_ROWS = SoftRows(np.zeros((0, 1)), np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0))


@dataclass(frozen=True, eq=False)
class BandedQP:
    """The program. hessian (B, 2K) in lower banded form, gradient (2K,): of the cost, whose size is about `scale`.

    basis (W, K) sparse, four neighbours a row: leans b = basis @ c. Inequality r: slopes[r] · b[point[r]] ≤ upper[r];
    point (R,) ascending. The trust region: |c_k − centre_k| ≤ reach, a number or (K,). accuracy: the duality gap, as a
    share of the scale, at which an answer is good.
    """

    hessian: Floats
    gradient: Floats
    scale: float
    basis: Any
    point: Ints
    slopes: Floats
    upper: Floats
    centre: Floats
    reach: Floats | float
    soft: SoftRows = NO_ROWS
    accuracy: float = 1e-6

    def cost_of(self, c: Floats) -> float:
        """Return what is made small, up to a constant, of coefficients c (K, 2)."""
        x = c.ravel()
        excess = np.maximum(_Solver(self).rows_at(c)[1] - self.soft.upper, 0.0)
        return float(0.5 * x @ banded_product(self.hessian, x) + self.gradient @ x + self.soft.weight @ excess**2)

    def solved(self) -> Floats | None:
        """Return the coefficients (K, 2), or None where no interior of the constraints was found."""
        found = _Solver(self).solved(0.98 * self.centre)
        return None if found is None else found[0]


class _Solver(ConvexProgram):
    """Constraints in this order: hard rows, cone discs, trust discs, soft rows."""

    def __init__(self, program: BandedQP) -> None:
        from pentapod.numerics.convex import banded_rows_kernels  # noqa: PLC0415  kernels are loaded where used

        self.p, self.kernels, self.scale = program, banded_rows_kernels, program.scale
        self.options = InteriorPointOptions(program.accuracy)
        self.coefficients, soft = len(program.centre), program.soft
        self.rows: Rows = (
            program.basis.data.reshape(-1, NEIGHBOURS),
            program.basis.indices[::NEIGHBOURS].astype(np.intp),
            program.point,
            np.ascontiguousarray(program.slopes),
            soft.windows,
            soft.starts,
        )
        self.hard = len(program.upper)
        self.give = np.concatenate([np.zeros(self.hard + 2 * self.coefficients), 0.5 / soft.weight])

    def keeps(self, off: Floats) -> bool:
        """Return whether rows are met, and discs nearly: the caller scales back into the discs."""
        return (
            float(np.abs(off[: self.hard]).max(initial=0.0)) < self.options.off
            and float(np.abs(off).max()) < self.options.off_soft
        )

    def cost_gradient(self, x: Floats) -> Floats:
        return banded_product(self.p.hessian, x.ravel()) + self.p.gradient

    def constraints(self, x: Floats) -> Floats:
        p = self.p
        e = x - p.centre
        hard, soft = self.rows_at(x)
        discs = 1.0 - x[:, 0] ** 2 - x[:, 1] ** 2
        trust = p.reach**2 - e[:, 0] ** 2 - e[:, 1] ** 2
        return np.concatenate([p.upper - hard, discs, trust, p.soft.upper - soft])

    def rows_at(self, c: Floats) -> tuple[Floats, Floats]:
        """Return the left sides of hard and soft rows."""
        hard, soft = np.empty(self.hard), np.empty(len(self.p.soft.upper))
        self.kernels.row_values(self.rows, np.ascontiguousarray(c), hard, soft)
        return hard, soft

    def parts(self, y: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return what belongs to hard rows, cone discs, trust discs and soft rows."""
        a, k = self.hard, self.coefficients
        return y[:a], y[a : a + k], y[a + k : a + 2 * k], y[a + 2 * k :]

    def derivative(self, x: Floats, d: Floats) -> Floats:
        e = x - self.p.centre
        hard, soft = self.rows_at(d)
        discs = -2.0 * (x[:, 0] * d[:, 0] + x[:, 1] * d[:, 1])
        trust = -2.0 * (e[:, 0] * d[:, 0] + e[:, 1] * d[:, 1])
        return np.concatenate([-hard, discs, trust, -soft])

    def transposed(self, x: Floats, y: Floats) -> Floats:
        hard, discs, trust, soft = self.parts(y)
        total = np.ascontiguousarray(2.0 * discs[:, None] * x + 2.0 * trust[:, None] * (x - self.p.centre)).ravel()
        self.kernels.add_rows(self.rows, hard, soft, total)
        return -total

    def newton_solver(self, x: Floats, weights: Floats, z: Floats) -> Callable[[Floats], Floats]:
        p = self.p
        hard, discs, trust, soft = self.parts(weights)
        _, disc_z, trust_z, _ = self.parts(z)
        lower = p.hessian.copy()
        self.kernels.add_products(self.rows, hard, soft, lower)
        e = x - p.centre
        curved = 2.0 * (disc_z + trust_z)
        for k in range(2):
            lower[0, k::2] += curved + 4.0 * (discs * x[:, k] ** 2 + trust * e[:, k] ** 2)
        lower[1, 0::2] += 4.0 * (discs * x[:, 0] * x[:, 1] + trust * e[:, 0] * e[:, 1])
        factor = cholesky_banded(lower, lower=True, overwrite_ab=True, check_finite=False)
        return lambda right: np.asarray(
            cho_solve_banded((factor, True), right, check_finite=False), dtype=np.float64
        ).reshape(-1, 2)


def banded(matrix: Any, bands: int) -> Floats:
    """Return a symmetric sparse matrix (n, n) in SciPy's lower banded form (B, n).

    Entries beyond its `bands` diagonals must be zero.
    """
    lower = np.zeros((bands, matrix.shape[0]))
    for k in range(min(bands, matrix.shape[0])):
        diagonal = matrix.diagonal(-k)
        lower[k, : len(diagonal)] = diagonal
    return lower


def banded_product(lower: Floats, x: Floats) -> Floats:
    """Return H x (n,) of a symmetric matrix in lower banded form."""
    y = lower[0] * x
    for k in range(1, min(len(lower), len(x))):
        y[k:] += lower[k, :-k] * x[:-k]
        y[:-k] += lower[k, :-k] * x[k:]
    return y
