"""Choice of touches: those that most reduce the uncertainty of the cut surface, one after the other.

The mean variance of the cut surface along its normals is the trace of C S, with the covariance C of the part's motions
and the mean S of the outer products of the cut surface's rows. A touch with row j reduces it by jᵀ C S C j / (1 +
jᵀ C j).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.normals import unit_or_zero
from pentapod.registration.contacts import motion_rows


@dataclass(frozen=True)
class SelectionOptions:
    """How touches are chosen.

    points: of the surface from which they are; tried: random ones of which those are the most distant. prior: of the
    part's place before any touch, in standard deviations of a touch. anyway: weight of motions in any direction, beside
    those of the cut surface along its normals. seed: of the random points.
    """

    points: int = 400
    tried: int = 4_000
    prior: float = 1e3
    anyway: float = 1e-3
    seed: int = 0


OPTIONS = SelectionOptions()


def surface_points(mesh: Mesh, facets: Bools) -> tuple[Floats, Floats]:
    """Return points (P, 3), evenly spread over some facets (F,) of a mesh, and the facets' normals (P, 3)."""
    rng = np.random.default_rng(OPTIONS.seed)
    areas = mesh.facet_areas * facets
    if not areas.sum() > 0.0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    facet = rng.choice(len(areas), OPTIONS.tried, p=areas / areas.sum())
    weights = rng.dirichlet(np.ones(3), OPTIONS.tried)
    points = np.einsum("nk,nkc->nc", weights, mesh.vertices[mesh.faces[facet]])
    outward = -1.0 if mesh.diagnosis.inverted else 1.0
    chosen, nearest = [0], np.full(len(points), np.inf)
    while len(chosen) < OPTIONS.points:
        nearest = np.minimum(nearest, np.square(points - points[chosen[-1]]).sum(axis=1))
        chosen.append(int(nearest.argmax()))
    return points[chosen], outward * unit_or_zero(mesh.facet_normals[facet[chosen]])


def chosen(rows: Floats, cut_rows: Floats, before: Floats, count: int) -> Ints:
    """Return the indices of `count` of the touches with `rows` (C, 6), in the order of their use.

    cut_rows (P, 6): of the cut surface; before (N, 6): of the touches that there are already.
    """
    goal = cut_rows.T @ cut_rows / max(len(cut_rows), 1) + OPTIONS.anyway * np.eye(6)
    covariance = np.linalg.inv(before.T @ before + np.eye(6) / OPTIONS.prior**2)
    free, found = np.ones(len(rows), dtype=np.bool_), list[int]()
    for _ in range(min(count, len(rows))):
        moved = rows @ covariance
        spread = 1.0 + np.einsum("ci,ci->c", moved, rows)
        gain = np.where(free, np.einsum("ci,ij,cj->c", moved, goal, moved) / spread, -np.inf)
        best = int(gain.argmax())
        covariance = covariance - np.outer(moved[best], moved[best]) / spread[best]
        free[best] = False
        found.append(best)
    return np.array(found, dtype=np.intp)


def rows_of(points: Floats, normals: Floats, mesh: Mesh) -> Floats:
    """Return the `motion_rows` of a part about its middle, at half its largest extent."""
    middle, size = mesh.bounds.mean(axis=0), 0.5 * float(np.ptp(mesh.bounds, axis=0).max())
    return motion_rows(points, normals, middle, size)
