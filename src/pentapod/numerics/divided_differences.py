"""Divided differences: derivatives of values that are known at places along a way."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from pentapod.base.arrays import Floats


def divided_differences(way: Floats, order: int) -> tuple[Floats, Floats]:
    """Return the factors (n − order, order + 1) of neighbours in a derivative by `way` (n,), order ≤ 2, and shares.

    shares (n − order,): of the whole way, the part that each stands for.
    """
    steps = np.diff(way)
    whole = max(float(steps.sum()), 1e-12)
    if order == 0:
        ends = np.concatenate([[0.0], steps, [0.0]]) if len(steps) else np.full(2, whole)
        return np.ones((len(way), 1)), 0.5 * (ends[1:] + ends[:-1]) / whole
    rate = np.stack([-1.0 / steps, 1.0 / steps], axis=1)
    if order == 1:
        return rate, steps / whole
    reach = 0.5 * (steps[1:] + steps[:-1])
    bend = np.stack([-rate[:-1, 0], rate[1:, 0] - rate[:-1, 1], rate[1:, 1]], axis=1) / reach[:, None]
    return bend, reach / whole


def differences(factors: Floats, values: Floats) -> Floats:
    """Return the derivatives (n − order, ...) of values (n, ...)."""
    count = len(factors)
    parts = [factors[:, k, None] * values[k : k + count] for k in range(factors.shape[1])]
    return np.asarray(sum(parts), dtype=np.float64)


def as_matrix(factors: Floats, size: int) -> Any:
    """Return the sparse matrix (n − order, n) that does what `differences` does for n = `size` values."""
    count, reach = factors.shape
    columns = np.arange(count)[:, None] + np.arange(reach)
    rows = np.broadcast_to(np.arange(count)[:, None], columns.shape)
    return sparse.csr_matrix((factors.ravel(), (rows.ravel(), columns.ravel())), shape=(count, size))
