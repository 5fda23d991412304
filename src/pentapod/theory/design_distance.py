"""How far any linear pentapod is from the architecturally singular ones, platform and base moving independently.

The problem of A. Kapilavai and G. Nawratil, "Architecture singularity distance computations for linear pentapods"
(arXiv 2312.09160, 2023), here in the metric √(Σ |Δa_k|² + Σ Δz_k²) of the attachments, the base staying plane. A design
is architecturally singular where the five rows (1, x, y, z, xz, yz) are dependent: where weights λ ≠ 0 exist with

    Σ λ_k (1, x_k, y_k, z_k, x_k z_k, y_k z_k) = 0,

six equations for four ratios, so in general two conditions. Designs that are singular for a simple reason (two legs
that coincide, three on one base joint, four on one platform joint, four or five base joints on a line) satisfy it with
some λ = 0; they are starts of the search, beside the rows that depend most.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.values import Value
from pentapod.kinematics.five_legs import FiveLegs, given

LEGS = FiveLegs.n_legs


@dataclass(frozen=True)
class DesignSearch(Value):
    """Options of the search.

    random: starts beside the simple ones; seed: of them. descents: how many of all starts, the nearest first, are
    improved. settled: largest dependence, of unit rows, that is left in a design that counts as singular.
    """

    random: int = 24
    seed: int = 1
    descents: int = 40
    settled: float = 1e-9


@dataclass(frozen=True, eq=False)
class DesignDistance(Value):
    """The nearest architecturally singular design that was found.

    distance: √(Σ |Δa_k|² + Σ Δz_k²), metres. base (5, 2), offsets (5,): that design, metres. weights (5,): of the legs
    whose rows depend there, λ of length 1: a leg of weight 0 has no part in it.
    """

    distance: float
    base: Floats
    offsets: Floats
    weights: Floats

    def __post_init__(self) -> None:
        set_frozen(
            self,
            base=frozen(self.base, "base", (LEGS, 2)),
            offsets=frozen(self.offsets, "offsets", (LEGS,)),
            weights=frozen(self.weights, "weights", (LEGS,)),
        )


def design_distance(base: ArrayLike, offsets: ArrayLike, search: DesignSearch = DesignSearch()) -> DesignDistance:
    """Return the distance of a design, base (5, 2) and offsets (5,) in metres, from architectural singularity.

    The least of the local minima found by sequential quadratic programming from many starts; nothing proves that no
    other is nearer. Raises MachineError for wrong shapes.
    """
    xy, z = given(base, "base", (LEGS, 2)), given(offsets, "offsets", (LEGS,))
    design = np.column_stack([xy, z])
    centre, size = design.mean(axis=0), float(np.ptp(design, axis=0).max())
    if size == 0.0:
        return DesignDistance(0.0, xy, z, np.array([1.0, -1.0, 0.0, 0.0, 0.0]) / np.sqrt(2.0))
    own = (design - centre) / size
    starts = [(start, _weights(start)) for start in _simple(own)]
    rng = np.random.default_rng(search.seed)
    starts += [(own, _weights(own))]
    starts += [(own + rng.normal(scale=0.3, size=own.shape), rng.normal(size=LEGS)) for _ in range(search.random)]
    starts.sort(key=lambda start: float(np.square(start[0] - own).sum()))
    best, weights, least = starts[0][0], starts[0][1], np.inf
    for start, weight in starts:
        if _dependence(start, weight) <= search.settled and np.linalg.norm(start - own) < least:
            best, weights, least = start, weight, float(np.linalg.norm(start - own))
    for start, weight in starts[: search.descents]:
        found = _descend(own, start, weight / np.linalg.norm(weight))
        if _dependence(*found) <= search.settled and np.linalg.norm(found[0] - own) < least:
            best, weights, least = *found, float(np.linalg.norm(found[0] - own))
    singular = size * best + centre
    return DesignDistance(size * least, singular[:, :2], singular[:, 2], weights)


def _rows(design: Floats) -> Floats:
    """Return the rows (5, 6) of a design (5, 3)."""
    x, y, z = design.T
    return np.stack([np.ones_like(x), x, y, z, x * z, y * z], axis=1)


def _weights(design: Floats) -> Floats:
    """Return the weights (5,), of length 1, with which the rows of a design depend most."""
    return np.linalg.svd(_rows(design))[0][:, -1]


def _dependence(design: Floats, weights: Floats) -> float:
    return float(np.abs(weights @ _rows(design)).max() / np.linalg.norm(weights))


def _simple(design: Floats) -> Iterator[Floats]:
    """Yield the nearest designs (5, 3) that are singular for a simple reason."""
    for legs in combinations(range(LEGS), 2):
        yield _moved(design, legs, design[list(legs)].mean(axis=0))
    for legs in combinations(range(LEGS), 3):
        rows = design[list(legs)].copy()
        rows[:, :2] = rows[:, :2].mean(axis=0)
        yield _moved(design, legs, rows)
        rows = design[list(legs)].copy()
        rows[:, :2], rows[:, 2] = _on_line(rows[:, :2]), rows[:, 2].mean()
        yield _moved(design, legs, rows)
    for legs in combinations(range(LEGS), 4):
        rows = design[list(legs)].copy()
        rows[:, 2] = rows[:, 2].mean()
        yield _moved(design, legs, rows)
        yield _moved(design, legs, np.column_stack([_on_line(design[list(legs), :2]), design[list(legs), 2]]))
    yield np.column_stack([_on_line(design[:, :2]), design[:, 2]])


def _moved(design: Floats, legs: tuple[int, ...], rows: Floats) -> Floats:
    moved = design.copy()
    moved[list(legs)] = rows
    return moved


def _on_line(points: Floats) -> Floats:
    """Return points (n, 2) moved onto the line nearest to them."""
    centre = points.mean(axis=0)
    along = np.linalg.svd(points - centre)[2][0]
    return centre + ((points - centre) @ along)[:, None] * along


def _descend(own: Floats, start: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Return a singular design (5, 3) near `start` that is locally nearest to `own`, and its weights."""
    from scipy.optimize import minimize  # noqa: PLC0415  heavy: only where a design is judged

    count = own.size

    def parts(flat: Floats) -> tuple[Floats, Floats]:
        return flat[:count].reshape(LEGS, 3), flat[count:]

    def value(flat: Floats) -> tuple[float, Floats]:
        move = flat[:count] - own.ravel()
        return 0.5 * float(move @ move), np.append(move, np.zeros(LEGS))

    def gap(flat: Floats) -> Floats:
        design, weight = parts(flat)
        return np.append(weight @ _rows(design), 0.5 * (weight @ weight - 1.0))

    def slope(flat: Floats) -> Floats:
        design, weight = parts(flat)
        x, y, z = design.T
        one, none = np.ones_like(x), np.zeros_like(x)
        by_x = np.stack([none, one, none, none, z, none], axis=1)
        by_y = np.stack([none, none, one, none, none, z], axis=1)
        by_z = np.stack([none, none, none, one, x, y], axis=1)
        by_design = (weight[:, None, None] * np.stack([by_x, by_y, by_z], axis=1)).reshape(count, 6).T
        upper = np.concatenate([by_design, _rows(design).T], axis=1)
        return np.concatenate([upper, np.append(np.zeros(count), weight)[None]])

    equal: Any = {"type": "eq", "fun": gap, "jac": slope}
    options = {"ftol": 1e-14, "maxiter": 150}
    flat = np.append(start.ravel(), weights)
    flat = minimize(value, flat, jac=True, method="SLSQP", constraints=equal, options=options).x
    for _ in range(4):  # onto the equations, to the last digit
        flat = flat - np.linalg.lstsq(slope(flat), gap(flat), rcond=None)[0]
    return parts(flat)
