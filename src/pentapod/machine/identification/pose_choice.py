"""Which poses to measure: those that leave the smallest error at the tip, by exchange (V. V. Fedorov, 1972).

The error that is made small is the mean square of the tip's error over given poses after the fit, as the covariance
predicts it (I-optimality). What no pose tells is bounded by the tolerances of building.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import ArrayError
from pentapod.machine.calibration.parameters import PARAMETERS


@dataclass(frozen=True)
class Tolerances:
    """Of building, standard deviations in metres: of base joints along each axis, offsets, rings, zeros of scales."""

    joint: float = 0.5e-3
    offset: float = 0.5e-3
    radius: float = 0.5e-3
    zero: float = 1e-3

    @property
    def sigmas(self) -> Floats:
        """By parameter (30,)."""
        by_kind = {"offset": self.offset, "radius": self.radius, "zero": self.zero}
        return np.array([by_kind.get(name.split()[-1], self.joint) for name in PARAMETERS])


@dataclass(frozen=True)
class ChoiceOptions:
    """sweeps: how often all chosen poses are tried against all others, at most.

    gain: relative decrease of the squared error below which the exchange ends. tolerances: of what no pose tells.
    """

    sweeps: int = 20
    gain: float = 1e-3
    tolerances: Tolerances = field(default_factory=Tolerances)

    @property
    def information(self) -> Floats:
        """What the tolerances tell of the parameters (30, 30), 1/m²."""
        return np.diag(self.tolerances.sigmas**-2)


@dataclass(frozen=True, eq=False)
class Choice:
    """chosen (n,): indices of the candidates; tip_sigma: root mean square of the tip's error, metres."""

    chosen: Ints
    tip_sigma: float


def choose_poses(columns: Floats, tips: Floats, count: int, options: ChoiceOptions = ChoiceOptions()) -> Choice:
    """Return `count` of the candidates.

    columns (N, m, 30): derivatives of what is measured in each candidate, divided by its errors (whitened). tips
    (T, 3, 30): how the tip moves with the parameters in the poses in which it shall be right. First the best candidate
    is taken again and again, then each is exchanged for a better one. Raises ArrayError for a count that is not 1 to N.
    """
    if not 1 <= count <= len(columns):
        raise ArrayError("wrong count of poses", key="count", value=count, expected=f"1 to {len(columns)}")
    weight = np.einsum("tij,tik->jk", tips, tips) / len(tips)
    information = options.information.copy()
    each = columns.swapaxes(1, 2) @ columns
    chosen: list[int] = []
    for _ in range(count):
        gains = _gains(columns, information, weight)
        gains[chosen] = -np.inf
        chosen.append(int(np.argmax(gains)))
        information = information + each[chosen[-1]]
    cost = _cost(information, weight)
    for _ in range(options.sweeps):
        before = cost
        for place, pose in enumerate(chosen):
            without = information - each[pose]
            gains = _gains(columns, without, weight)
            gains[[other for other in chosen if other != pose]] = -np.inf
            best = int(np.argmax(gains))
            if best != pose and (better := _cost(without + each[best], weight)) < cost:
                chosen[place], information, cost = best, without + each[best], better
        if before - cost <= options.gain * before:
            break
    return Choice(np.array(chosen, dtype=np.intp), float(np.sqrt(cost)))


def predicted_tip_error(columns: Floats, tips: Floats, options: ChoiceOptions = ChoiceOptions()) -> float:
    """Return the root mean square of the tip's error, metres, after measuring all of the poses of `columns`."""
    weight = np.einsum("tij,tik->jk", tips, tips) / len(tips)
    return float(np.sqrt(_cost(options.information + np.einsum("nij,nik->jk", columns, columns), weight)))


def _cost(information: Floats, weight: Floats) -> float:
    return float(np.trace(np.linalg.solve(information, weight)))


def _gains(columns: Floats, information: Floats, weight: Floats) -> Floats:
    """Return by how much each candidate (N,) would lower the mean square error."""
    moved = columns @ np.asarray(np.linalg.inv(information), dtype=np.float64)
    inner = np.eye(columns.shape[1]) + moved @ columns.swapaxes(1, 2)
    taken = moved @ weight @ moved.swapaxes(1, 2)
    return np.trace(np.linalg.solve(inner, taken), axis1=1, axis2=2)
