"""Which unknowns measurements can tell, and which changes together they cannot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats


@dataclass(frozen=True)
class IdentifyOptions:
    """When an unknown counts as told.

    dependent: share of a column's length left beside the other columns that counts as rounding and curvature.
    negligible: smaller coefficients are not named in a gauge. named: so many of its largest coefficients are named.
    """

    dependent: float = 1e-7
    negligible: float = 5e-3
    named: int = 8


def identifiable(
    columns: Floats,
    order: Sequence[int],
    names: Sequence[str],
    limit: float,
    options: IdentifyOptions = IdentifyOptions(),
) -> tuple[list[int], tuple[str, ...]]:
    """Return the unknowns that can be identified, and for each other one which changes together change nothing.

    columns (M, K): derivatives of the measurements, each divided by its error; order: the unknowns, the first ones take
    precedence. One is identified if the part of its column that is orthogonal to those before it determines it to
    better than `limit`, metres.
    """
    taken: list[int] = []
    gauges: list[str] = []
    basis = np.zeros((len(columns), 0))
    for k in order:
        column = columns[:, k]
        left = column - basis @ (basis.T @ column)
        left = left - basis @ (basis.T @ left)  # twice: the first time leaves rounding errors
        rest, whole = float(np.linalg.norm(left)), float(np.linalg.norm(column))
        if rest * limit >= 1.0 and rest > options.dependent * whole:
            taken.append(k)
            basis = np.column_stack([basis, left / rest])
            continue
        found = np.linalg.lstsq(columns[:, taken], column, rcond=None)[0] if taken else ()
        others = np.asarray(found, dtype=np.float64)
        gauges.append(_gauge(names, k, taken, others, options))
    return taken, tuple(gauges)


def _gauge(names: Sequence[str], held: int, taken: list[int], others: Floats, options: IdentifyOptions) -> str:
    """Return which changes together change no measurement, such as "leg 2: offset +1, x +0.48 change no reading"."""
    largest = sorted(np.argsort(-np.abs(others), kind="stable")[: options.named].tolist())
    terms: list[tuple[str, float]] = [
        (str(names[taken[k]]), -float(others[k])) for k in largest if abs(others[k]) > options.negligible
    ]
    owner, kind = names[held].rsplit(" ", 1)
    short = [(name.removeprefix(f"{owner} ") if name.startswith(f"{owner} ") else name, by) for name, by in terms]
    parts = [f"{kind} +1", *(f"{name} {by:+.3g}" for name, by in short)]
    return f"{owner}: {', '.join(parts)} change no reading"
