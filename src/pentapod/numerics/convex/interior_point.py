"""Primal-dual interior-point method for convex programs: Mehrotra's predictor and corrector (SIAM J. Optim. 2, 1992).

One loop for all programs that have a quadratic cost: what differs is how a program multiplies by its constraints and
factors its Newton matrix, dense (`dense_qp`) or banded (`banded_qp`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError

from pentapod.base.arrays import Floats


@dataclass(frozen=True)
class InteriorPointOptions:
    """How the method steps and when it stops.

    accuracy: the duality gap, as a share of the cost's scale, at which an answer is good; ten times as much of the
    gradient. iterations: at most. to_boundary: largest share of the way to the boundary that a step takes. shortest:
    share of a Newton step below which the method has failed. least_slack: from which slacks start at least, in the
    units of the constraints, which are numbers of the size of 1. off: by how much a constraint may be violated.
    off_soft: the same of constraints that the caller restores afterwards.
    """

    accuracy: float = 1e-6
    iterations: int = 80
    to_boundary: float = 0.995
    shortest: float = 1e-9
    least_slack: float = 1e-2
    off: float = 1e-6
    off_soft: float = 1e-3


class ConvexProgram(ABC):
    """Smallest cost, about `scale`, of unknowns x for which M constraints are not negative.

    give (M,), or 0: what a unit of multiplier adds to each slack; a soft constraint that is exceeded by t has the
    multiplier t / give.
    """

    scale: float = 1.0
    options: InteriorPointOptions = InteriorPointOptions()
    give: Floats | float = 0.0

    @abstractmethod
    def constraints(self, x: Floats) -> Floats:
        """Return what must not be negative (M,)."""

    @abstractmethod
    def cost_gradient(self, x: Floats) -> Floats:
        """Return the cost's gradient (n,)."""

    @abstractmethod
    def derivative(self, x: Floats, d: Floats) -> Floats:
        """Return the change (M,) of the constraints along d."""

    @abstractmethod
    def transposed(self, x: Floats, y: Floats) -> Floats:
        """Return Jᵀy (n,) of the constraints' Jacobian J and y (M,)."""

    @abstractmethod
    def newton_solver(self, x: Floats, weights: Floats, z: Floats) -> Callable[[Floats], Floats]:
        """Return what solves with H + JᵀWJ: H the Lagrangian's Hessian with multipliers z, W the weights (M,).

        It takes right sides (n,) and answers in the shape of x. Raises LinAlgError where the matrix is not positive.
        """

    @abstractmethod
    def keeps(self, off: Floats) -> bool:
        """Tell whether constraints are met as near as is of use; off (M,): what they miss their slacks by."""

    def solved(self, x: Floats) -> tuple[Floats, Floats] | None:
        """Return the best x, from a start that need not meet the constraints, and the multipliers z (M,).

        None where the method does not end: for want of an interior, say.
        """
        from pentapod.numerics.convex.banded_rows_kernels import longest_step  # noqa: PLC0415  loaded where used

        o = self.options
        good = o.accuracy * self.scale
        s = np.maximum(self.constraints(x), o.least_slack)
        z = self.scale / len(s) / s
        for _ in range(o.iterations):
            off, gap = self.constraints(x) + self.give * z - s, float(s @ z)
            dual = self.cost_gradient(x) - self.transposed(x, z)
            if gap < good and np.abs(dual).max() < 10.0 * good and self.keeps(off):
                return x, z
            try:
                step = self._newton(x, s, z, dual, off)
            except LinAlgError:
                return None
            _, ds, dz = step(0.0)
            least = min(longest_step(s, ds), longest_step(z, dz))
            ahead = float((s + least * ds) @ (z + least * dz))
            # No further than the gap that is good enough: beyond it the matrix only loses digits.
            centring = max((ahead / gap) ** 3 * gap, 0.3 * o.accuracy * self.scale) / len(s)
            dx, ds, dz = step(centring - ds * dz)
            length = o.to_boundary * min(longest_step(s, ds), longest_step(z, dz), 1.0 / o.to_boundary)
            if length < o.shortest:
                return None
            x, s, z = x + length * dx, s + length * ds, z + length * dz
        return None

    def _newton(
        self, x: Floats, s: Floats, z: Floats, dual: Floats, off: Floats
    ) -> Callable[[Floats | float], tuple[Floats, Floats, Floats]]:
        """Return the Newton step of x, s and z as a function of what s·z is to become."""
        stiff = s + self.give * z
        weights = z / stiff
        solve = self.newton_solver(x, weights, z)

        def step(target: Floats | float) -> tuple[Floats, Floats, Floats]:
            wanted = (target - s * z) / stiff
            dx = solve(-dual + self.transposed(x, wanted - weights * off))
            change = self.derivative(x, dx) + off
            dz = wanted - weights * change
            return dx, change + self.give * dz, dz

        return step
