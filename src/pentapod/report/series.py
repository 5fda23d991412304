"""Rows of plots as a page's script draws them: curves by buckets, each with its lowest and its highest value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.report.pack import Packed

X_STEP = 1e-6
"""Step of the places along x, as a share of their range."""


@dataclass(frozen=True)
class Curve:
    """A curve of a row. dash: pixels on and off; style: "line", "points" or "bars"."""

    name: str
    colour: str
    dash: tuple[int, ...] = ()
    style: str = "line"

    def to_dict(self) -> dict[str, Any]:
        """Return it as the script reads it."""
        return {"name": self.name, "colour": self.colour, "dash": list(self.dash), "style": self.style}


@dataclass(frozen=True, eq=False)
class Row:
    """A row of plots. values (N, curves); limits: values of dashed lines; low: where its axis begins, else as needed.

    grouped: whether its curves are those of the legs, which buttons show and hide in all rows.
    """

    title: str
    values: Floats
    curves: Sequence[Curve]
    limits: Sequence[float] = field(default=())
    low: float | None = None
    grouped: bool = False


def packed_rows(packed: Packed, x: Floats, rows: Sequence[Row], label: str, unit: str = "") -> dict[str, Any]:
    """Add the arrays of rows over x (N,) to the page's, and return the rest as its script reads it."""
    packed.numbers("plot.x", x, max(float(np.ptp(x)), 1e-12) * X_STEP)
    shown: list[dict[str, Any]] = []
    for k, row in enumerate(rows):
        packed.numbers(f"plot.{k}", row.values)
        shown.append({
            "title": row.title, "array": f"plot.{k}", "series": [curve.to_dict() for curve in row.curves],
            "limits": [float(limit) for limit in row.limits], "low": row.low, "grouped": row.grouped,
        })  # fmt: skip
    return {"x": "plot.x", "rows": shown, "label": label, "unit": unit}


def bucket_edges(count: int, buckets: int) -> Ints:
    """Return where (B + 1,) buckets of as many of `count` members each begin, and where the last ends."""
    return np.linspace(0, count, max(1, min(buckets, count // 2)) + 1).astype(np.intp)


def extremes(values: Floats, buckets: int) -> Floats:
    """Return (2 · B, d): of each bucket the lowest and the highest value of each column, in the order that they rise.

    values (N, d). A curve through them covers the same pixels, and has the same largest and smallest value.
    """
    edges = bucket_edges(len(values), buckets)
    low, high = (of.reduceat(values, edges[:-1], axis=0) for of in (np.minimum, np.maximum))
    rises = values[edges[1:] - 1] >= values[edges[:-1]]
    both = np.stack([np.where(rises, low, high), np.where(rises, high, low)], axis=1)
    return both.reshape(-1, values.shape[1])


def bucket_places(x: Floats, buckets: int) -> Floats:
    """Return (2 · B,) where `extremes` are drawn: at one and at three quarters of each bucket of x (N,)."""
    edges = bucket_edges(len(x), buckets)
    ends = np.append(x, x[-1])[edges]
    return (ends[:-1, None] + np.diff(ends)[:, None] * (0.25, 0.75)).ravel()
