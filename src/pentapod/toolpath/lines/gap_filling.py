"""Gap filling: additional lines wherever the passes on a surface leave more than half a stepover.

Distances are geodesic and counted in stepovers. Lines half a step from the source and then a step apart cover the
surface except for the ridges where fronts meet: there the last line may be up to a step away. Whatever is further than
half a step from every line gets one more line around it, half a step from the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.geodesic import border_vertices, distances, seeds_along
from pentapod.mesh.query.slicing import LevelSet
from pentapod.mesh.topology import components


@dataclass(frozen=True)
class GapOptions:
    """How gaps are found.

    facets_per_step: facet edges in a stepover, for distances that are good to a few percent. negligible: share of the
    area that gaps without lines of their own may have in total. slack: a gap counts from this many half steps on.
    """

    facets_per_step: float = 3.5
    negligible: float = 5e-4
    slack: float = 1.04

    def longest_edge(self, steps: Floats) -> float:
        """Return how long facet edges may be, metres, for stepovers (F,)."""
        return float(steps.min()) / self.facets_per_step


FRONTS = GapOptions(facets_per_step=5.0, negligible=2e-4)
"""For lines that are themselves at a geodesic distance: they turn sharp corners, which finer facets keep sharp."""


def gap_lines(
    patch: Patch,
    seeds: Floats,
    slowness: Floats,
    options: GapOptions = FRONTS,
    *,
    where: Bools | None = None,
    area: float | None = None,
) -> Passes:
    """Return lines around everything that is more than half a step from the passes.

    seeds (V,): distance in steps of vertices near the passes, infinite elsewhere. slowness (F,): steps per metre; the
    facets must be small compared with a step. where (V,): the only vertices that may lie in a gap. area: of the whole
    region, square metres, if the patch is a part of it. What no seed reaches gets a line midway between its borders,
    and others a step from it.
    """
    distance = distances(patch, seeds, slowness)
    parts: list[Passes] = []
    if not np.isfinite(distance).all():
        middle = _middle_lines(patch, distance, slowness)
        parts.append(middle.lines())
        distance = distances(patch, np.minimum(distance, seeds_along(middle, slowness)), slowness)
    distance = np.where(np.isfinite(distance) & (True if where is None else where), distance, 0.0)
    levels: Floats = np.arange(0.5, float(distance.max(initial=0.0)), 1.0)
    if len(levels):
        lines = LevelSet(patch, distance, levels).lines()
        negligible = options.negligible * (float(patch.areas.sum()) if area is None else area)
        parts.append(lines.where(_needed(patch, distance > 0.5 * options.slack, lines, negligible)))
    return Passes.joined(parts)


def _middle_lines(patch: Patch, distance: Floats, slowness: Floats) -> LevelSet:
    """Return the lines midway between the border and the innermost point of each body that `distance` (V,) misses."""
    inner = distances(patch, np.where(border_vertices(patch) & ~np.isfinite(distance), 0.0, np.inf), slowness)
    body = components(len(patch.vertices), *patch.topology.edges.T)[1]
    missed = ~np.isfinite(distance) & np.isfinite(inner)
    furthest = np.zeros(int(body.max()) + 1)
    np.maximum.at(furthest, body[missed], inner[missed])
    share = np.where(missed, inner / np.where(furthest[body] > 0.0, furthest[body], 1.0), 0.0)
    return LevelSet(patch, share, np.array([0.5]))


def _needed(patch: Patch, in_gap: Bools, lines: Passes, negligible: float) -> Bools:
    """Return which lines (P,) are needed: all but those around the smallest gaps, of `negligible` area together."""
    area = np.zeros(len(patch.vertices))
    np.add.at(area, patch.faces.ravel(), np.repeat(patch.areas / 3.0, 3))
    if not in_gap.any() or not len(lines):
        return np.zeros(len(lines), dtype=np.bool_)
    nearest = np.asarray(KDTree(lines.points).query(patch.vertices[in_gap])[1])
    served = np.bincount(lines.pass_of_point[nearest], weights=area[in_gap], minlength=len(lines))
    order = np.argsort(served, kind="stable")
    needed = np.empty(len(lines), dtype=np.bool_)
    needed[order] = np.cumsum(served[order]) > negligible
    return needed
