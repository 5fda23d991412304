"""Level values of a quantity such that its level lines on a surface are nowhere further apart than asked for.

On a facet where the quantity changes by s per metre, lines at levels d apart are d / s apart on the surface. So each
facet asks for at least 1 / (s · stepover) levels per unit between its lowest corner and its highest; the most
that any facet asks for at a value is what all get there. Levels are spread evenly over that density, half a
step inside both ends: where the surface is steep across the lines they are closer together, elsewhere not.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.mesh.patch import Patch

BINS = 2048
MOST_LEVELS = 1_000_000


def gradients(patch: Patch, values: Floats) -> Floats:
    """Return the gradient (F, 3) on each facet of a quantity at its corners (F, 3); zero on facets without area."""
    a, b, c = (patch.vertices[patch.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    square = (normal * normal).sum(axis=1)
    inverse = np.where(square > 0.0, 1.0 / np.where(square > 0.0, square, 1.0), 0.0)[:, None]
    up, over = (values[:, 1] - values[:, 0])[:, None], (values[:, 2] - values[:, 0])[:, None]
    return (up * np.cross(c - a, normal) + over * np.cross(normal, b - a)) * inverse


def spread(low: Floats, high: Floats, density: Floats) -> Floats:
    """Return ascending levels (L,), at least as dense as each interval low to high (F,) asks: levels per unit.

    Raises ToolpathError where that would be more than a million.
    """
    first, last = float(low.min()), float(high.max())
    if not last > first:
        return np.array([first])
    bins, needed = _most(low, high, density, first, last)
    total = np.concatenate([[0.0], np.cumsum(needed * np.diff(bins))])
    if not total[-1] <= MOST_LEVELS:
        raise ToolpathError(
            "the passes are too dense for this mesh",
            key="stepover",
            expected=f"at most {MOST_LEVELS:,} levels",
            remedy="check the unit of the mesh and the stepover",
        )
    count = max(1, int(np.ceil(total[-1] * (1.0 - 1e-9))))
    return np.interp((np.arange(count) + 0.5) * (total[-1] / count), total, bins)


def _most(low: Floats, high: Floats, density: Floats, first: float, last: float) -> tuple[Floats, Floats]:
    """Return bins (B + 1,) from first to last, and the most (B,) that intervals over each ask for.

    Each interval of bins is the union of two of a power-of-two length, which overlap; the most over those is
    handed down from the long to the short.
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
    # Between bodies there may be nothing; a level there meets nothing.
    needed = np.where(tables[0] > 0.0, tables[0], 0.0 if np.isfinite(least) else 1.0)
    return np.linspace(first, last, BINS + 1), needed
