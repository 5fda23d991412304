"""The topmost facet over points of a plane, compiled."""

from __future__ import annotations

import math

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.numerics.kernels import kernel


@kernel
def topmost_facets(
    points: Floats,
    begins: Ints,
    counts: Ints,
    facets: Ints,
    vertices: Floats,
    faces: Ints,
    doubled: Floats,
    margin: float,
    heights: Floats,
    found: Ints,
    weights: Floats,
) -> None:
    """Fill heights (N,), facets (N,) and barycentric weights (N, 3) over points (N, 2); −inf and −1 where none is.

    begins, counts (N,): where the facets near each point begin in `facets`, and how many they are. vertices (V, 3),
    doubled (F,): twice the facets' areas in the plane, with sign. Of facets at one height the first counts.
    """
    for q in range(len(points)):
        x, y = points[q, 0], points[q, 1]
        heights[q], found[q] = -math.inf, -1
        for k in range(begins[q], begins[q] + counts[q]):
            f = facets[k]
            a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
            ax, ay, bx, by = vertices[a, 0], vertices[a, 1], vertices[b, 0], vertices[b, 1]
            cx, cy, area = vertices[c, 0], vertices[c, 1], doubled[f]
            first = ((cx - bx) * (y - by) - (cy - by) * (x - bx)) / area
            second = ((ax - cx) * (y - cy) - (ay - cy) * (x - cx)) / area
            third = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
            if not (first >= -margin and second >= -margin and third >= -margin):
                continue
            height = first * vertices[a, 2] + second * vertices[b, 2] + third * vertices[c, 2]
            if height > heights[q] or (height == heights[q] and f < found[q]):
                heights[q], found[q] = height, f
                weights[q, 0], weights[q, 1], weights[q, 2] = first, second, third


@kernel
def any_above(
    points: Floats,
    bounds: Floats,
    begins: Ints,
    counts: Ints,
    facets: Ints,
    vertices: Floats,
    faces: Ints,
    doubled: Floats,
    margin: float,
    above: Bools,
) -> None:
    """Fill whether any facet over points (N, 2) is higher than bounds (N,). Else as `topmost_facets`."""
    for q in range(len(points)):
        x, y, bound = points[q, 0], points[q, 1], bounds[q]
        above[q] = False
        for k in range(begins[q], begins[q] + counts[q]):
            f = facets[k]
            a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
            if max(vertices[a, 2], vertices[b, 2], vertices[c, 2]) <= bound:
                continue
            ax, ay, bx, by = vertices[a, 0], vertices[a, 1], vertices[b, 0], vertices[b, 1]
            cx, cy, area = vertices[c, 0], vertices[c, 1], doubled[f]
            first = ((cx - bx) * (y - by) - (cy - by) * (x - bx)) / area
            second = ((ax - cx) * (y - cy) - (ay - cy) * (x - cx)) / area
            third = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
            if not (first >= -margin and second >= -margin and third >= -margin):
                continue
            if first * vertices[a, 2] + second * vertices[b, 2] + third * vertices[c, 2] > bound:
                above[q] = True
                break
