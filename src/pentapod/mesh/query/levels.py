"""Level values of a quantity whose level lines on a surface are nowhere farther apart than a stepover.

On a facet where the quantity changes by s per metre, lines at levels d apart are d / s apart on the surface. So each
facet requires a density of 1 / (s · stepover) levels per unit between its lowest corner and its highest. The density at
a value is the largest that any facet requires there. Levels are spread evenly over it, half a step inside both ends.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.mesh.patch import Patch

BINS = 2048
"""Intervals of values on which the density is constant; a power of two."""

MOST_LEVELS = 1_000_000
"""Level values beyond which the passes are refused as too dense."""


def gradients(patch: Patch, values: Floats) -> Floats:
    """Return the gradient (F, 3) on each facet of a quantity at its corners (F, 3); zero on facets without area."""
    a, b, c = (patch.vertices[patch.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    square = (normal * normal).sum(axis=1)
    inverse = np.where(square > 0.0, 1.0 / np.where(square > 0.0, square, 1.0), 0.0)[:, None]
    up, over = (values[:, 1] - values[:, 0])[:, None], (values[:, 2] - values[:, 0])[:, None]
    return (up * np.cross(c - a, normal) + over * np.cross(normal, b - a)) * inverse


def spread(low: Floats, high: Floats, density: Floats) -> Floats:
    """Return ascending levels (L,) with at least `density` (F,) levels per unit on each interval low to high (F,).

    Raises ToolpathError for more than `MOST_LEVELS`.
    """
    first, last = float(low.min()), float(high.max())
    if not last > first:
        return np.array([first])
    bins, needed = _largest_density(low, high, density, first, last)
    total = np.concatenate([[0.0], np.cumsum(needed * np.diff(bins))])
    if not total[-1] <= MOST_LEVELS:
        raise ToolpathError(
            "the passes are too dense for this mesh",
            key="stepover",
            expected=f"at most {MOST_LEVELS:,} levels",
            remedy="is the unit of the mesh right? If it is, take a larger stepover",
        )
    count = max(1, int(np.ceil(total[-1] * (1.0 - 1e-9))))
    return np.interp((np.arange(count) + 0.5) * (total[-1] / count), total, bins)


def _largest_density(low: Floats, high: Floats, density: Floats, first: float, last: float) -> tuple[Floats, Floats]:
    """Return bins (B + 1,) from first to last, and the largest density (B,) of the intervals over each.

    A sparse table: each interval of bins is the union of two overlapping ones of a power-of-two length; the maximum is
    passed down from the long ones to the short.
    """
    scale = BINS / (last - first)
    start = np.clip(((low - first) * scale).astype(np.intp), 0, BINS - 1)
    stop = np.clip(np.ceil((high - first) * scale).astype(np.intp), start + 1, BINS)
    power = np.log2(stop - start).astype(np.intp)
    tables = np.zeros((BINS.bit_length(), BINS))
    np.maximum.at(tables, (power, start), density)
    np.maximum.at(tables, (power, stop - (1 << power)), density)
    for k in range(len(tables) - 1, 0, -1):
        half = 1 << (k - 1)
        tables[k - 1] = np.maximum(tables[k - 1], tables[k])
        tables[k - 1, half:] = np.maximum(tables[k - 1, half:], tables[k, : BINS - half])
    least = tables[0][tables[0] > 0.0].min(initial=np.inf)
    # Values between two bodies are on no facet and need no level.
    needed = np.where(tables[0] > 0.0, tables[0], 0.0 if np.isfinite(least) else 1.0)
    return np.linspace(first, last, BINS + 1), needed
