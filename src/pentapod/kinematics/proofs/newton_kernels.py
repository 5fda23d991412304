"""Poses of a machine as built by Newton's method, compiled. Arrays as in `krawczyk_kernels`."""

from __future__ import annotations

from pentapod.base.arrays import Floats
from pentapod.kinematics.krawczyk.krawczyk_kernels import fill_line, invert
from pentapod.numerics.kernels import kernel

TURNS, SETTLED = 12, 1e-6
"""Newton's steps at most; size of a step (metres, radians) after which one more with the same Jacobian ends them."""


@kernel
def solved(
    x: Floats,
    lengths: Floats,
    geometry: Floats,
    rings: Floats,
    first: Floats,
    second: Floats,
    change: Floats,
    step: Floats,
    jacobian: Floats,
    work: Floats,
    inverse: Floats,
    g: Floats,
) -> bool:
    """Move a pose to a solution by Newton's method, and fill C from its last step; return whether it converged."""
    for _ in range(TURNS):
        fill_line(x, x, geometry, first, second, change, step, jacobian, rings)
        if not invert(jacobian, work, inverse):
            return False
        equations(x, lengths, first, rings, g)
        if _newton_step(inverse, g, x) < SETTLED:
            fill_line(x, x, geometry, first, second, change, step, jacobian, rings)
            equations(x, lengths, first, rings, g)
            _newton_step(inverse, g, x)
            return True
    return False


@kernel
def equations(x: Floats, lengths: Floats, vectors: Floats, rings: Floats, g: Floats) -> None:
    """Fill G (6,) at a pose whose leg vectors and ring distances `fill_line` has filled."""
    for j in range(5):
        r = rings[j, 8]
        square = vectors[j, 0] ** 2 + vectors[j, 1] ** 2 + vectors[j, 2] ** 2
        g[j] = 0.5 * (square - lengths[j] ** 2)
        if r > 0.0:
            g[j] += r * (0.5 * r - rings[j, 0])
    g[5] = 0.5 * (x[3] ** 2 + x[4] ** 2 + x[5] ** 2 - 1.0)


@kernel
def _newton_step(inverse: Floats, g: Floats, x: Floats) -> float:
    """Subtract C G from the pose; return the largest change."""
    largest = 0.0
    for r in range(6):
        total = 0.0
        for n in range(6):
            total += inverse[r, n] * g[n]
        x[r] -= total
        largest = max(largest, abs(total))
    return largest
