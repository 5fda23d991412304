"""Rigid transforms: active, column vectors, metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, frozen, set_frozen
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value


@dataclass(frozen=True, eq=False)
class RigidTransform(Value):
    """x ↦ rotation @ x + translation. rotation (3, 3) proper orthogonal; translation (3,) in metres.

    Raises ArrayError where the rotation is not a rotation to 1e-9.

    >>> up = RigidTransform(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 0.5]))
    >>> up.apply(np.array([0.0, 0.1, 0.1])).tolist()
    [0.0, -0.1, 0.4]
    """

    summary = ("translation",)

    rotation: Floats
    translation: Floats

    def __post_init__(self) -> None:
        rotation = frozen(self.rotation, "rotation", (3, 3))
        set_frozen(self, rotation=rotation, translation=frozen(self.translation, "translation", (3,)))
        if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-9 or np.linalg.det(rotation) < 0:
            raise ArrayError("rotation is not a proper rotation matrix", expected="R Rᵀ = 1 and det R = +1")

    @classmethod
    def identity(cls) -> RigidTransform:
        """Return the identity."""
        return cls(np.eye(3), np.zeros(3))

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> RigidTransform:
        """Return the transform of a homogeneous 4×4 matrix. Raises ArrayError where it is not rigid."""
        m = as_floats(matrix, "matrix", (4, 4))
        if np.abs(m[3] - (0.0, 0.0, 0.0, 1.0)).max() > 1e-9:
            raise ArrayError("the last row of a rigid 4×4 matrix must be 0 0 0 1", value=m[3].tolist())
        return cls(m[:3, :3], m[:3, 3])

    @property
    def matrix(self) -> Floats:
        """The homogeneous 4×4 matrix, translation in metres."""
        m = np.eye(4)
        m[:3, :3], m[:3, 3] = self.rotation, self.translation
        return m

    def apply(self, points: ArrayLike) -> Floats:
        """Return the images of points (..., 3), metres."""
        return np.asarray(points, dtype=np.float64) @ self.rotation.T + self.translation

    def rotate(self, vectors: ArrayLike) -> Floats:
        """Return vectors or directions (..., 3) rotated, not translated."""
        return np.asarray(vectors, dtype=np.float64) @ self.rotation.T

    def inverse(self) -> RigidTransform:
        """Return the inverse transform."""
        return RigidTransform(self.rotation.T, -self.rotation.T @ self.translation)

    def __matmul__(self, other: RigidTransform) -> RigidTransform:
        """Return the composition: `other` first, then this one."""
        return RigidTransform(self.rotation @ other.rotation, self.apply(other.translation))
