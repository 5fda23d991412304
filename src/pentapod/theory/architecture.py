"""How far a design is from the architecturally singular ones, in metres of attachment movement.

Within the family: when a base attachment moves along x its platform offset moves with it, z_i = δ x_i. (Platform and
base moving independently is the problem of A. Kapilavai and G. Nawratil, "Architecture singularity distance
computations for linear pentapods", 2023.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.values import Value
from pentapod.kinematics.families.conics import Conic, conic_determinant, forbidden_conic


@dataclass(frozen=True, eq=False)
class ArchitecturalDistance(Value):
    """How far base attachments can move before the design is singular in every pose. Metres.

    alone (5,): the distance of each attachment from its `forbidden_conic`, the others staying. together: the smallest
    √(Σ |Δa_i|²) over all five that reaches F = 0, and `nearest` (5, 2) the base attachments there. A design whose
    attachments are each placed to within together/√5 cannot be singular.
    """

    alone: Floats
    together: float
    nearest: Floats

    def __post_init__(self) -> None:
        set_frozen(self, alone=frozen(self.alone, "alone", (5,)), nearest=frozen(self.nearest, "nearest", (5, 2)))


def architectural_distance(base: ArrayLike) -> ArchitecturalDistance:
    """Return the distances of base attachments (5, 2), metres, from architectural singularity.

    `alone` is exact: the nearest points of a conic are roots of a quartic. `together` is the least of the local minima
    found by sequential quadratic programming from many starts: each attachment on its own conic, and the pairs of
    lines, one of them vertical, into which the conic can degenerate. Nothing proves that no other is nearer.
    """
    conics = [forbidden_conic(base, leg) for leg in range(5)]
    xy = np.asarray(base, dtype=np.float64)
    feet = np.array([_nearest(conic, point) for conic, point in zip(conics, xy, strict=True)])
    alone = np.linalg.norm(feet - xy, axis=1)
    size = float(np.abs(xy - xy.mean(axis=0)).max())
    if size == 0.0 or not alone.all():
        return ArchitecturalDistance(alone, 0.0, xy)
    starts = [np.where(np.arange(5)[:, None] == leg, feet, xy) for leg in range(5)]
    starts += _line_pairs(xy)
    starts.sort(key=lambda start: float(((start - xy) ** 2).sum()))
    tried = [_descend((start - xy.mean(axis=0)) / size, (xy - xy.mean(axis=0)) / size) for start in starts[:10]]
    moves = [*(start - xy for start in starts), *(size * move for move in tried if move is not None)]
    best = min(moves, key=lambda move: float((move**2).sum()))
    return ArchitecturalDistance(alone, float(np.linalg.norm(best)), xy + best)


def _nearest(conic: Conic, point: Floats) -> Floats:
    """Return the point (2,) nearest to `point` on a conic without y² term."""
    x0, y0 = point - conic.origin
    a, b, _, d, e, g = conic.coefficients
    scale = np.abs(conic.coefficients).max()
    if scale == 0.0:
        return point
    # y = y0 − n/q on the curve: stationary (x − x0)² + n²/q² is a quartic in x.
    n, q = np.array([a, d + b * y0, g + e * y0]) / scale, np.array([b, e]) / scale
    slope = np.polysub(np.polymul(np.polyder(n), q), b / scale * n)
    quartic = np.polyadd(np.polymul([1.0, -x0], np.polymul(q, np.polymul(q, q))), np.polymul(n, slope))
    x = np.roots(np.trim_zeros(quartic, "f")).real if quartic.any() else np.array([x0])
    x = np.append(x, x0)
    with np.errstate(divide="ignore", invalid="ignore"):
        y = y0 - np.polyval(n, x) / np.polyval(q, x)
    # Vertical lines through the point's own height: part of a degenerate conic, or crossed by a proper one.
    level = np.roots(np.trim_zeros(n, "f")) if n.any() else np.zeros(0)
    level = level[np.abs(level.imag) <= 1e-9 * np.abs(level)].real
    candidates = np.concatenate([np.stack([x, y], axis=1), np.stack([level, np.full_like(level, y0)], axis=1)])
    candidates = candidates[np.isfinite(candidates).all(axis=1)]
    distance = np.linalg.norm(candidates - (x0, y0), axis=1)
    return candidates[np.argmin(distance)] + conic.origin


def _line_pairs(xy: Floats) -> list[Floats]:
    """Return bases (5, 2) whose attachments lie on a vertical line and another line, nearest for each partition."""
    found: list[Floats] = []
    for mask in range(31):
        upright = (mask >> np.arange(5)) & 1 == 1
        moved = xy.copy()
        moved[upright, 0] = xy[upright, 0].mean() if upright.any() else 0.0
        rest = xy[~upright]
        centre = rest.mean(axis=0)
        along = np.linalg.svd(rest - centre)[2][0]
        moved[~upright] = centre + ((rest - centre) @ along)[:, None] * along
        found.append(moved)
    return found


def _descend(start: Floats, base: Floats) -> Floats | None:
    """Return the locally smallest move (5, 2) of unit-sized attachments to F = 0 near `start`, or None."""
    from scipy.optimize import minimize  # noqa: PLC0415  heavy: only where a design is judged

    scale = float(np.abs(_gradient(start)).max()) or 1.0
    answer = minimize(
        lambda flat: (0.5 * float(((flat - base.ravel()) ** 2).sum()), flat - base.ravel()),
        start.ravel(),
        jac=True,
        method="SLSQP",
        constraints={
            "type": "eq",
            "fun": lambda flat: float(conic_determinant(flat.reshape(5, 2))) / scale,
            "jac": lambda flat: _gradient(flat.reshape(5, 2)).ravel() / scale,
        },
        options={"ftol": 1e-15, "maxiter": 80},
    )
    found = answer.x.reshape(5, 2)
    for _ in range(3):  # onto F = 0, to the last digit
        slope = _gradient(found)
        found = found - float(conic_determinant(found)) / max(float((slope**2).sum()), 1e-300) * slope
    slope = _gradient(found)
    off = abs(float(conic_determinant(found))) / max(float(np.linalg.norm(slope)), 1e-300)
    return found - base if off <= 1e-13 else None


def _gradient(base: Floats) -> Floats:
    """Return ∂F/∂a_i (5, 2): the slopes of each attachment's forbidden conic at the attachment."""
    slopes = np.empty((5, 2))
    for leg in range(5):
        conic = forbidden_conic(base, leg)
        x, y = base[leg] - conic.origin
        a, b, _, d, e, _ = conic.coefficients
        slopes[leg] = 2.0 * a * x + b * y + d, b * x + e
    return slopes
