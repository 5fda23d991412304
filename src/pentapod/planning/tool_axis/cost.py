"""AxisCost: smoothness cost of the tool axes, with a penalty where they turn faster than the nominal axes.

The smoothest axes are fixed ones, but fixed axes may cause larger leg accelerations than the nominal axes, which turn
with the surface. So where the axis turns faster, or the second derivative of a leg length by the path length is larger,
than with the nominal axes, the square of the excess is added.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.convex.banded_qp import SoftRows
from pentapod.numerics.divided_differences import as_matrix, differences, divided_differences
from pentapod.numerics.tape.vectorised import Vectorised
from pentapod.planning.problem.formulation import leg_function
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.tool_axis.spline import BANDS, AxisSpline
from pentapod.planning.tool_axis.spline import OPTIONS as SPLINE


@dataclass(frozen=True)
class CostOptions:
    """Options of the penalty on excess: a rate or bend beyond that of the nominal axes at the same node.

    weight: of the mean square of the relative excess, beside the cost of rates. free, unit: shares of the median of the
    nominal axes that are added to the threshold, and to the unit of excess. least_rate, least_bend: least medians,
    rad/m of an axis and 1/m of a leg. near: share of the threshold below which rates and bends do not enter a program.
    """

    weight: float = 1e4
    free: float = 0.01
    unit: float = 0.5
    least_rate: float = 0.1
    least_bend: float = 1e-9
    near: float = 0.7


_ANGLES = np.arange(12) * np.pi / 6.0
_DIRECTIONS = np.array([np.cos(_ANGLES), np.sin(_ANGLES)])
"""Columns: the directions in which rates are measured; a rate is at most 3.5 % larger than in the nearest of them."""


@dataclass(frozen=True, eq=False)
class _Penalty:
    """Quadratic penalty on the excess of a quantity over a threshold at each node; all (n,).

    unit: of the excess; weight: of the square of the excess in this unit. near: see `CostOptions`.
    """

    threshold: Floats
    unit: Floats
    weight: Floats
    near: float

    @classmethod
    def above(cls, nominal: Floats, least: float, weight: Floats, options: CostOptions) -> _Penalty:
        """Return the penalty on exceeding the values of the nominal axes; least: least median of them."""
        middle = max(float(np.median(nominal)) if len(nominal) else 0.0, least)
        return cls(nominal + options.free * middle, nominal + options.unit * middle, weight, options.near)

    def of(self, values: Floats) -> float:
        """Return the penalty of values (n, m)."""
        excess = np.maximum(values - self.threshold[:, None], 0.0) / self.unit[:, None]
        return float(self.weight @ np.square(excess).sum(axis=1))

    def symbolic(self, values: Any) -> tuple[Any, Any, Any]:
        """Return the penalty of casadi's values (m, n) by excesses, these as unknowns, and their slacks, columns."""
        import casadi as ca  # noqa: PLC0415  heavy: only for the reference

        shape = (values.shape[0], 1)
        threshold, unit, weight = (np.tile(each, shape) for each in (self.threshold, self.unit, self.weight))
        excess = ca.MX.sym("excess", *values.shape)
        return ca.dot(weight, excess**2), ca.vec(excess), ca.vec(excess - (values - threshold) / unit)

    def entering(self, each: list[Floats]) -> tuple[Ints, Ints]:
        """Return the nodes and columns at which one of several values (n, m) comes near the threshold."""
        node, column = np.nonzero(np.any([values > self.near * self.threshold[:, None] for values in each], axis=0))
        return node, column


class AxisCost:
    """The cost of coefficients (K, 2) of a spline of the axes, at the placement of a candidate.

    The cost of the spline plus the penalty. Rates are derivatives of nominal plus lean, not normalised, by the path
    length of the spline; bends are the second derivatives of the leg lengths by it.
    """

    def __init__(
        self, problem: PlacementProblem, spline: AxisSpline, at: Candidate, options: CostOptions = CostOptions()
    ) -> None:
        self.spline, samples = spline, problem.samples
        nodes, stations = self.spline.nodes, self.spline.stations
        self.basis = self.spline.basis[nodes]
        self.weights, self.first = self.basis.data.reshape(-1, 4), self.basis.indices[::4].astype(np.intp)
        self.frames = self.spline.frames[nodes]
        self.given = (
            samples.tilt_centres[nodes],
            samples.nominal[nodes],
            self.frames.reshape(-1, 6),
            at.transform.rotation.T.ravel(),
            at.transform.translation,
        )
        self.lengths = leg_function(problem, at.margins)
        self.legs = Vectorised(leg_function(problem, at.margins, slopes=True))
        self.rate, rate_shares = divided_differences(stations, 1)
        self.bend, bend_shares = divided_differences(stations, 2)
        turning = differences(self.rate, samples.nominal[nodes])
        self.nominal_rates = np.einsum("nk,nak->na", turning, self.frames[: len(turning)])
        rates = np.linalg.norm(turning, axis=1)
        bends = np.abs(self.bends(np.zeros((self.basis.shape[1], 2)))).max(axis=1)
        weight = options.weight * SPLINE.foresight**2 * (float(rate_shares @ rates**2) + options.least_rate**2)
        self.of_rates = _Penalty.above(rates, options.least_rate, weight * rate_shares, options)
        self.of_bends = _Penalty.above(bends, options.least_bend, weight * bend_shares, options)

    def of(self, c: Floats) -> float:
        """Return the cost of coefficients c (K, 2)."""
        penalty = self.of_rates.of(self.rates(c) @ _DIRECTIONS) + self.of_bends.of(np.abs(self.bends(c)))
        return self.spline.cost_of(c) + penalty

    def symbolic(self, c: Any) -> tuple[Any, Any, Any]:
        """Return the same for casadi's MX c (2, K), of c transposed: the cost, excesses as unknowns, their slacks.

        The cost is that of `of` where each excess (MX, a column) is the least that is not negative and leaves no slack
        (MX, a column) negative.
        """
        import casadi as ca  # noqa: PLC0415  heavy: only for the reference

        leans = self.spline.cone * ca.mtimes(c, ca.DM(self.basis.T))
        tilt_centres, nominal, _, rotation, translation = self.given
        frames = self.frames.transpose(2, 0, 1).reshape(3, -1)
        legs = self.lengths.map(len(self.frames))(
            leans, tilt_centres.T, nominal.T, frames, rotation.reshape(3, 3).T, translation
        )
        rates = self.nominal_rates.T + ca.mtimes(leans, ca.DM(as_matrix(self.rate, len(self.frames)).T))
        bends = ca.mtimes(legs, ca.DM(as_matrix(self.bend, len(self.frames)).T))
        x = ca.vec(c)
        own = 0.5 * ca.bilin(ca.DM(self.spline.whole_hessian()), x, x) + ca.dot(ca.DM(self.spline.gradient), x)
        first, of_rates, slack = self.of_rates.symbolic(ca.mtimes(_DIRECTIONS.T, rates))
        second, of_bends, more = self.of_bends.symbolic(ca.vertcat(bends, -bends))
        return own + self.spline.constant + first + second, ca.vertcat(of_rates, of_bends), ca.vertcat(slack, more)

    def rates(self, c: Floats) -> Floats:
        """Return the axes' rates (n − 1, 2), rad/m, in the transported frames."""
        return self.nominal_rates + self.spline.cone * differences(self.rate, self.basis @ c)

    def bends(self, c: Floats) -> Floats:
        """Return the leg lengths' second derivatives (n − 2, n_legs) by the path length, 1/m."""
        return differences(self.bend, self._legs(c)[0])

    def excess(self, c: Floats, *others: Floats) -> SoftRows:
        """Return the soft constraints of the penalty around coefficients c (K, 2), to first order, near the threshold.

        others: further coefficients at which a value may be near the threshold.
        """
        legs, slopes = self._legs(c)
        rates, bends = self.rates(c) @ _DIRECTIONS, _both_ways(differences(self.bend, legs))
        near, column = self.of_rates.entering([rates, *(self.rates(x) @ _DIRECTIONS for x in others)])
        parts = [(near + k, self.rate[near, k, None] * _DIRECTIONS.T[column]) for k in range(2)]
        first = self._rows(c, self.of_rates, near, rates[near, column], parts)
        near, column = self.of_bends.entering([bends, *(_both_ways(self.bends(x)) for x in others)])
        towards = _both_ways(slopes)
        parts = [(near + k, self.bend[near, k, None] * towards[near + k, column]) for k in range(3)]
        second = self._rows(c, self.of_bends, near, bends[near, column], parts)
        joined: Any = (np.concatenate(pair) for pair in zip(first, second, strict=True))
        return SoftRows(*joined)

    def _rows(
        self, c: Floats, penalty: _Penalty, near: Ints, values: Floats, parts: list[tuple[Ints, Floats]]
    ) -> tuple[Floats, Ints, Floats, Floats]:
        """Return windows, starts, upper bounds and weights of the soft constraints on values (R,) at nodes near (R,).

        The values are sums over nodes of slopes times leans, around c. parts: nodes (R,) and slopes (R, 2), the first
        node of each row first.
        """
        start, each = self.first[parts[0][0]], np.arange(len(near))
        windows = np.zeros((len(near), BANDS + 2))  # the last two stay zero, see BANDS
        for nodes, slopes in parts:
            for k, a in product(range(4), range(2)):
                reach = self.spline.cone * self.weights[nodes, k] / penalty.unit[near]
                windows[each, 2 * (self.first[nodes] - start + k) + a] += reach * slopes[:, a]
        windows = np.ascontiguousarray(windows[:, :BANDS])
        x = np.append(c.ravel(), np.zeros(BANDS))
        here = (windows * x[2 * start[:, None] + np.arange(BANDS)]).sum(axis=1)
        slack = (penalty.threshold[near] - values) / penalty.unit[near]
        return windows, 2 * start, slack + here, penalty.weight[near]

    def _legs(self, c: Floats) -> tuple[Floats, Floats]:
        """Return leg lengths (n, n_legs) at the nodes and their derivatives (n, n_legs, 2) by the lean."""
        legs, slopes = self.legs(self.spline.cone * (self.basis @ c), *self.given)
        return legs, slopes.reshape(len(legs), 2, -1).transpose(0, 2, 1)


def _both_ways(values: Floats) -> Floats:
    """Return values (n, n_legs, ...) of the legs, and those of the opposite sign after them."""
    return np.concatenate([values, -values], axis=1)
