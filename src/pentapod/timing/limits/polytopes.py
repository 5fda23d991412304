"""Polyhedral approximation of norm limits: linear rows in the frame in which the path moves.

The acceleration of a point on the path is f u + g x, with f along the path: it stays in the plane of f and g. Its
jerk needs a third direction. Rows say |n · vector| ≤ 1 for normals n spread over the half circle, or the half sphere.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from pentapod.base.arrays import Floats, Ints

DIRECTIONS = 8
"""Normals of the half circle: a polygon with 16 sides, 1.9 % nearer than the circle where it is nearest."""

_ANGLES = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
_COS, _SIN = np.cos(_ANGLES), np.sin(_ANGLES)
_INSIDE = float(np.cos(0.5 * np.pi / DIRECTIONS))


def _cube() -> Floats:
    """Return the normals (13, 3) of half a sphere: through the faces, edges and corners of a cube."""
    signs = np.array(np.meshgrid([1, 0, -1], [1, 0, -1], [1, 0, -1], indexing="ij")).reshape(3, -1).T[:13]
    return signs / np.linalg.norm(signs, axis=1, keepdims=True)


_NORMALS = _cube()


def polygon(f: Floats, g: Floats, limit: float) -> tuple[Floats, Floats]:
    """Return rows (n, DIRECTIONS) of u and of x that keep |f u + g x| within the limit: a polygon inside the circle.

    f, g (n, 3).
    """
    size, along, across = _plane(f, g)
    scale = 1.0 / (limit * _INSIDE)
    return (size * _COS) * scale, (along * _COS + across * _SIN) * scale


def common_push(first: Floats, second: Floats, offset: Floats | None = None, size: Floats | float = 1.0) -> Floats:
    """Return the largest x (n,) for which one u keeps all of |first u + second x + offset| ≤ size.

    first, second, offset (n, R); size (R,). Each row is a strip in the (u, x) plane: for one x it leaves an interval of
    u, and intervals have a point in common when each two of them have. Hence the minimum over pairs of rows of
    (size_i |first_j| + size_j |first_i|) / |second_i first_j − second_j first_i| where there is no offset.
    """
    size, (i, j) = np.broadcast_to(size, first.shape[1]), _pairs(first.shape[1])
    one = np.abs(first)
    above = size[i] * one[:, j] + size[j] * one[:, i]
    across = second[:, i] * first[:, j] - second[:, j] * first[:, i]
    if offset is not None and offset.any():
        shift = first[:, j] * offset[:, i] - first[:, i] * offset[:, j]
        above = np.maximum(above - np.sign(across) * shift, 0.0)
    below = np.abs(across)
    # Where rows hardly bend at all a quotient beyond all numbers is no bound, as it should be.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.where(below > 0.0, above / below, np.inf).min(axis=1, initial=np.inf)


@lru_cache
def _pairs(count: int) -> tuple[Ints, Ints]:
    return np.triu_indices(count, 1)


def across_path(f: Floats, g: Floats) -> Floats:
    """Return the length (n,) of g's part across f: what no u takes away. f, g (n, 3)."""
    return _plane(f, g)[2][:, 0]


def polyhedron(f: Floats, g: Floats, h: Floats, limit: float) -> Floats:
    """Return rows (n, 13, 3) of x, x′ and x″ for a jerk h x + 1.5 g x′ + 0.5 f x″ (by √x) of the limit's size.

    A polyhedron with 26 faces around the sphere: its corners lie up to 13 % outside. f, g, h (n, 3): first to third
    derivative of the point by s.
    """
    along, across = _unit(f), g
    for _ in range(2):  # once more for what rounding left along the path
        across = across - _dot(across, along) * along
    # Where the path is straight there is no second direction: any will do that is not the first.
    straight = np.linalg.norm(across, axis=1) <= 1e-9 * np.linalg.norm(g, axis=1)
    across[straight] = np.cross(along[straight], np.eye(3)[np.abs(along[straight]).argmin(axis=1)])
    across = _unit(across)
    frame = np.stack([along, across, np.cross(along, across)], axis=1)
    frame[np.abs(f).max(axis=1) == 0.0] = np.eye(3)
    normals = np.einsum("kd,ndc->nkc", _NORMALS, frame)
    vectors = np.stack([h, 1.5 * g, 0.5 * f], axis=-1) / limit
    return np.ascontiguousarray(normals @ vectors)


def _plane(f: Floats, g: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the length of f, and the parts of g along and across it, (n, 1) each."""
    size, along = np.linalg.norm(f, axis=1, keepdims=True), _unit(f)
    part = _dot(g, along)
    return size, part, np.linalg.norm(g - part * along, axis=1, keepdims=True)


def _unit(v: Floats) -> Floats:
    """Return v (n, 3) at length 1, nothing where it has none."""
    size = np.linalg.norm(v, axis=1, keepdims=True)
    return v / np.where(size > 0.0, size, 1.0)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("ni,ni->n", a, b)[:, None]
