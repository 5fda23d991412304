"""Forward kinematics of the quadratic family in closed form (kinematics notes, section 3).

Everything here is in the *reduced* frame, where leg 3's base attachment and offset are zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Floats

_OTHERS = (0, 1, 3, 4)  # the legs whose equations are taken relative to leg 3


@dataclass(frozen=True, eq=False)
class LinearPart:
    """(q, py, u, v) = linear_map @ (squared legs) + constant: the linear half of the forward kinematics.

    linear_map (4, 5), constant (4,), with q = px − δ t and t = p · i.
    """

    linear_map: Floats
    constant: Floats

    @classmethod
    def of(cls, base: Floats, delta: float) -> LinearPart:
        """Build it for reduced base attachments (5, 2) with base[2] = 0. The matrix must be regular."""
        x, y = base[_OTHERS, 0], base[_OTHERS, 1]
        inverse = np.linalg.inv(system_matrix(base, delta))
        # x q + y py + δx² u + δxy v = −½ (l_i² − l_3² − k),  k = x² + y² + δ²x²
        pick = np.zeros((4, 5))
        pick[range(4), _OTHERS] = -0.5
        pick[:, 2] = 0.5
        return cls(inverse @ pick, inverse @ (0.5 * (x * x + y * y + (delta * x) ** 2)))

    def __call__(self, squared_legs: Floats) -> Floats:
        """Return (..., 4): q, py, u, v of squared leg lengths (..., 5)."""
        return squared_legs @ self.linear_map.T + self.constant


def system_matrix(base: Floats, delta: float) -> Floats:
    """Return the 4×4 matrix [x, y, δx², δxy] of the linear equations, reduced base attachments (5, 2)."""
    x, y = base[_OTHERS, 0], base[_OTHERS, 1]
    return np.stack([x, y, delta * x * x, delta * x * y], axis=1)


def discriminants(q: Floats, py: Floats, u: Floats, v: Floats, l3_squared: Floats, delta: float) -> tuple[Floats, Floats]:
    """Return D1 = w² and D = S² (kinematics notes, sections 3 and 4); negative where no pose exists."""
    d1 = 1.0 - u * u - v * v
    c = q + delta * v * py
    n_squared = 1.0 - 2.0 * delta * u + delta * delta * (1.0 - v * v)
    return d1, (l3_squared - py * py) * n_squared - c * c


def solve(
    squared_legs: Floats, linear: LinearPart, delta: float, sign_w: Floats, sign_s: Floats
) -> tuple[Floats, Floats]:
    """Return reduced positions and directions (..., 3); NaN where the mode (sign_w, sign_s) does not exist.

    squared_legs (..., 5); the signs broadcast against its leading axes.
    """
    q, py, u, v = np.moveaxis(linear(squared_legs), -1, 0)
    d1, d = discriminants(q, py, u, v, squared_legs[..., 2], delta)
    exists = (d1 >= 0.0) & (d >= 0.0)
    w = sign_w * np.sqrt(np.where(exists, d1, np.nan))
    root = sign_s * np.sqrt(np.where(exists, d, np.nan))
    # (px, pz) lies on the line n · (px, pz) = c, at ±root along it, n = (1 − δu, −δw).
    n1, n2 = 1.0 - delta * u, -delta * w
    c = q + delta * v * py
    k = 1.0 / (n1 * n1 + n2 * n2)
    px, pz = (c * n1 - root * n2) * k, (c * n2 + root * n1) * k
    nan = 0.0 * w  # py, u and v do not depend on the mode; they take its shape, and its absence
    return np.stack([px, py + nan, pz], axis=-1), np.stack([u + nan, v + nan, w], axis=-1)
