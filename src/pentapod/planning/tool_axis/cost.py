"""AxisCost: smoothness cost of the tool axes, with a penalty where they turn faster than the nominal axes.

The smoothest axes are fixed ones, but fixed axes may cost the legs more acceleration than the nominal axes, which turn
with the surface. So where the axis turns faster, or the second derivative of a leg length by the path is larger, than
with the nominal axes, the square of the excess is added.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.casadi_vectorised import Vectorised
from pentapod.numerics.convex.banded_qp import SoftRows
from pentapod.numerics.divided_differences import as_matrix, differences, divided_differences
from pentapod.planning.problem.formulation import leg_function
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.tool_axis.spline import BANDS, FORESIGHT_M, AxisSpline


@dataclass(frozen=True)
class CostOptions:
    """Options of the penalty on excess, which is a rate or bend beyond that of the nominal axes at the same node.

    weight: of the mean square of the relative excess, beside the cost of rates. free, unit: shares of the median of the
    nominal axes that are added to what is free of charge, and to the unit of excess. least_rate, least_bend: smaller
    medians count as this, rad/m of an axis and 1/m of a leg. near: rates and bends below this share of what is free do
    not enter a program.
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


_Rows = tuple[Floats, Ints, Floats, Floats]
"""Windows, starts, upper and weight of soft rows."""


@dataclass(frozen=True, eq=False)
class _Charge:
    """What a quantity costs at the nodes where it exceeds what is free there; all (n,).

    unit: what an excess is measured by; price: of the square of the excess so measured. near: see `CostOptions`.
    """

    free: Floats
    unit: Floats
    price: Floats
    near: float

    @classmethod
    def beyond(cls, nominal: Floats, least: float, price: Floats, options: CostOptions) -> _Charge:
        """Return the charge of exceeding what the nominal axes have; least: smaller medians count as this."""
        middle = max(float(np.median(nominal)) if len(nominal) else 0.0, least)
        return cls(nominal + options.free * middle, nominal + options.unit * middle, price, options.near)

    def of(self, values: Floats) -> float:
        """Return the charge of values (n, m)."""
        excess = np.maximum(values - self.free[:, None], 0.0) / self.unit[:, None]
        return float(self.price @ np.square(excess).sum(axis=1))

    def symbolic(self, values: Any) -> tuple[Any, Any, Any]:
        """Return the charge of casadi's values (m, n) by excesses, these as unknowns, and the room left, columns."""
        import casadi as ca  # noqa: PLC0415  heavy: only for the reference

        free, unit, price = (np.tile(each, (values.shape[0], 1)) for each in (self.free, self.unit, self.price))
        excess = ca.MX.sym("excess", *values.shape)
        return ca.dot(price, excess**2), ca.vec(excess), ca.vec(excess - (values - free) / unit)

    def entering(self, each: list[Floats]) -> tuple[Ints, Ints]:
        """Return the nodes and columns at which one of several values (n, m) comes near what is free."""
        node, column = np.nonzero(np.any([values > self.near * self.free[:, None] for values in each], axis=0))
        return node, column


class AxisCost:
    """The cost of coefficients (K, 2) of a spline of the axes, at the placement of a candidate.

    That of the spline, and `CostOptions.weight` times the excesses. Rates are of nominal plus lean, not normalised, by
    the path length of the spline; bends are the second derivatives of the leg lengths by it.
    """

    def __init__(
        self, problem: PlacementProblem, spline: AxisSpline, at: Candidate, options: CostOptions = CostOptions()
    ) -> None:
        self.spline, samples = spline, problem.samples
        nodes, way = self.spline.nodes, self.spline.way
        self.basis = self.spline.basis[nodes]
        self.weights, self.first = self.basis.data.reshape(-1, 4), self.basis.indices[::4].astype(np.intp)
        self.frames = self.spline.frames[nodes]
        self.given = (
            samples.tilt_centres[nodes].T,
            samples.nominal[nodes].T,
            self.frames.reshape(-1, 6).T,
            at.transform.rotation.T.reshape(-1, 1),
            at.transform.translation[:, None],
        )
        self.lengths = leg_function(problem, at.margins)
        self.legs = Vectorised(leg_function(problem, at.margins, slopes=True))
        (self.rate, rate_shares), (self.bend, bend_shares) = divided_differences(way, 1), divided_differences(way, 2)
        turning = differences(self.rate, samples.nominal[nodes])
        self.nominal_rates = np.einsum("nk,nak->na", turning, self.frames[: len(turning)])
        rates = np.linalg.norm(turning, axis=1)
        bends = np.abs(self.bends(np.zeros((self.basis.shape[1], 2)))).max(axis=1)
        price = options.weight * FORESIGHT_M**2 * (float(rate_shares @ rates**2) + options.least_rate**2)
        self.fast = _Charge.beyond(rates, options.least_rate, price * rate_shares, options)
        self.hard = _Charge.beyond(bends, options.least_bend, price * bend_shares, options)

    def of(self, c: Floats) -> float:
        """Return the cost of coefficients c (K, 2)."""
        charge = self.fast.of(self.rates(c) @ _DIRECTIONS) + self.hard.of(np.abs(self.bends(c)))
        return self.spline.cost_of(c) + charge

    def symbolic(self, c: Any) -> tuple[Any, Any, Any]:
        """Return the same for casadi's MX c (2, K), of c transposed: the cost, excesses as unknowns, room for them.

        The cost is that of `of` where each excess (MX, a column) is the least that leaves no room (MX, a column)
        negative, and is not negative itself.
        """
        import casadi as ca  # noqa: PLC0415  heavy: only for the reference

        leans = self.spline.cone * ca.mtimes(c, ca.DM(self.basis.T))
        tilt_centres, nominal, _, rotation, translation = self.given
        legs = self.lengths.map(len(self.frames))(
            leans,
            tilt_centres,
            nominal,
            self.frames.transpose(2, 0, 1).reshape(3, -1),
            rotation.reshape(3, 3).T,
            translation,
        )
        rates = self.nominal_rates.T + ca.mtimes(leans, ca.DM(as_matrix(self.rate, len(self.frames)).T))
        bends = ca.mtimes(legs, ca.DM(as_matrix(self.bend, len(self.frames)).T))
        x = ca.vec(c)
        own = 0.5 * ca.bilin(ca.DM(self.spline.whole_hessian()), x, x) + ca.dot(ca.DM(self.spline.gradient), x)
        fast, too_fast, room = self.fast.symbolic(ca.mtimes(_DIRECTIONS.T, rates))
        hard, too_hard, more = self.hard.symbolic(ca.vertcat(bends, -bends))
        return own + self.spline.constant + fast + hard, ca.vertcat(too_fast, too_hard), ca.vertcat(room, more)

    def rates(self, c: Floats) -> Floats:
        """Return the axes' rates (n − 1, 2), rad/m, in the carried pairs."""
        return self.nominal_rates + self.spline.cone * differences(self.rate, self.basis @ c)

    def bends(self, c: Floats) -> Floats:
        """Return the leg lengths' second derivatives (n − 2, n_legs) by the way, 1/m."""
        return differences(self.bend, self._legs(c)[0])

    def excess(self, c: Floats, *others: Floats) -> SoftRows:
        """Return the soft rows of the penalty around coefficients c (K, 2), to first order, where a limit is near.

        others: further coefficients at which a limit may be near.
        """
        legs, slopes = self._legs(c)
        rates, bends = self.rates(c) @ _DIRECTIONS, _both_ways(differences(self.bend, legs))
        near, column = self.fast.entering([rates, *(self.rates(x) @ _DIRECTIONS for x in others)])
        parts = [(near + k, self.rate[near, k, None] * _DIRECTIONS.T[column]) for k in range(2)]
        fast = self._rows(c, self.fast, near, rates[near, column], parts)
        near, column = self.hard.entering([bends, *(_both_ways(self.bends(x)) for x in others)])
        towards = _both_ways(slopes)
        parts = [(near + k, self.bend[near, k, None] * towards[near + k, column]) for k in range(3)]
        hard = self._rows(c, self.hard, near, bends[near, column], parts)
        return SoftRows(
            np.concatenate([fast[0], hard[0]]),
            np.concatenate([fast[1], hard[1]]),
            np.concatenate([fast[2], hard[2]]),
            np.concatenate([fast[3], hard[3]]),
        )

    def _rows(self, c: Floats, charge: _Charge, near: Ints, values: Floats, parts: list[tuple[Ints, Floats]]) -> _Rows:
        """Return the rows that keep values (R,) at nodes near (R,): sums over nodes of slopes times leans; around c.

        parts: of nodes (R,) and slopes (R, 2), the first node of each row first.
        """
        start, each = self.first[parts[0][0]], np.arange(len(near))
        windows = np.zeros((len(near), BANDS + 2))  # the last two stay zero, see BANDS
        for nodes, slopes in parts:
            for k, a in product(range(4), range(2)):
                reach = self.spline.cone * self.weights[nodes, k] / charge.unit[near]
                windows[each, 2 * (self.first[nodes] - start + k) + a] += reach * slopes[:, a]
        windows = np.ascontiguousarray(windows[:, :BANDS])
        x = np.append(c.ravel(), np.zeros(BANDS))
        here = (windows * x[2 * start[:, None] + np.arange(BANDS)]).sum(axis=1)
        room = (charge.free[near] - values) / charge.unit[near]
        return windows, 2 * start, room + here, charge.price[near]

    def _legs(self, c: Floats) -> tuple[Floats, Floats]:
        """Return leg lengths (n, n_legs) at the nodes and their derivatives (n, n_legs, 2) by the lean."""
        legs, slopes = self.legs(self.spline.cone * (self.basis @ c).T, *self.given)
        return legs.T, slopes.reshape(2, len(legs), -1).transpose(2, 1, 0)


def _both_ways(values: Floats) -> Floats:
    """Return values (n, n_legs, ...) of the legs, and those of the opposite sign after them."""
    return np.concatenate([values, -values], axis=1)
