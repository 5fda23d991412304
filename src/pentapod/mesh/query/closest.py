"""Closest point on a patch, from a k-d tree of facet centroids and exact distances to facets."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Floats, Ints
from pentapod.mesh.patch import Patch
from pentapod.numerics.threads import nearest_points

FIRST_CANDIDATES = 16
"""Facets tried at first for each point; four times as many wherever they do not suffice."""


def closest(patch: Patch, points: Floats) -> tuple[Ints, Floats, Floats]:
    """Return for points (N, 3) the nearest facets (N,), the nearest points (N, 3) on them, and their weights (N, 3).

    Weights are barycentric. Facets are tried in the order of their centroids' distance until no other can be nearer.
    """
    centres = patch.vertices[patch.faces].mean(axis=1)
    radius = float(np.linalg.norm(patch.vertices[patch.faces] - centres[:, None], axis=2).max())
    tree = KDTree(centres)
    facet = np.zeros(len(points), dtype=np.intp)
    weights = np.zeros((len(points), 3))
    open_rows, tries = np.arange(len(points)), min(FIRST_CANDIDATES, len(centres))
    while len(open_rows):
        to_centre, candidates = (np.reshape(a, (-1, tries)) for a in nearest_points(tree, points[open_rows], k=tries))
        bary = _weights(patch, candidates, points[open_rows])
        found = np.einsum("nkc,nkcd->nkd", bary, patch.vertices[patch.faces[candidates]])
        distance = np.linalg.norm(found - points[open_rows, None], axis=2)
        best = distance.argmin(axis=1)
        rows = np.arange(len(open_rows))
        facet[open_rows], weights[open_rows] = candidates[rows, best], bary[rows, best]
        unsure = (to_centre[:, -1] - radius < distance[rows, best]) & (tries < len(centres))
        open_rows, tries = open_rows[unsure], min(4 * tries, len(centres))
    on = (weights[:, :, None] * patch.vertices[patch.faces[facet]]).sum(axis=1)
    return facet, on, weights


def normals_at(patch: Patch, facets: Ints, weights: Floats) -> Floats:
    """Return the interpolated normals (N, 3), not of unit length, on facets (N,) at weights (N, 3)."""
    return (weights[:, :, None] * patch.normals[facets]).sum(axis=1)


def _weights(patch: Patch, facets: Ints, points: Floats) -> Floats:
    """Return barycentric weights (N, K, 3) of the points of facets (N, K) nearest to points (N, 3): Ericson 5.1.5."""
    a, b, c = (patch.vertices[patch.faces[facets, k]] for k in range(3))
    p = points[:, None]
    ab, ac, ap, bp, cp = b - a, c - a, p - a, p - b, p - c
    d1, d2 = (ab * ap).sum(-1), (ac * ap).sum(-1)
    d3, d4 = (ab * bp).sum(-1), (ac * bp).sum(-1)
    d5, d6 = (ab * cp).sum(-1), (ac * cp).sum(-1)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    total = va + vb + vc
    safe = np.where(total > 0.0, total, 1.0)
    zero, one = np.zeros_like(d1), np.ones_like(d1)

    def share(x: Floats, y: Floats) -> Floats:
        return x / np.where(np.abs(y) > 0.0, y, 1.0)

    on_ab, on_ac, on_bc = share(d1, d1 - d3), share(d2, d2 - d6), share(d4 - d3, (d4 - d3) + (d5 - d6))
    cases = [
        ((d1 <= 0) & (d2 <= 0), (one, zero, zero)),
        ((d3 >= 0) & (d4 <= d3), (zero, one, zero)),
        ((d6 >= 0) & (d5 <= d6), (zero, zero, one)),
        ((vc <= 0) & (d1 >= 0) & (d3 <= 0), (1.0 - on_ab, on_ab, zero)),
        ((vb <= 0) & (d2 >= 0) & (d6 <= 0), (1.0 - on_ac, zero, on_ac)),
        ((va <= 0) & (d4 - d3 >= 0) & (d5 - d6 >= 0), (zero, 1.0 - on_bc, on_bc)),
    ]
    conditions = [condition for condition, _ in cases]
    inside = (va / safe, vb / safe, vc / safe)
    return np.stack([np.select(conditions, [w[k] for _, w in cases], inside[k]) for k in range(3)], axis=-1)
