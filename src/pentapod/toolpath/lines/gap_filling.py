"""Offset lines over a surface at a constant stepover, and lines that fill the gaps that others leave.

With the distance counted in steps (a step being how far apart passes may be there), lines half a step from the source
and then a step apart cover all but the ridges where fronts meet: there the last line may be up to a step away. What is
further than half a step from every line is covered by one more line around it, half a step from those.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.geodesic import border_vertices, distances, seeds_along
from pentapod.mesh.query.slicing import LevelSet
from pentapod.mesh.topology import components

FACETS_PER_STEP = 3.5
FACETS_PER_FRONT = 5.0
"""Lines that are a distance apart themselves turn sharp corners: finer facets keep these sharp."""

_SLACK = 1.04
CRUMBS, CRUMBS_OF_FRONTS = 5e-4, 2e-4
"""Share of the area that gaps may have together without lines of their own; less where corners leave more."""


def edge_for(steps: Floats, facets_per_step: float = FACETS_PER_STEP) -> float:
    """Return how long edges may be, metres, for distances that are good to a few percent of the least step (F,)."""
    return float(steps.min()) / facets_per_step


def gaps_filled(patch: Patch, steps: Floats, seeds: Floats, parts: list[Passes]) -> Passes:
    """Return lines on a patch, and further ones wherever these leave more than half a step.

    steps (F,): how far apart lines may be on each facet, metres; the facets must be small against them. seeds (V,):
    how many steps vertices near the lines are from them.
    """
    gaps = gap_lines(patch, seeds, 1.0 / steps, crumbs=CRUMBS_OF_FRONTS)
    return Passes.joined([part for part in (*parts, gaps) if len(part)])


def gap_lines(
    patch: Patch,
    seeds: Floats,
    slowness: Floats,
    *,
    where: Bools | None = None,
    area: float | None = None,
    crumbs: float = CRUMBS,
) -> Passes:
    """Return lines half a step from where seeds (V,) are, around what is further away than that.

    What no seed reaches gets a line midway between its borders, and others a step from it. Gaps that together are less
    than `crumbs` of the area are left alone. where (V,): the only vertices that may lie in a gap; area: of
    the whole region, square metres, where the patch is but a part of it.
    """
    away = distances(patch, seeds, slowness)
    parts: list[Passes] = []
    if not np.isfinite(away).all():
        ridge = _ridges(patch, away, slowness)
        parts.append(ridge.lines())
        away = distances(patch, np.minimum(away, seeds_along(ridge, slowness)), slowness)
    away = np.where(np.isfinite(away) & (True if where is None else where), away, 0.0)
    levels: Floats = np.arange(0.5, float(away.max(initial=0.0)), 1.0)
    if len(levels):
        lines = LevelSet(patch, away, levels).lines()
        least = crumbs * (float(patch.areas.sum()) if area is None else area)
        parts.append(lines.where(_worth_while(patch, away, lines, least)))
    return Passes.joined([part for part in parts if len(part)])


def _ridges(patch: Patch, away: Floats, slowness: Floats) -> LevelSet:
    """Return the lines midway from the border to what is furthest from it, on bodies that `away` does not reach."""
    inner = distances(patch, np.where(border_vertices(patch) & ~np.isfinite(away), 0.0, np.inf), slowness)
    body = components(len(patch.vertices), *patch.topology.edges.T)[1]
    lost = ~np.isfinite(away) & np.isfinite(inner)
    furthest = np.zeros(int(body.max()) + 1)
    np.maximum.at(furthest, body[lost], inner[lost])
    share = np.where(lost, inner / np.where(furthest[body] > 0.0, furthest[body], 1.0), 0.0)
    return LevelSet(patch, share, np.array([0.5]))


def _worth_while(patch: Patch, away: Floats, lines: Passes, crumbs: float) -> Bools:
    """Return which lines (P,) to keep: all but those around the smallest gaps, as long as these are next to nothing."""
    area = np.zeros(len(patch.vertices))
    np.add.at(area, patch.faces.ravel(), np.repeat(patch.areas / 3.0, 3))
    beyond = np.flatnonzero(away > 0.5 * _SLACK)
    if not len(beyond) or not len(lines):
        return np.zeros(len(lines), dtype=np.bool_)
    nearest = np.asarray(KDTree(lines.points).query(patch.vertices[beyond])[1])
    served = np.bincount(lines.pass_of_point[nearest], weights=area[beyond], minlength=len(lines))
    order = np.argsort(served, kind="stable")
    worth = np.empty(len(lines), dtype=np.bool_)
    worth[order] = np.cumsum(served[order]) > crumbs
    return worth
