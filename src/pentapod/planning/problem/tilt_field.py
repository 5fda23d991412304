"""Tilt field: the lean of the tool axis from its nominal direction, as a bicubic spline over the part.

The lean is a vector b(x) in the plane across the mean axis, a bicubic spline of the place x; the tool axis is the
nominal one plus the part of b perpendicular to it. Neighbouring passes therefore lean alike, and the axis along the
path is as smooth as the nominal axis. The number of unknowns does not depend on the number of waypoints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from pentapod.base.arrays import Floats
from pentapod.geometry.directions import tangent_frame

DEGREE = 3


@dataclass(frozen=True, eq=False)
class FieldDomain:
    """The rectangle on which a tilt field is defined, along the two directions of largest spread of the tilt centres.

    origin (3,), directions (2, 3) unit rows, lengths (2,) in metres, workpiece frame; cells: spline cells a side.
    lean_plane (2, 3): unit rows, the plane in which the lean lies.
    """

    origin: Floats
    directions: Floats
    lengths: Floats
    cells: int
    lean_plane: Floats

    @classmethod
    def around(cls, tilt_centres: Floats, nominal: Floats, cells: int) -> FieldDomain:
        """Return the domain of tilt centres and nominal axes (N, 3)."""
        centred = tilt_centres - tilt_centres.mean(axis=0)
        # Directions of largest spread; the sign is fixed so that the same part gives the same field.
        _, _, rows = np.linalg.svd(centred.T @ centred)
        directions = rows[:2] * np.where(rows[:2][range(2), np.abs(rows[:2]).argmax(axis=1)] < 0.0, -1.0, 1.0)[:, None]
        along = tilt_centres @ directions.T
        low, high = along.min(axis=0), along.max(axis=0)
        origin = tilt_centres.mean(axis=0)
        origin = origin + (low - origin @ directions.T) @ directions
        mean = nominal.mean(axis=0)
        length = float(np.linalg.norm(mean))
        plane = np.stack(tangent_frame(mean / length if length > 1e-6 else np.array([0.0, 0.0, 1.0])))
        return cls(origin, directions, np.maximum(high - low, 1e-6), cells, plane)

    @property
    def size(self) -> int:
        """Number of spline coefficients."""
        return (self.cells + DEGREE) ** 2

    def basis(self, tilt_centres: Floats) -> Floats:
        """Return the spline basis (N, size) at tilt_centres (N, 3)."""
        along = np.clip((tilt_centres - self.origin) @ self.directions.T / self.lengths, 0.0, 1.0)
        knots = np.concatenate([np.zeros(DEGREE), np.linspace(0.0, 1.0, self.cells + 1), np.ones(DEGREE)])
        first, second = (BSpline.design_matrix(x, knots, DEGREE).toarray() for x in along.T)
        return (first[:, :, None] * second[:, None, :]).reshape(len(along), self.size)

    def roughness(self) -> Floats:
        """Return the matrix (R, size) that takes coefficients to their second differences in both directions."""
        n = self.cells + DEGREE
        second = np.diff(np.eye(n), 2, axis=0)
        along_both = [np.kron(second, np.eye(n)), np.kron(np.eye(n), second)]
        return np.concatenate(along_both, dtype=np.float64)


def tilts(angle: float, rings: int = 2) -> Floats:
    """Return lean vectors (K, 2) in a tangent frame that fill a cone of half angle `angle`: its centre and rings."""
    found = [np.zeros((1, 2))]
    for ring in range(1, rings + 1 if angle > 0.0 else 1):
        turn = 2.0 * np.pi * np.arange(6 * ring) / (6 * ring)
        share = (0.05 * (rings - ring) + 0.95 * ring) / rings
        found.append(share * np.tan(angle) * np.stack([np.cos(turn), np.sin(turn)], axis=1))
    return np.concatenate(found)


def lean(nominal: Floats, b: Floats) -> Floats:
    """Return unit nominal axes (..., 3) tilted by b (..., 3): normalised n + b − (b·n) n."""
    across: Floats = b - (b * nominal).sum(axis=-1, keepdims=True) * nominal
    length = np.sqrt(1.0 + np.square(across).sum(axis=-1, keepdims=True))
    return (nominal + across) / length
