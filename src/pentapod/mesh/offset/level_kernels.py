"""Points moved onto a level set of the distance from a mesh, compiled.

The distance from a facet is convex: where its tangent says that it is large enough, it is. So a point that is too near
to the mesh moves by the shortest step after which the tangents of all facets that were in its way allow it. In corners
that are two or three facets at once.
"""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.mesh.query.kernels.ball_kernels import facet_distance
from pentapod.mesh.query.kernels.segment_kernels import STACK, closest
from pentapod.numerics.kernels import kernel

_MOST = 8
"""Facets that are remembered for a point; the one that was farthest is forgotten first."""
_PARALLEL = 1e-6
"""Square of the sine of an angle, or determinant of three cosines, below which directions count as dependent."""


@kernel
def _allowed(step: Floats, normals: Floats, needed: Floats, count: int, slack: float) -> bool:
    """Return whether a step (3,) keeps all tangents: its way along each normal is as long as needed."""
    for k in range(count):
        if step[0] * normals[k, 0] + step[1] * normals[k, 1] + step[2] * normals[k, 2] < needed[k] - slack:
            return False
    return True


@kernel
def _dot(a: Floats, b: Floats) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def _step_of_one(normals: Floats, needed: Floats, count: int, slack: float, step: Floats) -> bool:
    """Fill the step (3,) that one tangent holds; False if none is allowed by the others."""
    for i in range(count):
        if needed[i] > 0.0:
            for j in range(3):
                step[j] = needed[i] * normals[i, j]
            if _allowed(step, normals, needed, count, slack):
                return True
    return False


@kernel
def _step_of_two(normals: Floats, needed: Floats, count: int, slack: float, step: Floats) -> bool:
    """Fill the step (3,) that two tangents hold; False if none is allowed by the others."""
    for i in range(count):
        for k in range(i + 1, count):
            cosine = _dot(normals[i], normals[k])
            square = 1.0 - cosine * cosine
            if square < _PARALLEL:
                continue
            first, second = (needed[i] - cosine * needed[k]) / square, (needed[k] - cosine * needed[i]) / square
            for j in range(3):
                step[j] = first * normals[i, j] + second * normals[k, j]
            if min(first, second) >= 0.0 and _allowed(step, normals, needed, count, slack):
                return True
    return False


@kernel
def _step_of_three(normals: Floats, needed: Floats, count: int, slack: float, step: Floats) -> bool:
    """Fill the step (3,) that three tangents hold; False if none is allowed by the others."""
    for i in range(count):
        for k in range(i + 1, count):
            for m in range(k + 1, count):
                ik, im, km = _dot(normals[i], normals[k]), _dot(normals[i], normals[m]), _dot(normals[k], normals[m])
                whole = 1.0 + 2.0 * ik * im * km - ik * ik - im * im - km * km
                if whole < _PARALLEL:
                    continue
                a, b, c = needed[i], needed[k], needed[m]
                first = (a * (1.0 - km * km) + b * (im * km - ik) + c * (ik * km - im)) / whole
                second = (a * (im * km - ik) + b * (1.0 - im * im) + c * (ik * im - km)) / whole
                third = (a * (ik * km - im) + b * (ik * im - km) + c * (1.0 - ik * ik)) / whole
                for j in range(3):
                    step[j] = first * normals[i, j] + second * normals[k, j] + third * normals[m, j]
                if min(first, second, third) >= 0.0 and _allowed(step, normals, needed, count, slack):
                    return True
    return False


@kernel
def _shortest_step(normals: Floats, needed: Floats, count: int, slack: float, step: Floats) -> bool:
    """Fill the shortest step (3,) whose ways along normals (count, 3) are as long as needed; False if there is none.

    At most three of them hold it, pulling its way: there is one such step that the others allow.
    """
    return (
        _step_of_one(normals, needed, count, slack, step)
        or _step_of_two(normals, needed, count, slack, step)
        or _step_of_three(normals, needed, count, slack, step)
    )


@kernel
def move_onto_level(
    points: Floats, level: float, rounds: int, accuracy: float, corners: Floats, starts: Ints, extents: Floats,
    gaps: Floats,
) -> None:  # fmt: skip
    """Move points (N, 3) to where their distance from the mesh is `level`; fill the distances (N,) that they reach.

    accuracy: metres; what is nearer to the level is not moved. rounds: steps at most; none is longer than the level.
    No point depends on the others.
    """
    nodes, bounds, away = np.empty(STACK, dtype=np.intp), np.empty(STACK), np.zeros(6)
    facets, normals, needed = np.empty(_MOST, dtype=np.intp), np.empty((_MOST, 3)), np.empty(_MOST)
    step, g, slack = np.empty(3), np.empty(3), 0.1 * accuracy
    for m in range(len(points)):
        p, count = points[m], 0
        gap, last = closest(p[0], p[1], p[2], math.inf, -1, corners, starts, extents, nodes, bounds, away)
        for _ in range(rounds):
            if abs(gap - level) <= accuracy or gap <= 0.0:
                break
            for j in range(3):
                step[j] = (level - gap) / gap * away[j]
            if gap < level:
                known, farthest = False, 0
                for k in range(count):
                    known = known or facets[k] == last
                    farthest = k if needed[k] < needed[farthest] else farthest
                if not known:
                    facets[farthest if count == _MOST else count] = last
                    count = min(count + 1, _MOST)
                near = True
                for k in range(count):
                    distance = facet_distance(corners[facets[k]], p[0], p[1], p[2], g)
                    near = near and distance > 0.0
                    for j in range(3):
                        normals[k, j] = g[j] / distance
                    needed[k] = level - distance
                if not (near and _shortest_step(normals, needed, count, slack, step) and _dot(step, step) <= level**2):
                    for j in range(3):
                        step[j] = (level - gap) / gap * away[j]
            for j in range(3):
                p[j] += step[j]
            gap, last = closest(p[0], p[1], p[2], math.inf, last, corners, starts, extents, nodes, bounds, away)
        gaps[m] = gap
