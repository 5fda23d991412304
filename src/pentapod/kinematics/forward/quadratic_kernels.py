"""`solve` of `pentapod.kinematics.forward.quadratic`, compiled: the same operations in the same order.

Poses come as rows; the arithmetic runs over the columns of a small block, which the compiler turns into vector
instructions. Without fused multiply-adds and reordering, every number equals NumPy's to the last bit.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.numerics.kernels import kernel

_LANES = 64


@kernel
def poses(
    legs: Floats,
    signs: Floats,
    linear_map: Floats,
    constant: Floats,
    delta: float,
    origin: Floats,
    limits: Floats,
    position: Floats,
    direction: Floats,
    near: Bools,
) -> None:
    """Fill position and direction (N, 3) and near (N,) for legs (N, 5) and signs (1 or N, 2).

    linear_map (4, 5), constant (4,): of `LinearPart`. origin (3,): x_3, y_3 and z_3 of the reference leg.
    limits (2,): w² and S² of a pose that is not near a singularity.
    """
    count, each = len(legs), len(signs) > 1
    squared, found, close = np.empty((5, _LANES)), np.empty((6, _LANES)), np.empty(_LANES, dtype=np.bool_)
    sign_w, sign_s = np.full(_LANES, signs[0, 0]), np.full(_LANES, signs[0, 1])
    squared[:] = 0.0
    m, x3, y3, z3 = linear_map, origin[0], origin[1], origin[2]
    for start in range(0, count, _LANES):
        lanes = min(_LANES, count - start)
        for k in range(lanes):
            for j in range(5):
                squared[j, k] = legs[start + k, j]
            if each:
                sign_w[k], sign_s[k] = signs[start + k, 0], signs[start + k, 1]
        for k in range(_LANES):
            l1, l2, l3 = squared[0, k], squared[1, k], squared[2, k]
            l4, l5 = squared[3, k], squared[4, k]
            sound = (l1 >= 0.0) & (l2 >= 0.0) & (l3 >= 0.0) & (l4 >= 0.0) & (l5 >= 0.0)
            l1, l2, l3, l4, l5 = l1 * l1, l2 * l2, l3 * l3, l4 * l4, l5 * l5
            # Leg by leg from the left, as `LinearPart` does it.
            q = m[0, 0] * l1 + m[0, 1] * l2 + m[0, 2] * l3 + m[0, 3] * l4 + m[0, 4] * l5 + constant[0]
            py = m[1, 0] * l1 + m[1, 1] * l2 + m[1, 2] * l3 + m[1, 3] * l4 + m[1, 4] * l5 + constant[1]
            u = m[2, 0] * l1 + m[2, 1] * l2 + m[2, 2] * l3 + m[2, 3] * l4 + m[2, 4] * l5 + constant[2]
            v = m[3, 0] * l1 + m[3, 1] * l2 + m[3, 2] * l3 + m[3, 3] * l4 + m[3, 4] * l5 + constant[3]
            d1 = (1.0 - u * u) - v * v
            w = np.sqrt(d1)
            n1 = 1.0 - delta * u
            n_squared = n1 * n1 + (delta * delta) * d1
            c = q + delta * (v * py)
            d = (l3 - py * py) * n_squared - c * c
            close[k] = not ((d1 > limits[0]) & (d > limits[1]) & sound)
            n2 = (-delta * sign_w[k]) * w
            root = sign_s[k] * np.sqrt(d)
            w = sign_w[k] * w
            found[0, k] = ((c * n1 - root * n2) / n_squared - z3 * u) + x3
            found[1, k] = (py - z3 * v) + y3
            found[2, k] = (c * n2 + root * n1) / n_squared - z3 * w
            found[3, k], found[4, k], found[5, k] = u, v, w
        for k in range(lanes):
            near[start + k] = close[k]
            for j in range(3):
                position[start + k, j] = found[j, k]
                direction[start + k, j] = found[3 + j, k]
