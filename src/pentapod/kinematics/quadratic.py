"""Forward kinematics of the quadratic family in closed form (kinematics notes, section 3).

Source: J. Borràs, F. Thomas, C. Torras, "A Family of Quadratically-Solvable 5-SPU Parallel Robots", ICRA
2010.
Everything here is in the *reduced* frame, where leg 3's base attachment and offset are zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from pentapod.arrays import Floats
from pentapod.kinematics.exact import eliminate

_OTHERS = (0, 1, 3, 4)  # the legs whose equations are taken relative to leg 3


@dataclass(frozen=True, eq=False)
class LinearPart:
    """(q, py, u, v) = linear_map @ (squared legs) + constant: the linear half of the forward kinematics.

    linear_map (4, 5), constant (4,), with q = px − δ t and t = p · i. Every entry is the exact one of the
    given floating-point geometry, rounded once to nearest: the certificate's error bound relies on it.
    """

    linear_map: Floats
    constant: Floats

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
        solution = eliminate(rows)
        linear_map, constant = np.zeros((4, 5)), np.zeros(4)
        for row, entries in enumerate(solution):
            linear_map[row, _OTHERS] = [float(entry) for entry in entries[:4]]
            linear_map[row, 2] = float(-sum(entries[:4]))
            constant[row] = float(entries[4])
        return cls(linear_map, constant)

    def __call__(self, squared_legs: Floats) -> Floats:
        """Return (4, N): q, py, u, v of squared leg lengths (5, N)."""
        return self.linear_map @ squared_legs + self.constant[:, None]


def reciprocal_condition(base: Floats, delta: float) -> float:
    """Return the reciprocal 2-norm condition number of the matrix [x, y, δx², δxy] (4, 4) of `LinearPart`.

    Base attachments (5, 2), taken relative to leg 3's and divided by the largest distance from it: the figure
    does not change with the unit of length. 0 where the matrix is zero or the attachments coincide.
    """
    relative = base[_OTHERS, :] - base[2]
    size = float(np.linalg.norm(relative, axis=1).max())
    if not size > 0.0:
        return 0.0
    x, y = (relative / size).T
    values = np.linalg.svd(np.stack([x, y, delta * x * x, delta * x * y], axis=1), compute_uv=False)
    return float(values[-1] / values[0])


def solve(
    squared_legs: Floats, linear: LinearPart, delta: float, sign_w: Floats, sign_s: Floats
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """Return (px, py, pz, u, v, w), reduced; NaN where the mode (sign_w, sign_s) does not exist.

    squared_legs (5, N); the signs broadcast against (N,), and so does the result: signs (4, 1) give (4, N)
    for px, pz, w and (N,) for py, u, v, which do not depend on the mode. The square roots of negative
    numbers are meant: the caller silences NumPy.
    """
    q, py, u, v = linear(squared_legs)
    d1 = 1.0 - u * u
    d1 -= v * v
    w = np.sqrt(d1)  # |w|; NaN where there is no direction
    # (px, pz) lies on the line n · (px, pz) = c, at ±root along it, n = (1 − δu, −δw).
    n1 = 1.0 - delta * u
    n_squared = n1 * n1 + (delta * delta) * d1
    c = q + delta * (v * py)
    root = np.sqrt((squared_legs[2] - py * py) * n_squared - c * c)  # |S|
    py = py + 0.0 * (w + root)  # NaN where one of them is; u and v likewise
    u, v = u + (py - py), v + (py - py)
    n2 = (-delta * sign_w) * w
    root = sign_s * root
    px, pz = (c * n1 - root * n2) / n_squared, (c * n2 + root * n1) / n_squared
    return px, py, pz, u, v, sign_w * w + (py - py)


def w_and_s(position: Floats, direction: Floats, delta: float, lever: float) -> tuple[Floats, Floats]:
    """Return w and S (...) of poses (..., 3), machine frame (kinematics notes, section 4).

    S = δ w px − (δu − 1) pz for the point of the line that leg 3 holds, relative to leg 3's base attachment;
    for another point p of the line it is δ w px + (1 − δu) pz + lever · w, lever = z_3 − δ x_3 in metres.
    """
    u, w = direction[..., 0], direction[..., 2]
    return w, delta * w * position[..., 0] + (1.0 - delta * u) * position[..., 2] + lever * w
