"""Stretches: parts of a spline whose coefficients may move, the others staying as they are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.runs import marked_runs, members
from pentapod.numerics.convex.banded_qp import NEIGHBOURS, banded_product


@dataclass(frozen=True, eq=False)
class Stretches:
    """Runs (R, 2) of coefficients that may move: first of each and its end, NEIGHBOURS apart from each other at least.

    No waypoint belongs to two of them. Each must have NEIGHBOURS coefficients at least.
    """

    runs: Ints
    count: int

    @classmethod
    def around(cls, places: Bools, beside: Ints) -> Stretches:
        """Return those around coefficients `places` (K,), with as many on either side as `beside` (K,) says there.

        There must be a place, and on either side of it at least three coefficients, or the end of the path.
        """
        at, count = np.flatnonzero(places), len(places)
        edges = np.zeros(count + 1, dtype=np.intp)
        np.add.at(edges, np.maximum(at - beside[at], 0), 1)
        np.add.at(edges, np.minimum(at + beside[at] + 1, count), -1)
        runs = marked_runs(np.cumsum(edges[:-1]) > 0)
        apart = np.concatenate([[True], runs[1:, 0] - runs[:-1, 1] >= NEIGHBOURS])
        first = np.flatnonzero(apart)
        return cls(np.column_stack([runs[first, 0], np.append(runs[first[1:] - 1, 1], runs[-1, 1])]), count)

    @cached_property
    def free(self) -> Ints:
        """The coefficients (F,) that may move."""
        run, number = members(self.runs[:, 1] - self.runs[:, 0])
        return self.runs[run, 0] + number

    @cached_property
    def of_coefficients(self) -> Ints:
        """Which stretch each coefficient (K,) belongs to; -1 for none."""
        found = np.full(self.count, -1, dtype=np.intp)
        found[self.free] = np.repeat(np.arange(len(self.runs)), self.runs[:, 1] - self.runs[:, 0])
        return found

    def of_rows(self, basis: Any) -> Ints:
        """Return which stretch shapes each row of a sparse basis (n, K); -1 for none."""
        columns: Ints = basis.indices.reshape(-1, NEIGHBOURS)
        return np.asarray(self.of_coefficients[columns].max(axis=1))

    def part_of_cost(self, hessian: Floats, gradient: Floats, c: Floats) -> tuple[Floats, Floats]:
        """Return Hessian and gradient of a banded cost by the free coefficients, the others as in c (K, 2)."""
        unknowns = (2 * self.free[:, None] + np.arange(2)).ravel()
        lower = np.zeros((len(hessian), len(unknowns)))
        for k in range(min(len(hessian), len(unknowns))):
            column = unknowns[: len(unknowns) - k]
            lower[k, : len(column)] = np.where(unknowns[k:] == column + k, hessian[k, column], 0.0)
        fixed = c.copy()
        fixed[self.free] = 0.0
        return lower, (banded_product(hessian, fixed.ravel()) + gradient)[unknowns]

    def part_of_basis(self, basis: Any, c: Floats) -> tuple[Any, Floats]:
        """Return a basis (n, F) of rows that stretches shape, by the free coefficients, and what the others add (n, 2).

        basis (n, K) sparse, NEIGHBOURS a row; so is what is returned. c (K, 2): the coefficients.
        """
        columns, weights = basis.indices.reshape(-1, NEIGHBOURS), basis.data.reshape(-1, NEIGHBOURS)
        free = self.of_coefficients[columns] >= 0
        fixed = np.einsum("nk,nkd->nd", np.where(free, 0.0, weights), c[columns])
        first = columns[np.arange(len(columns)), free.argmax(axis=1)]  # the first free one
        start = np.minimum(np.searchsorted(self.free, first), len(self.free) - NEIGHBOURS)
        there = start[:, None] + np.arange(NEIGHBOURS)
        number = self.free[there] - columns[:, :1]
        inside = (number >= 0) & (number < NEIGHBOURS)
        data = np.where(inside, np.take_along_axis(weights, np.clip(number, 0, NEIGHBOURS - 1), axis=1), 0.0)
        ends = NEIGHBOURS * np.arange(len(columns) + 1)
        return sparse.csr_matrix((data.ravel(), there.ravel(), ends), shape=(len(columns), len(self.free))), fixed
