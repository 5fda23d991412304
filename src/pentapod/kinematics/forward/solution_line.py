"""The line of solutions of the four linear equations, and where on it the two quadratic ones can hold.

Kinematics notes, section 5. Along the line (t, px, py, u, v) = start + τ step,

    w² = D1(τ) = 1 − u² − v²,   pz² = E(τ) = l_3² − px² − py²,   pz w = g(τ) = t − px u − py v,

so that f = D1 E − g² = 0 on the *feasible interval* D1 ≥ 0, E ≥ 0. There √(D1 E) − |g| is concave (it is the
smaller of two concave functions), hence f > 0 strictly between the two valid roots and f ≤ 0 elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.kinematics.forward.line_equations import LineEquations

_EPS = float(np.finfo(np.float64).eps)


class Factors(NamedTuple):
    """D1, E (m²), g (m) and their derivatives by τ at points of N solution lines: each (N,)."""

    d1: Floats
    e: Floats
    g: Floats
    d1_slope: Floats
    e_slope: Floats
    g_slope: Floats

    def f(self) -> tuple[Floats, Floats]:
        """Return f = D1 E − g² and its derivative."""
        slope = self.d1_slope * self.e + self.d1 * self.e_slope - 2.0 * self.g * self.g_slope
        return self.d1 * self.e - self.g * self.g, slope

    def margin(self) -> tuple[Floats, Floats]:
        """Return the concave √(D1 E) − |g| (m) and its derivative."""
        root = np.sqrt(np.maximum(self.d1, 0.0) * np.maximum(self.e, 0.0))
        slope = 0.5 * (self.d1_slope * self.e + self.d1 * self.e_slope)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):  # endless at the ends of the interval
            return root - np.abs(self.g), slope / root - np.sign(self.g) * self.g_slope


@dataclass(frozen=True, eq=False)
class SolutionLine:
    """Solution lines of N leg vectors. start, rounding (5, N); step (5,); reach_squared (N,) = l_3², m²; unit_squared.

    rounding bounds how far the rounding of the leg lengths and of the map may have moved `start`. unit_squared (N,):
    the square of the direction's length, 1 but for `loosened`.
    """

    start: Floats
    rounding: Floats
    step: Floats
    reach_squared: Floats
    unit_squared: Floats

    @classmethod
    def of(cls, equations: LineEquations, squared_legs: Floats) -> SolutionLine:
        """Build the lines of squared leg lengths (5, N)."""
        start = np.repeat(equations.constant[:, None], squared_legs.shape[1], axis=1)
        rounding = np.abs(start)
        for column, squared in zip(equations.linear_map.T, squared_legs, strict=True):
            # Leg by leg: in a matrix product the order, and so the last bit, would depend on the size of the batch.
            term = column[:, None] * squared
            start += term
            rounding += np.abs(term)
        reach = squared_legs[2]
        return cls(start, 4.0 * _EPS * rounding, equations.null_vector, reach, np.ones_like(reach))

    def take(self, index: Ints | Bools) -> SolutionLine:
        """Return the chosen lines."""
        return SolutionLine(
            self.start[:, index],
            self.rounding[:, index],
            self.step,
            self.reach_squared[index],
            self.unit_squared[index],
        )

    def loosened(self) -> SolutionLine:
        """Return the lines with l_3 and the direction a little longer: by what rounding may take.

        Lemma 2 of docs/proofs.md. If the exact lengths have a pose, then D1 E − g² of these is positive there,
        whatever rounding did to D1, E
        and g: √((D1 + a)(E + b)) ≥ √(D1 E) + √(a b), and a, b are so large that √(a b) exceeds the error of g.
        """
        reach = np.sqrt(self.reach_squared)
        # At a pose no coordinate exceeds l_3 or 1, so neither does the term τ · step exceed that and `start`.
        most = np.stack([reach, reach, reach, np.ones_like(reach), np.ones_like(reach)])
        et, ex, ey, eu, ev = self.rounding + 4.0 * _EPS * (np.abs(self.start) + most)
        in_g = et + ex + ey + reach * (eu + ev + 16.0 * _EPS)
        in_d1, in_e = 2.0 * (eu + ev) + 8.0 * _EPS, 2.0 * reach * (ex + ey) + 8.0 * _EPS * self.reach_squared
        share = in_g / np.where(reach > 0.0, reach, 1.0)
        return SolutionLine(
            self.start,
            self.rounding,
            self.step,
            self.reach_squared + 2.0 * (in_e + in_g * reach),
            self.unit_squared + 2.0 * (in_d1 + share),
        )

    def at(self, tau: Floats) -> Floats:
        """Return (t, px, py, u, v), (5, N), at the parameters (N,)."""
        return self.start + tau * self.step[:, None]

    def factors(self, tau: Floats) -> Factors:
        """Return D1, E, g and their derivatives at the parameters (N,)."""
        t, px, py, u, v = self.at(tau)
        nt, nx, ny, nu, nv = self.step
        return Factors(
            self.unit_squared - (u * u + v * v),
            self.reach_squared - (px * px + py * py),
            t - (px * u + py * v),
            -2.0 * (nu * u + nv * v),
            -2.0 * (nx * px + ny * py),
            nt - (nx * u + ny * v) - (nu * px + nv * py),
        )

    def directions(self) -> tuple[Floats, Floats]:
        """Return the interval (N,), (N,) of τ with u² + v² ≤ 1; (c, c) with the nearest c where there is none.

        In the quadratic family u and v do not depend on τ: all of (−∞, ∞), whether they fulfil it or not.
        """
        return _ball(self.start[3], self.start[4], self.step[3], self.step[4], self.unit_squared)

    def positions(self) -> tuple[Floats, Floats]:
        """Return the interval (N,), (N,) of τ with px² + py² ≤ l_3²; (c, c) with the nearest c where there is none."""
        return _ball(self.start[1], self.start[2], self.step[1], self.step[2], self.reach_squared)


def _ball(x: Floats, y: Floats, dx: float, dy: float, radius_squared: Floats) -> tuple[Floats, Floats]:
    """Return where (x, y) + τ (dx, dy) is in a disc: roots of a τ² + 2 b τ = c, both without cancellation."""
    a, b, c = dx * dx + dy * dy, x * dx + y * dy, radius_squared - (x * x + y * y)
    if not a > 0.0:
        return np.full_like(x, -np.inf), np.full_like(x, np.inf)
    cross = x * dy - y * dx
    root = np.sqrt(np.maximum(a * radius_squared - cross * cross, 0.0))  # √(b² + a c), c = 0 included
    far = -(b + np.copysign(root, b))
    with np.errstate(divide="ignore", invalid="ignore"):
        near = np.where((far != 0.0) & (root > 0.0), -c / far, far / a)
    far = far / a
    return np.minimum(near, far), np.maximum(near, far)
