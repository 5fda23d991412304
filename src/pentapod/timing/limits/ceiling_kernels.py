"""Largest ṡ² for which one s̈ keeps all rows of acceleration limits, compiled."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel


@kernel
def largest_x(first: Floats, second: Floats, offset: Floats, varies: int, size: Floats, x: Floats) -> None:
    """Fill x (n,), over all pairs of rows; first, second (n, R), offset (n, R), or (1, R) where `varies` is 0.

    A quotient that overflows is no bound, as it should be.
    """
    for k in range(len(x)):
        least, at = np.inf, k * varies
        for i in range(len(size)):
            for j in range(i + 1, len(size)):
                across = second[k, i] * first[k, j] - second[k, j] * first[k, i]
                above = size[i] * abs(first[k, j]) + size[j] * abs(first[k, i])
                shift = first[k, j] * offset[at, i] - first[k, i] * offset[at, j]
                above = max(above - np.sign(across) * shift, 0.0)
                if abs(across) > 0.0:
                    least = min(least, above / abs(across))
        x[k] = least
