"""Geodesic tracing: straightest geodesics over a triangle mesh (Polthier and Schmies 1998), many rays at once.

A ray crosses each edge as if both facets were unfolded into one plane: the component of its direction along the edge is
kept, the one across it is rotated from the first facet's plane into the second's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.mesh.patch import Patch

SLOWEST_DECREASE = 1e-12
"""Per metre: a barycentric weight that decreases more slowly counts as constant."""


@dataclass(frozen=True, eq=False)
class SurfaceRays:
    """N places on a patch, each with a direction in its facet. weights (N, 3): barycentric in facets (N,).

    directions (N, 3): unit. landed (N,): false where the ray left the patch.
    """

    facets: Ints
    weights: Floats
    directions: Floats
    landed: Bools

    def points(self, patch: Patch) -> Floats:
        """Return the places (N, 3), metres."""
        return (self.weights[:, :, None] * patch.vertices[patch.faces[self.facets]]).sum(axis=1)


def neighbours(patch: Patch) -> Ints:
    """Return the facet (F, 3) on the other side of each facet's side, or −1 at borders."""
    other = np.full(3 * len(patch.faces), -1, dtype=np.intp)
    a, b = patch.topology.side_pairs
    agree = patch.topology.pair_agrees
    a, b = a[agree], b[agree]
    other[a], other[b] = b // 3, a // 3
    return other.reshape(-1, 3)


def traced(patch: Patch, adjacent: Ints, start: SurfaceRays, lengths: Floats) -> SurfaceRays:
    """Return the ends of rays of `lengths` (N,) metres over a patch. adjacent: its `neighbours`."""
    facets, weights = start.facets.copy(), start.weights.copy()
    directions, landed = start.directions.copy(), start.landed.copy()
    left = np.where(landed, lengths, 0.0).astype(np.float64)
    from_side = np.full(len(facets), -1, dtype=np.intp)
    going = np.flatnonzero(left > 0.0)
    for _ in range(20 * len(patch.faces)):
        if not len(going):
            break
        f = facets[going]
        corners = patch.vertices[patch.faces[f]]
        rate = _rates(corners, directions[going])
        w = weights[going]
        # Side s lies opposite corner s + 2, whose weight is zero there.
        opposite, change = np.roll(w, 1, axis=1), np.roll(rate, 1, axis=1)
        falls = change < -SLOWEST_DECREASE
        time = np.where(falls, -opposite / np.where(falls, change, -1.0), np.inf)
        entered = np.flatnonzero(from_side[going] >= 0)
        time[entered, from_side[going[entered]]] = np.inf
        side = time.argmin(axis=1)
        until = np.maximum(time[np.arange(len(going)), side], 0.0)
        ends = left[going] <= until
        advance = np.minimum(left[going], until)
        w = np.maximum(w + advance[:, None] * rate, 0.0)
        weights[going] = w / w.sum(axis=1, keepdims=True)
        left[going] -= advance
        going, side, f = going[~ends], side[~ends], f[~ends]
        after = adjacent[f, side]
        left_patch = after < 0
        landed[going[left_patch]] = False
        going, side, f, after = going[~left_patch], side[~left_patch], f[~left_patch], after[~left_patch]
        _cross(patch, (facets, weights, directions, from_side), going, f, side, after)
    return SurfaceRays(facets, weights, directions, landed)


def _rates(corners: Floats, directions: Floats) -> Floats:
    """Return the change per metre of barycentric weights (N, 3) along directions (N, 3) in the facets' planes."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    square = np.maximum((normal * normal).sum(axis=1, keepdims=True), 1e-300)
    # Each weight grows away from the opposite side.
    slopes = [np.cross(normal, side) / square for side in (c - b, a - c, b - a)]
    return np.stack([(slope * directions).sum(axis=1) for slope in slopes], axis=1)


def _cross(
    patch: Patch, state: tuple[Ints, Floats, Floats, Ints], going: Ints, f: Ints, side: Ints, after: Ints
) -> None:
    """Move rays `going` from facets f over their sides into the facets `after`, in place."""
    facets, weights, directions, from_side = state
    rows = np.arange(len(going))
    first = patch.faces[f, side]
    second = patch.faces[f, (side + 1) % 3]
    along = patch.vertices[second] - patch.vertices[first]
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    # Across the edge: out of the one facet and into the other.
    out = np.cross(along, patch.facet_normals[f])
    inwards = np.cross(along, patch.facet_normals[after])
    d = directions[going]
    d = (d * along).sum(axis=1, keepdims=True) * along + (d * out).sum(axis=1, keepdims=True) * inwards
    directions[going] = d / np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-300)
    share_first, share_second = weights[going, side], weights[going, (side + 1) % 3]
    # The neighbour runs along the edge the other way: its side from `second` to `first`.
    corners = patch.faces[after]
    entered = np.argmax((corners == second[:, None]) & (np.roll(corners, -1, axis=1) == first[:, None]), axis=1)
    new = np.zeros((len(going), 3))
    new[rows, entered], new[rows, (entered + 1) % 3] = share_second, share_first
    facets[going], weights[going], from_side[going] = after, new / new.sum(axis=1, keepdims=True), entered
