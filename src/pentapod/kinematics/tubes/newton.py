"""Newton's method on the leg equations, with the analytic Jacobian, for a batch of poses at once."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.jacobian import invert
from pentapod.kinematics.tubes.leg_equations import Legs, float_jacobian, residuals, rows

ROUNDS = 12


def newton(position: Floats, direction: Floats, legs: Legs[Floats], scale: float) -> tuple[Floats, Floats, Bools]:
    """Return poses (3, N) near the given ones that satisfy the leg equations, and where Newton's method settled (N,).

    scale: metres that count as much as a radian, a power of two. A pose has settled when a step moves it by less than
    1e-9 of scale and of a radian; it then takes one step more, so that what is left is rounding. A pose that is NaN
    or meets a singular Jacobian does not settle, and comes back as NaN or as wherever it went.
    """
    p, i = position.copy(), direction.copy()
    settled = np.zeros(p.shape[-1], dtype=bool)
    open_ = np.flatnonzero(np.isfinite(p.sum(axis=0) + i.sum(axis=0)))
    last = np.zeros(p.shape[-1], dtype=bool)
    for _ in range(ROUNDS):
        if not open_.size:
            break
        x, d, some = p[:, open_], i[:, open_], _taken(legs, open_)
        jacobian = float_jacobian(rows(x, d, some), d, scale)
        values = np.empty((len(open_), 6))
        values[:, :5] = residuals(x, d, some).T
        values[:, 5] = 0.5 * (np.einsum("cn,cn->n", d, d) - 1.0)
        step = np.einsum("nij,nj->ni", invert(jacobian, np.nan), values)
        p[:, open_] -= scale * step[:, :3].T
        i[:, open_] -= step[:, 3:].T
        size = np.abs(step).max(axis=-1)
        settled[open_[last[open_]]] = True
        last[open_] = size < 1e-9
        open_ = open_[~settled[open_] & np.isfinite(size)]
    return p, i, settled & np.isfinite(p.sum(axis=0) + i.sum(axis=0))


def _taken(legs: Legs[Floats], which: np.ndarray) -> Legs[Floats]:
    """Return the geometry of some of the batch; quantities that are the same for all stay so."""

    def take(a: Floats) -> Floats:
        return a if a.shape[-1] == 1 else a[..., which]

    return Legs(take(legs.base), take(legs.offsets), take(legs.radii), take(legs.lengths), legs.rings)
