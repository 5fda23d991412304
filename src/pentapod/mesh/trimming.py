"""Mesh trimming: facets cut where a quantity at their corners changes sign, bit-identical on both sides of an edge."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pentapod.base.arrays import Floats, Ints

BISECTIONS = 50
"""Halvings of an interval in [0, 1] until its ends are as near as numbers can be."""

Root = Callable[[Ints, Ints, Ints], Floats]
"""Facets and two of their corners, inside and outside → where between them (0 to 1) the quantity is zero."""


def linear_root(values: Floats) -> Root:
    """Return the root of a quantity that is linear on facets, with values (F, 3) at their corners."""
    return lambda facet, a, b: values[facet, a] / (values[facet, a] - values[facet, b])


def normal_root(quantity: Callable[[Floats], Floats], normals: Floats) -> Root:
    """Return the root, by bisection, of a quantity of the interpolated normal; normals (F, 3, 3) at the corners."""

    def root(facet: Ints, a: Ints, b: Ints) -> Floats:
        start, end = normals[facet, a], normals[facet, b]
        low, high = np.zeros(len(start)), np.ones(len(start))
        start_inside = quantity(start) >= 0.0
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            same = (quantity(start + middle[:, None] * (end - start)) >= 0.0) == start_inside
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        return np.where(start_inside, low, high)

    return root


def trimmed(vertices: Floats, faces: Ints, normals: Floats, values: Floats, root: Root) -> tuple[Floats, Ints, Floats]:
    """Return vertices, faces and corner normals of the part of a surface where values (F, 3) are not negative.

    A facet that is cut leaves a triangle, or a quadrilateral in two triangles. The cut across a side is computed from
    its lower vertex to its higher, so that both its facets get the same point.
    """
    inside = values >= 0.0
    count = inside.sum(axis=1)
    parts = [(faces[count == 3], normals[count == 3])]
    points, total = [vertices], len(vertices)
    # Turn each cut facet so that the corner that is alone on its side comes first.
    for many in (1, 2):
        rows = np.flatnonzero(count == many)
        alone = np.argmax(inside[rows] if many == 1 else ~inside[rows], axis=1)
        order = (alone[:, None] + np.arange(3)) % 3
        corner = faces[rows[:, None], order]
        normal = normals[rows[:, None], order]
        ends: list[tuple[Ints, Floats]] = []
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
        (p, normal_p), (q, normal_q) = ends
        triangles = [((corner[:, 0], p, q), (normal[:, 0], normal_p, normal_q))]
        if many == 2:
            (b, c), (normal_b, normal_c) = corner[:, 1:].T, (normal[:, 1], normal[:, 2])
            triangles = [((p, b, c), (normal_p, normal_b, normal_c)), ((p, c, q), (normal_p, normal_c, normal_q))]
        parts += [(np.stack(facet, axis=1), np.stack(at, axis=1)) for facet, at in triangles]
    facets, corner_normals = (np.concatenate(list(part)) for part in zip(*parts, strict=True))
    return _joined(np.concatenate(points), len(vertices), facets, corner_normals)


def _joined(points: Floats, old: int, faces: Ints, normals: Floats) -> tuple[Floats, Ints, Floats]:
    """Return the surface with equal points merged, except the first `old`, and without facets of no extent."""
    fresh, same = np.unique(points[old:], axis=0, return_inverse=True)
    number = np.concatenate([np.arange(old), old + same.ravel()])
    points, faces = np.concatenate([points[:old], fresh]), number[faces]
    corners = points[faces]
    sound = (corners != np.roll(corners, 1, axis=1)).any(axis=2).all(axis=1)
    points, faces = compacted(points, faces[sound])
    return points, faces, normals[sound]


def compacted(vertices: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Return the vertices that facets use, and the facets on them."""
    used = np.zeros(len(vertices), dtype=np.bool_)
    used[faces] = True
    return vertices[used], (np.cumsum(used) - 1)[faces]
