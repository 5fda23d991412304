"""Gap filling: additional lines wherever the passes on a surface leave more than half a stepover.

Distances are geodesic and counted in stepovers. Lines half a step from the source and then a step apart cover the
surface except for the ridges where fronts meet: there the last line may be up to a step away. Whatever is further than
half a step from every line gets one more line around it, half a step from the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.mesh.geodesic.distance import GeodesicField, Sources
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.slicing import LevelSet
from pentapod.mesh.topology import components
from pentapod.numerics.threads import nearest_points


@dataclass(frozen=True)
class GapOptions:
    """How gaps are found.

    facets_per_step: facet edges in a stepover, for distances that are good to a few percent. negligible: share of the
    area that gaps without lines of their own may have in total. slack: a gap counts from this many half steps on;
    scallops are 1.25 times as high there. spacing: of points that stand for lines which thin facets cut into short
    pieces, in stepovers. smoothing: rounds in which the slowness is averaged with that of neighbouring vertices.
    reversal: turn, radians, from which a line goes back.
    """

    facets_per_step: float = 3.5
    negligible: float = 5e-4
    slack: float = 1.118
    spacing: float = 0.05
    smoothing: int = 24
    reversal: float = float(np.radians(120.0))

    def longest_edge(self, steps: Floats) -> float:
        """Return how long facet edges may be, metres, for stepovers (F,)."""
        return float(steps.min()) / self.facets_per_step


FRONTS = GapOptions(facets_per_step=5.0, negligible=2e-4, slack=1.01)
"""For lines that are themselves at a geodesic distance: they turn sharp corners, which finer facets keep sharp."""


def slowness_of(patch: Patch, steps: Floats, options: GapOptions = FRONTS) -> Floats | float:
    """Return steps per metre at vertices (V,), from the stepover (F,) on facets; a number if it is the same on all.

    Curvatures of facets are noisy, and lines would waver with them: they are averaged over about half a stepover.
    """
    if steps.min() == steps.max():
        return 1.0 / float(steps[0])
    total, area = np.zeros((2, len(patch.vertices)))
    np.add.at(total, patch.faces.ravel(), np.repeat(patch.areas / steps, 3))
    np.add.at(area, patch.faces.ravel(), np.repeat(patch.areas, 3))
    slowness = np.where(area > 0.0, total / np.where(area > 0.0, area, 1.0), 1.0 / float(steps.max()))
    a, b = patch.topology.edges.T
    beside = np.bincount(np.concatenate([a, b]), minlength=len(slowness))
    for _ in range(options.smoothing):
        around = np.bincount(a, slowness[b], len(slowness)) + np.bincount(b, slowness[a], len(slowness))
        slowness = np.where(beside > 0, 0.5 * (slowness + around / np.maximum(beside, 1)), slowness)
    return slowness


def lines_as_sources(
    level_set: LevelSet, steps: Floats, options: GapOptions = FRONTS, *, shortest: float = 0.0
) -> Sources:
    """Return level lines as sources of distances, for stepovers (F,).

    shortest: metres; shorter lines are no passes and leave gaps.
    """
    return Sources.along(level_set, options.spacing * float(steps.min()), shortest)


def gap_lines(
    patch: Patch,
    sources: Sources,
    steps: Floats,
    options: GapOptions = FRONTS,
    *,
    where: Bools | None = None,
    area: float | None = None,
) -> Passes:
    """Return lines around everything that is more than half a step from the passes.

    sources: the passes on the patch. steps (F,): stepover on each facet, metres; the facets must be small compared with
    it. where (V,): the only vertices that may lie in a gap. area: of the whole region, square metres, if the patch is a
    part of it. What is not connected to a source gets a line midway between its borders, and others a step from it.
    """
    slowness, parts = slowness_of(patch, steps), list[Passes]()
    fields = [GeodesicField.of(patch, sources, slowness)]
    values = fields[0].values
    if not np.isfinite(values).all():
        middle = _middle_lines(patch, values, slowness)
        parts.append(middle.lines())
        # These lines are on other bodies than the sources: nothing changes where distances are known.
        fields.append(GeodesicField.of(patch, lines_as_sources(middle, steps), slowness))
        values = np.minimum(values, fields[1].values)
    distance = np.where(np.isfinite(values) & (True if where is None else where), values, 0.0)
    # Midway between parallel passes the distance is half a step exactly: that is no gap.
    first = 0.25 * (1.0 + options.slack)

    def nearest(facets: Ints, weights: Floats) -> Floats:
        return np.min([field.at(facets, weights) for field in fields], axis=0)

    levels: Floats = np.arange(first, float(distance.max(initial=0.0)), 1.0)
    if len(levels):
        lines = LevelSet(patch, distance, levels, inside=nearest if where is None else None).lines()
        negligible = options.negligible * (float(patch.areas.sum()) if area is None else area)
        needed = lines.where(_needed(patch, distance > 0.5 * options.slack, lines, negligible))
        parts.append(_one_side(needed, 0.5 * float(steps.min()), options.reversal))
    return Passes.joined(parts)


def _one_side(lines: Passes, reach: float, reversal: float) -> Passes:
    """Return lines with one side only where they turn back beside themselves, within `reach` metres: it covers both.

    reversal: turn, radians, at which a line goes back.
    """
    found: list[tuple[Floats, Floats]] = []
    for k, closed in enumerate(lines.closed):
        points, normals = lines.points[lines.rows(k)], lines.normals[lines.rows(k)]
        if closed:
            # The tips of a loop are the points that are farthest from each other.
            first = int(np.linalg.norm(points - points[0], axis=1).argmax())
            points, normals = (np.concatenate([a[first:-1], a[: first + 1]]) for a in (points, normals))
        farthest = int(np.linalg.norm(points - points[0], axis=1).argmax())
        if (side := _covering(points, farthest, reach)) is not None:
            points, normals = points[side], normals[side]
        while (tip := _reversal(points, reversal)) is not None and (side := _covering(points, tip, reach)) is not None:
            points, normals = points[side], normals[side]
        found.append((points, normals))
    return Passes.of(found, lines.levels)


def _covering(points: Floats, tip: int, reach: float) -> slice | None:
    """Return the side of a line, from a tip on, all of whose other side is within `reach` metres; the shorter if both.

    None where neither is so.
    """
    if not 0 < tip < len(points) - 1:
        return None
    sides = [slice(0, tip + 1), slice(tip, len(points))]
    sides.sort(key=lambda side: float(np.linalg.norm(np.diff(points[side], axis=0), axis=1).sum()))
    for kept, left in (sides, sides[::-1]):
        if nearest_points(KDTree(points[kept]), points[left])[0].max() <= reach:
            return kept
    return None


def _reversal(points: Floats, angle: float) -> int | None:
    """Return the point of a line at which it turns most, None where that is by less than an angle, radians."""
    along = np.diff(points, axis=0)
    length = np.linalg.norm(along, axis=1)
    scale = length[1:] * length[:-1]
    cosine = (along[1:] * along[:-1]).sum(axis=1) / np.where(scale > 0.0, scale, 1.0)
    sharpest = int(cosine.argmin()) if len(cosine) else 0
    return sharpest + 1 if len(cosine) and cosine[sharpest] < np.cos(angle) else None


def _middle_lines(patch: Patch, distance: Floats, slowness: Floats | float) -> LevelSet:
    """Return the lines midway between the border and the innermost point of each body that `distance` (V,) misses."""
    topology = patch.topology
    missed = ~np.isfinite(distance)
    border = (topology.facets_at_edge == 1) & missed[topology.edges].all(axis=1)
    inner = GeodesicField.of(patch, Sources.sides(patch, border), slowness).values
    body = components(len(patch.vertices), *topology.edges.T)[1]
    missed &= np.isfinite(inner)
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
    nearest = np.asarray(nearest_points(KDTree(lines.points), patch.vertices[in_gap])[1])
    served = np.bincount(lines.pass_of_point[nearest], weights=area[in_gap], minlength=len(lines))
    order = np.argsort(served, kind="stable")
    needed = np.empty(len(lines), dtype=np.bool_)
    needed[order] = np.cumsum(served[order]) > negligible
    return needed
