"""Architectural singularity as geometry: conics through base attachments and a point at infinity (paper, III.B).

A design is architecturally singular where F = 0 (paper's (13)), which is where the point at infinity (0, 1, 0)_H of the
y direction lies on the conic through the five base attachments (19). Conics through that point have no y² term.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, frozen, set_frozen
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value


@dataclass(frozen=True, eq=False)
class Conic(Value):
    """The curve A x² + B xy + C y² + D x + E y + G = 0 in the base plane.

    coefficients (6,): A, B, C, D, E, G for x, y in metres, relative to `origin` (2,), metres in the machine frame.
    """

    origin: Floats
    coefficients: Floats

    def __post_init__(self) -> None:
        set_frozen(
            self,
            origin=frozen(self.origin, "origin", (2,)),
            coefficients=frozen(self.coefficients, "coefficients", (6,)),
        )

    def __call__(self, points: ArrayLike) -> Floats:
        """Return the polynomial (...) at points (..., 2) in metres: 0 on the conic."""
        x, y = np.moveaxis(as_floats(points, "points", (2,)) - self.origin, -1, 0)
        a, b, c, d, e, g = self.coefficients
        return a * x * x + b * x * y + c * y * y + d * x + e * y + g

    def y_at(self, x: ArrayLike) -> Floats:
        """Return the y (...) of a conic without y² term at x (...), metres; infinite or NaN at its vertical asymptote.

        Raises ArrayError where the y² term does not vanish: such a conic has none or two.
        """
        a, b, c, d, e, g = self.coefficients
        if c != 0.0:
            raise ArrayError("the conic does not pass through the point at infinity of y", value=float(c))
        shifted = np.asarray(x, dtype=np.float64) - self.origin[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.origin[1] - np.divide(a * shifted**2 + d * shifted + g, b * shifted + e)


def conic_determinant(base: ArrayLike) -> Floats:
    """Return F (...) of base attachments (..., 5, 2), paper's (13): metres to the 6th power, 0 where singular.

    Coordinates are taken relative to leg 3's; F is the same for any other origin. `architectural_measure` and
    `architectural_distance` say how near 0 it is: F itself grows with the sixth power of the machine's size.
    """
    xy = as_floats(base, "base", (5, 2))
    x, y = np.moveaxis(xy[..., (0, 1, 3, 4), :] - xy[..., 2:3, :], -1, 0)
    return np.linalg.det(np.stack([x * x, x * y, x, y], axis=-1))


def attachment_conic(base: ArrayLike) -> Conic:
    """Return the conic (19) through five base attachments (5, 2), with leg 3's as its origin.

    The coefficients are the minors of (19), so that of y² is F up to its sign.
    """
    xy = _one_base(base)
    x, y = (xy - xy[2])[[0, 1, 3, 4]].T
    columns = np.stack([x * x, x * y, y * y, x, y], axis=1)  # leg 3's row leaves no constant term
    minors = [(-1.0) ** k * np.linalg.det(np.delete(columns, k, axis=1)) for k in range(5)]
    return Conic(xy[2], np.array([*minors, 0.0]))


def forbidden_conic(base: ArrayLike, leg: int) -> Conic:
    """Return where attachment `leg` (0 … 4) must not be: on the conic through the other four and (0, 1, 0)_H (Fig. 3).

    base (5, 2) metres. Its value at the attachment's own position is F: F is a conic's polynomial in each attachment.
    All zero where the other four are collinear with each other: then the design is singular wherever this one is.
    """
    xy = _one_base(base)
    if leg not in range(5):
        raise ArrayError("there is no such leg", value=leg, expected="0 … 4, legs 1 to 5")
    others = np.delete(np.arange(5), leg)
    origin = xy[others].mean(axis=0)
    x, y = (xy[others] - origin).T
    columns = np.stack([x * x, x * y, x, y, np.ones(4)], axis=1)
    minors = [(-1.0) ** (leg + k) * np.linalg.det(np.delete(columns, k, axis=1)) for k in range(5)]
    a, b, d, e, g = minors
    return Conic(origin, np.array([a, b, 0.0, d, e, g]))


def _one_base(base: ArrayLike) -> Floats:
    xy = as_floats(base, "base", (5, 2))
    if xy.shape != (5, 2):
        raise ArrayError(f"base has shape {xy.shape}", expected="shape (5, 2)")
    return xy
