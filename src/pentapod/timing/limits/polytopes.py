"""Polyhedral approximation of limits on the length of a vector: linear rows in the frame in which the path moves.

The acceleration of a point on the path is f u + g x, with f along the path: it stays in the plane of f and g. Its
jerk needs a third direction. Rows say |n · vector| ≤ 1 for normals n spread over the half circle, or the half sphere.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.limits.limit import AccelerationRows, MachineLimit, Motion
from pentapod.timing.path.path import PathDerivatives

DIRECTIONS = 8
"""Normals of the half circle: a polygon with 16 sides inside the circle; at most 1.9 % of the limit is given away."""

_ANGLES = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
_COS, _SIN = np.cos(_ANGLES), np.sin(_ANGLES)
_INSIDE = float(np.cos(0.5 * np.pi / DIRECTIONS))


def _cube() -> Floats:
    """Return normals (13, 3) that cover half a sphere: towards the faces, edges and corners of a cube."""
    signs = np.array(np.meshgrid([1, 0, -1], [1, 0, -1], [1, 0, -1], indexing="ij")).reshape(3, -1).T[:13]
    return signs / np.linalg.norm(signs, axis=1, keepdims=True)


_NORMALS = _cube()


@dataclass(frozen=True, eq=False)
class VectorAcceleration(MachineLimit):
    """Limit of the length of an acceleration f u + g x, where f and g (n, 3) are the first two `vectors`."""

    group = "acceleration"
    of_tool = True

    @abstractmethod
    def vectors(self, path: PathDerivatives) -> tuple[Floats, ...]:
        """Return f and g, (n, 3) each."""

    def acceleration_rows(self, path: PathDerivatives) -> AccelerationRows:
        """Return the rows of a polygon inside the circle."""
        f, g = self.vectors(path)[:2]
        return AccelerationRows.of(*polygon(f, g, self.limit.item()))

    def ceiling(self, path: PathDerivatives) -> Floats:
        """Return the largest x (n,), by the part of g across f."""
        f, g = self.vectors(path)[:2]
        with np.errstate(divide="ignore"):
            return self.limit / across_path(f, g)

    def share(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the shares (n, 1)."""
        f, g = self.vectors(path)[:2]
        return np.linalg.norm(f * motion.u[:, None] + g * motion.x[:, None], axis=1, keepdims=True) / self.limit


def polygon(f: Floats, g: Floats, limit: float) -> tuple[Floats, Floats]:
    """Return rows (n, DIRECTIONS) of u and of x that keep |f u + g x| within the limit: a polygon inside the circle.

    f, g (n, 3).
    """
    size, along, across = _plane(f, g)
    scale = 1.0 / (limit * _INSIDE)
    return (size * _COS) * scale, (along * _COS + across * _SIN) * scale


def across_path(f: Floats, g: Floats) -> Floats:
    """Return the length (n,) of g's part across f, which no u can cancel. f, g (n, 3)."""
    return _plane(f, g)[2][:, 0]


def polyhedron(f: Floats, g: Floats, h: Floats, limit: float) -> Floats:
    """Return rows (n, 13, 3) of x, x′ and x″ for a jerk h x + 1.5 g x′ + 0.5 f x″ (by √x) of the limit's size.

    A polyhedron with 26 faces around the sphere: its corners lie up to 13 % outside. f, g, h (n, 3): first to third
    derivative of the point by s.
    """
    along, across = _unit(f), g
    for _ in range(2):  # the second time removes what rounding left along the path
        across = across - _dot(across, along) * along
    # Where the path is straight any direction across it serves as the second one.
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
    """Return v (n, 3) scaled to length 1; zero vectors stay zero."""
    size = np.linalg.norm(v, axis=1, keepdims=True)
    return v / np.where(size > 0.0, size, 1.0)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("ni,ni->n", a, b)[:, None]
