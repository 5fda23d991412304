"""Trimming: facets cut where a quantity on their corners changes sign, with equal bits on both sides of an edge."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pentapod.base.arrays import Floats, Ints

_BISECTIONS = 50
Root = Callable[[Ints, Ints, Ints], Floats]
"""Facets and two of their corners, inside and out → where between them (0 to 1) the quantity is zero."""


def halves(vertices: Floats, faces: Ints, normals: Floats, values: Floats, root: Root) -> tuple[Floats, Ints, Floats]:
    """Return vertices, faces and corner normals of the part of a surface where values (F, 3) are not negative.

    A facet that is cut keeps a triangle or a quadrilateral, in two triangles. The cut across a side is found
    from its lower vertex to its higher, so that both its facets get the same point.
    """
    inside = values >= 0.0
    count = inside.sum(axis=1)
    parts = [(faces[count == 3], normals[count == 3])]
    points, total = [vertices], len(vertices)
    # Turn each cut facet so that its odd corner, alone on its side, comes first.
    for many in (1, 2):
        rows = np.flatnonzero(count == many)
        odd = np.argmax(inside[rows] if many == 1 else ~inside[rows], axis=1)
        order = (odd[:, None] + np.arange(3)) % 3
        corner = faces[rows[:, None], order]
        normal = normals[rows[:, None], order]
        ends = []
        for other in (1, 2):
            first, second = order[:, 0], order[:, other]
            swap = corner[:, 0] > corner[:, other]
            a, b = np.where(swap, second, first), np.where(swap, first, second)
            t = np.clip(root(rows, a, b), 0.0, 1.0)[:, None]
            start, end = vertices[faces[rows, a]], vertices[faces[rows, b]]
            points.append(start + t * (end - start))
            # A cut through a vertex takes the vertex itself.
            place = np.where(t[:, 0] >= 1.0, faces[rows, b], total + np.arange(len(rows)))
            place = np.where(t[:, 0] <= 0.0, faces[rows, a], place)
            ends.append((place, (1.0 - t) * normals[rows, a] + t * normals[rows, b]))
            total += len(rows)
        (p, np_), (q, nq) = ends
        if many == 1:
            parts.append((np.stack([corner[:, 0], p, q], axis=1), np.stack([normal[:, 0], np_, nq], axis=1)))
        else:
            b, c = corner[:, 1], corner[:, 2]
            nb, nc = normal[:, 1], normal[:, 2]
            parts.append((np.stack([p, b, c], axis=1), np.stack([np_, nb, nc], axis=1)))
            parts.append((np.stack([p, c, q], axis=1), np.stack([np_, nc, nq], axis=1)))
    facets, corner_normals = (np.concatenate(list(part)) for part in zip(*parts, strict=True))
    return _joined(np.concatenate(points), len(vertices), facets, corner_normals)


def bisected(quantity: Callable[[Floats], Floats], start: Floats, end: Floats) -> Floats:
    """Return where (R,) between vectors start and end (R, 3) a quantity (R,) of the interpolated one changes sign."""
    low, high = np.zeros(len(start)), np.ones(len(start))
    starts_in = quantity(start) >= 0.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        same = (quantity(start + middle[:, None] * (end - start)) >= 0.0) == starts_in
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.where(starts_in, low, high)


def _joined(points: Floats, old: int, faces: Ints, normals: Floats) -> tuple[Floats, Ints, Floats]:
    """Return the surface with equal points joined, but for the `old` first ones; facets without extent left out."""
    fresh, same = np.unique(points[old:], axis=0, return_inverse=True)
    number = np.concatenate([np.arange(old), old + same.ravel()])
    points, faces = np.concatenate([points[:old], fresh]), number[faces]
    corners = points[faces]
    sound = (corners != np.roll(corners, 1, axis=1)).any(axis=2).all(axis=1)
    faces, normals = faces[sound], normals[sound]
    used = np.zeros(len(points), dtype=np.bool_)
    used[faces] = True
    return points[used], (np.cumsum(used) - 1)[faces], normals
