"""Proofs for constrained platforms: Krawczyk's operator on all equations of the platform, which are quadratic.

Unknowns are z = (p / s, x, y, i), twelve numbers, s a length; equations G(z, t) = 0 the five leg equations, the six of
an orthonormal frame, and that of the passive joint. The Jacobian J is affine in z. Around a straight line of poses
z̃(t), t in [0, 1], with C ≈ J⁻¹ in its middle m, by components: let β bound |C G(z̃(t), t)|, let d be half the line, and
for a radius r (12,) let Q bound |1 − C J(z)| for all z with |z − m| ≤ d + r. Where β + Q r < r, Krawczyk's operator
maps the box |z − z̃(t)| ≤ r into its inside. So at each t there is exactly one solution in it, J is regular throughout,
the solutions are one continuous motion, and |z − z̃(t)| ≤ β + Q r. Legs in a box about those of a pose: the case d = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.numerics.bernstein import elevate, multiply


@dataclass(frozen=True)
class KrawczykOptions:
    """contraction: largest sum over a row of Q. slack: share that is added to bounds. wider: radius r by β.

    narrowest: least component of r by the largest, where each has its own: the smaller ones depend on the others.
    rounding: error of an equation, and of |1 − C J| by |C| |J|; 2⁻⁴⁴ is more than lemma 4 of docs/proofs.md asks.
    """

    contraction: float = 0.9
    wider: float = 2.0
    narrowest: float = 0.3
    rounding: float = 2.0**-44
    slack: float = 1e-9


OPTIONS = KrawczykOptions()
X, Y, W = slice(3, 6), slice(6, 9), slice(9, 12)
"""Where the platform's axes x, y, i are in z."""


@dataclass(frozen=True, eq=False)
class Tubes:
    """proven (N,). deviation (N, 12): of the solutions from the line, by components of z.

    velocity (N, 12, K): Bernstein coefficients of a polynomial near dz/dt; off (N, 12): by how much dz/dt differs.

    sensitivity (N,): of p by the legs, m/m. Infinite where nothing is proven. radius (N,): r, the same for all
    components, so that the narrower of two neighbours lies in the wider one at the end that they share, where the
    solution is unique.
    """

    proven: Bools
    deviation: Floats
    velocity: Floats
    off: Floats
    sensitivity: Floats
    radius: Floats

    def joined(self) -> Bools:
        """Return where proven tubes (N,) and their neighbours agree on the solution at the end that they share."""
        worst = self.deviation.max(axis=1)
        near = (worst[:-1] <= self.radius[1:]) | (worst[1:] <= self.radius[:-1])
        apart = ~near & self.proven[:-1] & self.proven[1:]
        return self.proven & ~np.append(apart, False) & ~np.append(False, apart)


class Equations:
    """The equations of a robot, with lengths in units of `scale`."""

    def __init__(self, robot: Any) -> None:
        self.scale = scale_of(robot)
        self.base, self.joints = robot.base_joints / self.scale, robot.joints / self.scale
        h, g = robot.law
        self.h, self.g = h, g / self.scale if h else g

    def tubes(self, first: Floats, second: Floats, legs: Floats, leg_error: float) -> Tubes:
        """Return what is proven along lines from first to second (N, 12); legs (N, 5, k + 1): coefficients."""
        middle, half = 0.5 * (first + second), 0.5 * np.abs(second - first)
        c, defect = self._inverse(middle)
        lengths = legs / self.scale
        squared = 0.5 * multiply(lengths, lengths)
        degree = max(squared.shape[-1] - 1, 2)
        quadratic = np.stack(
            [self._products(first, first), self._products(first, second), self._products(second, second)], -1
        )
        residual = elevate(quadratic, degree - 2)
        residual[:, :5] -= elevate(squared, degree + 1 - squared.shape[-1])
        error = np.full((len(first), 12), OPTIONS.rounding)
        off = leg_error / self.scale
        error[:, :5] += off * (np.abs(lengths).max(axis=2) + off)
        with np.errstate(invalid="ignore", over="ignore"):
            beta = np.abs(c @ residual).max(axis=2) + np.einsum("nij,nj->ni", np.abs(c), error)
            radius = np.repeat(OPTIONS.wider * beta.max(axis=1, keepdims=True), 12, axis=1)
            proven, deviation, q = self._contracted(beta, radius, c, defect, half)
            most = 1.0 - q.sum(axis=2).max(axis=1)
            slopes = np.zeros((len(first), 12, max(squared.shape[-1] - 1, 1)))
            if squared.shape[-1] > 1:
                slopes[:, :5] = (squared.shape[-1] - 1) * np.diff(squared, axis=2)
            first_order = c @ slopes
            rounding = np.einsum("nij,nj->ni", np.abs(c), error)
            rate = np.abs(first_order).max(axis=2) + rounding
            by_q = np.einsum("nij,nj->ni", q, rate + q.sum(axis=2) * (rate.max(axis=1) / most)[:, None])
            # J changes along the line by a known amount; what is left of 1 − C J is small.
            way = second - first
            along = c @ _pattern(
                self._vectors(second) - self._vectors(first), way, self.joints, self.h, self.h * way[:, :3]
            )
            velocity = elevate(first_order, 1) - multiply(along @ first_order, np.array([-0.5, 0.5]))
            small = (defect + np.abs(c) @ self._bend(radius)) @ (rate + by_q)[..., None]
            off = small[..., 0] + 0.5 * np.einsum("nij,nj->ni", np.abs(along), by_q) + rounding
            legs_only = np.einsum("nij,nj->ni", np.abs(c[:, :, :5]), np.abs(lengths).max(axis=2))
            sensitivity = (legs_only + q.sum(axis=2) * (legs_only.max(axis=1) / most)[:, None])[:, :3].max(axis=1)
        known = proven[:, None]
        return Tubes(
            proven,
            deviation,
            velocity,
            np.where(known, off, np.inf) * (1.0 + OPTIONS.slack),
            np.where(proven, sensitivity, np.inf),
            radius[:, 0],
        )

    def box(self, poses: Floats, legs: Floats) -> Floats:
        """Return bounds (N, 12) of how far z gets from poses (N, 12) for legs in the hull of (N, M, 5)."""
        c, defect = self._inverse(poses)
        squares = 0.5 * np.square(legs / self.scale)
        residual = self._products(poses, poses)
        wide = np.abs(residual)
        low, high = squares.min(axis=1), squares.max(axis=1)
        wide[:, :5] = np.maximum(np.abs(residual[:, :5] - low), np.abs(residual[:, :5] - high))
        with np.errstate(invalid="ignore", over="ignore"):
            beta = np.einsum("nij,nj->ni", np.abs(c), wide + OPTIONS.rounding)
            radius = OPTIONS.wider * np.maximum(beta, OPTIONS.narrowest * beta.max(axis=1, keepdims=True))
            return self._contracted(beta, radius, c, defect, np.zeros_like(beta))[1]

    def _contracted(
        self, beta: Floats, radius: Floats, c: Floats, defect: Floats, half: Floats
    ) -> tuple[Bools, Floats, Floats]:
        """Return where β + Q r < r (N,), bounds of the deviation (N, 12), and Q (N, 12, 12); beta, radius (N, 12)."""
        q = (defect + np.abs(c) @ self._bend(half + radius)) * (1.0 + OPTIONS.slack)
        found = (beta + np.einsum("nij,nj->ni", q, radius)) * (1.0 + OPTIONS.slack)
        proven = (found < radius).all(axis=1) & (q.sum(axis=2).max(axis=1) <= OPTIONS.contraction)
        return proven, np.where(proven[:, None], found, np.inf), q

    def _inverse(self, z: Floats) -> tuple[Floats, Floats]:
        """Return C and a bound of |1 − C J| (N, 12, 12)."""
        jacobian = self._jacobian(z)
        regular: Bools = np.asarray(np.isfinite(jacobian).all(axis=(1, 2)), dtype=np.bool_)
        regular[regular] = np.abs(np.linalg.det(jacobian[regular])) > 0.0
        c = np.linalg.inv(np.where(regular[:, None, None], jacobian, np.eye(12)))
        defect = np.abs(np.eye(12) - c @ jacobian) + OPTIONS.rounding * (np.abs(c) @ np.abs(jacobian) + 1.0)
        known = regular[:, None, None]
        return np.where(known, c, np.nan), np.where(known, defect, np.inf)

    def _bend(self, reach: Floats) -> Floats:
        """Return bounds (N, 12, 12) of |J(z + ζ) − J(z)| for |ζ| ≤ reach (N, 12)."""
        return _pattern(self._moved(reach), reach, np.abs(self.joints), self.h, self.h * reach[:, :3])

    def _jacobian(self, z: Floats) -> Floats:
        return _pattern(self._vectors(z), z, self.joints, self.h, self.h * z[:, :3] + self.g)

    def _moved(self, reach: Floats) -> Floats:
        """Return bounds (N, 5, 3) of the change of the legs' vectors for |ζ| ≤ reach (N, 12)."""
        axes = np.stack([reach[:, s] for s in (X, Y, W)], axis=1)
        return reach[:, None, :3] + np.abs(self.joints) @ axes

    def _vectors(self, z: Floats) -> Floats:
        x, y, i = z[:, None, X], z[:, None, Y], z[:, None, W]
        bx, by, bz = (self.joints[:, k][:, None] for k in range(3))
        return z[:, None, :3] + bx * x + by * y + bz * i - self.base

    def _products(self, z: Floats, other: Floats) -> Floats:
        """Return the symmetric bilinear forms (N, 12) of which the equations without ½ l² are the squares."""

        def dot(a: Floats, b: Floats) -> Floats:
            return np.einsum("...c,...c->...", a, b)

        legs = 0.5 * dot(self._vectors(z), self._vectors(other))
        units = [0.5 * (dot(z[:, s], other[:, s]) - 1.0) for s in (X, Y, W)]
        crossed = [0.5 * (dot(z[:, a], other[:, b]) + dot(other[:, a], z[:, b])) for a, b in ((X, Y), (X, W), (Y, W))]
        anchor, after = self.h * z[:, :3] + self.g, self.h * other[:, :3] + self.g
        held = 0.5 * (dot(z[:, Y], after) + dot(other[:, Y], anchor))
        return np.column_stack([legs, *units, *crossed, held])


def _pattern(vectors: Floats, z: Floats, joints: Floats, h: float, anchor: Floats) -> Floats:
    """Return the Jacobian (N, 12, 12) of the equations from the legs' vectors (N, 5, 3), z (N, 12) and h p + g."""
    found = np.zeros((len(z), 12, 12))
    found[:, :5, :3] = vectors
    for k, columns in enumerate((X, Y, W)):
        found[:, :5, columns] = joints[:, k][:, None] * vectors
        found[:, 5 + k, columns] = z[:, columns]
    for row, (one, other) in zip((8, 9, 10), ((X, Y), (X, W), (Y, W)), strict=True):
        found[:, row, one], found[:, row, other] = z[:, other], z[:, one]
    found[:, 11, :3], found[:, 11, Y] = h * z[:, Y], anchor
    return found


def scale_of(robot: Any) -> float:
    """Return the unit of length of the proofs, metres: that of legs and base."""
    return float(np.linalg.norm(robot.base_joints, axis=1).max())
