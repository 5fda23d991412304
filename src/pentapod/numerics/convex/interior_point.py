"""A convex program along a path, solved by an interior-point method on banded matrices.

Smallest xᵀHx/2 + gᵀx of coefficients c (K, 2), x = c.ravel(), with every c_k in the unit disc and within a trust
region, and linear inequalities at waypoints that reach over four neighbouring coefficients; others, over five, may be
exceeded at a price. All matrices are banded, so an iteration costs time in proportion to the length of the path.
Mehrotra's predictor and corrector (SIAM J. Optim. 2, 1992), with the discs as they are: their curvature adds to the
Hessian, by their multipliers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.banded import banded_product

if TYPE_CHECKING:
    from pentapod.numerics.convex.interior_kernels import Rows

_ITERATIONS = 80
_OFF_ROWS, _OFF_DISCS = 1e-6, 1e-3
_TO_BOUNDARY = 0.995
_FOUR = 4


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
class AxisProgram:
    """The program. hessian (B, 2K) in lower banded form, gradient (2K,): of the cost, whose size is about `scale`.

    basis (W, K) sparse, four neighbours a row: leans b = basis @ c. Inequality r: slopes[r] · b[point[r]] ≤ upper[r];
    point (R,) ascending. The trust region: |c_k − centre_k| ≤ reach. accuracy: the duality gap, as a share of
    the scale, at which an answer is good.
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
    soft: SoftRows = NO_ROWS
    accuracy: float = 1e-6

    def cost_of(self, c: Floats) -> float:
        """Return what is made small, up to a constant, of coefficients c (K, 2)."""
        x = c.ravel()
        excess = np.maximum(_Solver(self).rows_at(c)[1] - self.soft.upper, 0.0)
        return float(0.5 * x @ banded_product(self.hessian, x) + self.gradient @ x + self.soft.weight @ excess**2)

    def solved(self) -> Floats | None:
        """Return the coefficients (K, 2), or None where no interior of the constraints was found."""
        return _Solver(self).solved()


class _Solver:
    """One solution: coefficients c, slacks s and multipliers z.

    In this order: hard rows, cone discs, trust discs, soft rows. give: what a unit of multiplier adds to each slack; of
    a soft row that is exceeded by t, z = 2 · weight · t.
    """

    def __init__(self, program: AxisProgram) -> None:
        from pentapod.numerics.convex import interior_kernels  # noqa: PLC0415  kernels are loaded where they are used

        self.p, self.kernels = program, interior_kernels
        self.coefficients, soft = len(program.centre), program.soft
        self.rows: Rows = (
            program.basis.data.reshape(-1, _FOUR),
            program.basis.indices[::_FOUR].astype(np.intp),
            program.point,
            np.ascontiguousarray(program.slopes),
            soft.windows,
            soft.starts,
        )
        self.hard = len(program.upper)
        self.give = np.concatenate([np.zeros(self.hard + 2 * self.coefficients), 0.5 / soft.weight])

    def solved(self) -> Floats | None:
        p = self.p
        c = 0.98 * p.centre
        s = np.maximum(self.constraints(c), 1e-2)
        z = p.scale / len(s) / s
        for _ in range(_ITERATIONS):
            off, gap = self.constraints(c) + self.give * z - s, float(s @ z)
            dual = banded_product(p.hessian, c.ravel()) + p.gradient - self.transposed(c, z)
            if gap < p.accuracy * p.scale and np.abs(dual).max() < 10.0 * p.accuracy * p.scale and self.keeps(off):
                return c
            try:
                factor = cholesky_banded(self.matrix(c, s, z), lower=True, overwrite_ab=True, check_finite=False)
            except LinAlgError:
                return None
            affine = self.step(factor, c, s, z, dual, off, np.zeros_like(s))
            least = min(self.kernels.longest_step(s, affine[1]), self.kernels.longest_step(z, affine[2]))
            target = float((s + least * affine[1]) @ (z + least * affine[2]))
            # No further than the gap that is good enough: beyond it the matrix only loses digits.
            centring = max((target / gap) ** 3 * gap, 0.3 * p.accuracy * p.scale) / len(s)
            dc, ds, dz = self.step(factor, c, s, z, dual, off, centring - affine[1] * affine[2])
            length = _TO_BOUNDARY * min(
                self.kernels.longest_step(s, ds), self.kernels.longest_step(z, dz), 1.0 / _TO_BOUNDARY
            )
            if length < 1e-9:
                return None
            c, s, z = c + length * dc, s + length * ds, z + length * dz
        return None

    def keeps(self, off: Floats) -> bool:
        """Tell whether constraints are met as near as is of use: whoever asked scales back into the discs."""
        return float(np.abs(off[: self.hard]).max(initial=0.0)) < _OFF_ROWS and float(np.abs(off).max()) < _OFF_DISCS

    def constraints(self, c: Floats) -> Floats:
        """Return what must not be negative."""
        p = self.p
        e = c - p.centre
        hard, soft = self.rows_at(c)
        discs = 1.0 - c[:, 0] ** 2 - c[:, 1] ** 2
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

    def derivative(self, c: Floats, d: Floats) -> Floats:
        """Return the change of the constraints along d (K, 2)."""
        e = c - self.p.centre
        hard, soft = self.rows_at(d)
        discs = -2.0 * (c[:, 0] * d[:, 0] + c[:, 1] * d[:, 1])
        trust = -2.0 * (e[:, 0] * d[:, 0] + e[:, 1] * d[:, 1])
        return np.concatenate([-hard, discs, trust, -soft])

    def transposed(self, c: Floats, y: Floats) -> Floats:
        """Return Jᵀy (2K,) of the constraints' Jacobian J."""
        hard, discs, trust, soft = self.parts(y)
        total = np.ascontiguousarray(2.0 * discs[:, None] * c + 2.0 * trust[:, None] * (c - self.p.centre)).ravel()
        self.kernels.add_rows(self.rows, hard, soft, total)
        return -total

    def matrix(self, c: Floats, s: Floats, z: Floats) -> Floats:
        """Return H + 2Z + Jᵀ(Z/(S + give Z))J in lower banded form."""
        p = self.p
        hard, discs, trust, soft = self.parts(z / (s + self.give * z))
        _, disc_z, trust_z, _ = self.parts(z)
        out = p.hessian.copy()
        self.kernels.add_products(self.rows, hard, soft, out)
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
        stiff = s + self.give * z
        wanted = (centring - s * z) / stiff
        right = -dual + self.transposed(c, wanted - (z / stiff) * off)
        d = np.asarray(cho_solve_banded((factor, True), right, check_finite=False), dtype=np.float64).reshape(-1, 2)
        ds = self.derivative(c, d) + off
        dz = wanted - (z / stiff) * ds
        return d, ds + self.give * dz, dz
