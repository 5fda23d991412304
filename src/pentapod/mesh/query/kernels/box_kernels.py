"""Trees of oriented bounding boxes, compiled: boxes aligned with the mean normals of their facets, and tree search."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.kernels import kernel


@kernel
def _select(values: Floats, order: Ints, low: int, high: int, middle: int) -> None:
    """Put order[low : high] so that the smaller values stand before `middle`, the others from there on: quickselect."""
    high -= 1
    while low < high:
        bar, i, j = values[order[(low + high) // 2]], low, high
        while i <= j:
            while values[order[i]] < bar:
                i += 1
            while values[order[j]] > bar:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i, j = i + 1, j - 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            break


@kernel
def split_by_medians(centres: Floats, starts: Ints, order: Ints) -> None:
    """Order facets with centres (F, 3) for the complete tree with leaves starts (L + 1,), by medians."""
    leaves, along = len(starts) - 1, np.ascontiguousarray(centres.T)
    width = leaves
    while width > 1:
        for first in range(0, leaves, width):
            low, middle, high = starts[first], starts[first + width // 2], starts[first + width]
            longest, axis = -1.0, 0
            for k in range(3):
                least, most = math.inf, -math.inf
                for f in range(low, high):
                    least, most = min(least, along[k, order[f]]), max(most, along[k, order[f]])
                if most - least > longest:
                    longest, axis = most - least, k
            _select(along[axis], order, low, high, middle)
        width //= 2


@kernel
def fit_boxes(corners: Floats, starts: Ints, boxes: Floats) -> None:
    """Fill boxes (2 L − 1, 15) of the complete tree over facets (F, 3, 3) with leaves starts (L + 1,)."""
    leaves = len(starts) - 1
    for node in range(2 * leaves - 1):
        width, first = 1, node + 1
        while first < leaves:
            first, width = 2 * first, 2 * width
        begin, end = starts[first - leaves], starts[first - leaves + width]
        _orient(corners[begin:end], boxes[node])
        _fit(corners[begin:end], boxes[node])


@kernel
def _orient(corners: Floats, box: Floats) -> None:
    """Write the axes of a box (15,), the last along the mean normal of the facets (F, 3, 3)."""
    normal = np.zeros(3)
    for f in range(len(corners)):
        p = corners[f]
        ux, uy, uz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
        vx, vy, vz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
        normal[0] += uy * vz - uz * vy
        normal[1] += uz * vx - ux * vz
        normal[2] += ux * vy - uy * vx
    length = math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    if length < 1e-300:
        normal[0], normal[1], normal[2], length = 0.0, 0.0, 1.0, 1.0
    normal /= length
    # The first axis comes from the coordinate axis that is least parallel to the normal.
    least = np.argmin(np.abs(normal))
    across = -normal[least] * normal
    across[least] += 1.0
    across /= math.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
    box[6:9] = across
    box[9] = normal[1] * across[2] - normal[2] * across[1]
    box[10] = normal[2] * across[0] - normal[0] * across[2]
    box[11] = normal[0] * across[1] - normal[1] * across[0]
    box[12:15] = normal


@kernel
def _fit(corners: Floats, box: Floats) -> None:
    """Write centre and half sizes of a box (15,) with known axes, so that it contains the facets (F, 3, 3)."""
    box[0:3] = 0.0
    for k in range(3):
        low, high = math.inf, -math.inf
        for f in range(len(corners)):
            for j in range(3):
                p = corners[f, j]
                along = p[0] * box[6 + 3 * k] + p[1] * box[7 + 3 * k] + p[2] * box[8 + 3 * k]
                low, high = min(low, along), max(high, along)
        # A little more, to cover rounding errors.
        slack = 1e-12 * (high - low) + 1e-15 * max(abs(low), abs(high))
        box[3 + k] = 0.5 * (high - low) + slack
        for j in range(3):
            box[j] += 0.5 * (low + high) * box[6 + 3 * k + j]


@kernel
def box_radius(box: Floats) -> float:
    """Return the radius of the sphere around a box (15,)."""
    square = 0.0
    for k in range(3):
        square += box[3 + k] * box[3 + k]
    return math.sqrt(square)


@kernel
def open_node(node: int, near: float, far: float, best: float, count: int, nodes: Ints, bounds: Floats) -> int:
    """Push the children of a node that may hold something nearer than `best`; return how many nodes the stack holds.

    near, far: lower bounds of the first and the second child. The nearer child is pushed last, and so searched first.
    """
    first, second = 2 * node + 1, 2 * node + 2
    if far < near:
        first, second, near, far = second, first, far, near
    if far < best:
        nodes[count], bounds[count] = second, far
        count += 1
    if near < best:
        nodes[count], bounds[count] = first, near
        count += 1
    return count


@kernel
def fit_extents(corners: Floats, starts: Ints, extents: Floats) -> None:
    """Fill extents (2 L − 1, 2, 3), lowest and highest coordinates, of the tree with leaves starts (L + 1,)."""
    leaves = len(starts) - 1
    for node in range(2 * leaves - 2, -1, -1):
        for k in range(3):
            low, high = math.inf, -math.inf
            if node >= leaves - 1:
                leaf = node - leaves + 1
                for f in range(starts[leaf], starts[leaf + 1]):
                    for j in range(3):
                        low, high = min(low, corners[f, j, k]), max(high, corners[f, j, k])
            else:
                low = min(extents[2 * node + 1, 0, k], extents[2 * node + 2, 0, k])
                high = max(extents[2 * node + 1, 1, k], extents[2 * node + 2, 1, k])
            extents[node, 0, k], extents[node, 1, k] = low, high
