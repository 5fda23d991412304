"""Forward kinematics of the quadratic family in closed form (kinematics notes, section 3).

Source: J. Borràs, F. Thomas, C. Torras, "A Family of Quadratically-Solvable 5-SPU Parallel Robots", ICRA
2010.
Everything here is in the *reduced* frame, where leg 3's base attachment and offset are zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.numerics.double_double import DoubleDouble
from pentapod.numerics.rationals import LEAST_EXTENT_M, eliminate

_OTHERS = (0, 1, 3, 4)  # the legs whose equations are taken relative to leg 3

NEAR_W_SQUARED = 2.0**-20
"""w² below which `quadratic_near` solves instead: |w| < 1e-3."""

NEAR_S = 0.05
"""|S| below which `quadratic_near` solves instead, in units of the machine's size."""


@dataclass(frozen=True, eq=False)
class LinearPart:
    """(q, py, u, v) = linear_map @ (squared legs) + constant: the linear half of the forward kinematics.

    linear_map (4, 5), constant (4,), with q = px − δ t and t = p · i. Every entry is the exact one of the
    given floating-point geometry, rounded once to nearest: the certificate's error bound relies on it.
    remainder (4, 6): what that rounding left out, of both. near_s_squared, m²: S² below which a pose counts as
    near S = 0.
    """

    linear_map: Floats
    constant: Floats
    remainder: Floats
    near_s_squared: float

    @classmethod
    def of(cls, base: Floats, delta: float) -> LinearPart:
        """Build it for base attachments (5, 2), leg 3's anywhere. Raises LinAlgError where F = 0 exactly."""
        third, slope = [Fraction(float(c)) for c in base[2]], Fraction(float(delta))
        rows: list[list[Fraction]] = []
        for row, leg in enumerate(_OTHERS):
            x, y = (Fraction(float(c)) - c3 for c, c3 in zip(base[leg], third, strict=True))
            # x q + y py + δx² u + δxy v = −½ (l_i² − l_3² − k),  k = x² + y² + δ²x²
            rhs = [Fraction(-1, 2) if column == row else Fraction(0) for column in range(4)]
            k = x * x + y * y + (slope * x) ** 2
            rows.append([x, y, slope * x * x, slope * x * y, *rhs, k / 2])
        solution = [[*row[:2], -sum(row[:4], Fraction(0)), *row[2:]] for row in eliminate(rows)]
        exact = DoubleDouble.table(solution)
        size = float(np.hypot(*(base - base[2]).T).max())
        return cls(exact.high[:, :5].copy(), exact.high[:, 5].copy(), exact.low, (NEAR_S * size) ** 2)

    def __call__(self, squared_legs: Floats) -> Floats:
        """Return (4, ...): q, py, u, v of squared leg lengths (5, ...).

        Summed leg by leg, not by a matrix product: there the order, and so the last bit, is the library's choice.
        """
        column = (slice(None), *(None,) * (squared_legs.ndim - 1))
        forms = self.linear_map[:, 0][column] * squared_legs[0]
        product = np.empty_like(forms)
        for leg in range(1, 5):
            forms += np.multiply(self.linear_map[:, leg][column], squared_legs[leg], out=product)
        forms += self.constant[column]
        return forms

    def largest(self, squared_legs: Floats) -> Floats:
        """Return (4, N): bounds of |q|, |py|, |u|, |v| that count every term of theirs as positive."""
        return self.changes(squared_legs) + np.abs(self.constant)[:, None]

    def changes(self, squared_legs: Floats) -> Floats:
        """Return (4, N): how far q, py, u, v move at most when squared legs move by up to (5, N) either way."""
        steepness = np.abs(self.linear_map)
        change = steepness[:, :1] * squared_legs[0]
        for leg in range(1, 5):
            change += steepness[:, leg : leg + 1] * squared_legs[leg]
        return change

    def twofold(self, squared_legs: DoubleDouble) -> list[DoubleDouble]:
        """Return q, py, u, v, each (N,), of squared leg lengths (5, N), all with twice the digits."""
        forms: list[DoubleDouble] = []
        for row, constant, low in zip(self.linear_map, self.constant, self.remainder, strict=True):
            form = DoubleDouble(constant, low[5])
            for leg in range(5):
                form += DoubleDouble(squared_legs.high[leg], squared_legs.low[leg]) * DoubleDouble(row[leg], low[leg])
            forms.append(form)
        return forms


def reciprocal_condition(base: Floats, delta: float) -> float:
    """Return the reciprocal 2-norm condition number of the matrix [x, y, δx², δxy] (4, 4) of `LinearPart`.

    Base attachments (5, 2), taken relative to leg 3's and divided by the largest distance from it: the figure
    does not change with the unit of length. 0 where the matrix is zero or the attachments coincide, or as good as.
    """
    relative = base[_OTHERS, :] - base[2]
    size = float(np.linalg.norm(relative, axis=1).max())
    if not size > LEAST_EXTENT_M:
        return 0.0
    x, y = (relative / size).T
    values = np.linalg.svd(np.stack([x, y, delta * x * x, delta * x * y], axis=1), compute_uv=False)
    return float(values[-1] / values[0])


class Reduced(NamedTuple):
    """Poses in the reduced frame, by coordinate; arrays that broadcast."""

    px: Floats
    py: Floats
    pz: Floats
    u: Floats
    v: Floats
    w: Floats


def solve(
    squared_legs: Floats, linear: LinearPart, delta: float, sign_w: Floats, sign_s: Floats
) -> tuple[Reduced, Bools]:
    """Return the poses, and (N,) where they are near a singularity or do not exist: see `quadratic_near` for these.

    squared_legs (5, N); the signs broadcast against (N,), and so does the result: signs (4, 1) give (4, N)
    for px, pz, w and (N,) for py, u, v, which do not depend on the mode. The square roots of negative
    numbers are meant: the caller silences NumPy. `quadratic_kernels.poses` repeats these operations one by one.
    """
    q, py, u, v = linear(squared_legs)
    d1 = 1.0 - u * u
    d1 -= v * v
    w = np.sqrt(d1)
    # (px, pz) lies on the line n · (px, pz) = c, at ±root along it, n = (1 − δu, −δw).
    n1 = 1.0 - delta * u
    n_squared = n1 * n1 + (delta * delta) * d1
    c = q + delta * (v * py)
    d = (squared_legs[2] - py * py) * n_squared - c * c
    near = ~((d1 > NEAR_W_SQUARED) & (d > linear.near_s_squared))
    n2 = (-delta * sign_w) * w
    root = sign_s * np.sqrt(d)
    px, pz = (c * n1 - root * n2) / n_squared, (c * n2 + root * n1) / n_squared
    return Reduced(px, py, pz, u, v, sign_w * w), near


def w_and_s(position: Floats, direction: Floats, delta: float, lever: float) -> tuple[Floats, Floats]:
    """Return w and S (...) of poses (..., 3), machine frame (kinematics notes, section 4).

    S = δ w px − (δu − 1) pz for the point of the line that leg 3 holds, relative to leg 3's base attachment;
    for another point p of the line it is δ w px + (1 − δu) pz + lever · w, lever = z_3 − δ x_3 in metres.
    """
    u, w = direction[..., 0], direction[..., 2]
    return w, delta * w * position[..., 0] + (1.0 - delta * u) * position[..., 2] + lever * w
