"""The singularity-free sphere of any linear pentapod: the nearest singular pose found, and a radius that is proven.

Metric as in `sphere`: d² = (1/5) Σ |Δb_k|² = |Δc|² + σ² |Δi|², c the centroid of the platform joints and σ the standard
deviation of their offsets. Singular is where the polynomial (2) is zero; seen from leg 3's joints, with the null vector
(n, −m, −q) of the leg equations, a = pz (u, v) − w (px, py) and s = w m − pz q, it is P = n w pz + s·a.

*Found*: stationary points of d² on P = 0, |i| = 1, by Newton's method on Lagrange's equations from many directions.
*Proven*: within a ball no term of P can change by more than the product rule allows; where that is less than |P| in
its middle the ball holds no singular pose. The true radius lies between both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.kinematics.batches import joined_poses
from pentapod.kinematics.families.general import GeneralPentapod


@dataclass(frozen=True)
class SphereSearch(Value):
    """Options of the search.

    directions: starts on the sphere of directions, beside the pose's own; steps: of Newton's method; settled: |P| by
    its slope, as a share of σ, that is left on a singular pose; halvings: of the proven radius.
    """

    directions: int = 96
    steps: int = 40
    settled: float = 1e-10
    halvings: int = 60


@dataclass(frozen=True, eq=False)
class BoundedSphere(Value):
    """Spheres about poses (...): found (...) metres reaches the singular pose (position, direction) (..., 3).

    proven (...): metres; no singular pose is nearer, to rounding. Infinite and NaN where none was found.
    """

    found: Floats
    proven: Floats
    position: Floats
    direction: Floats

    def __post_init__(self) -> None:
        for array in (self.found, self.proven, self.position, self.direction):
            array.flags.writeable = False


def bounded_singularity_free_sphere(
    pentapod: GeneralPentapod, position: ArrayLike, direction: ArrayLike, search: SphereSearch = SphereSearch()
) -> BoundedSphere:
    """Return bounds of the largest sphere about each pose (..., 3) that holds no singular pose, metres."""
    p, i = joined_poses(position, direction)
    batch = p.shape[:-1]
    p, i = p.reshape(-1, 3), i.reshape(-1, 3)
    surface = _Surface.of(pentapod)
    found, at = np.full(len(p), np.inf), np.full((len(p), 6), np.nan)
    proven = np.full(len(p), np.nan)
    for k in np.flatnonzero(np.isfinite(p).all(axis=1) & np.isfinite(i).all(axis=1)):
        own = surface.coordinates(p[k], i[k])
        found[k], at[k] = _nearest(surface, own, search)
        proven[k] = _free(surface, own, search)
    line = at[:, 3:] / surface.spread
    place = at[:, :3] - surface.mean * line
    return BoundedSphere(found.reshape(batch), proven.reshape(batch), place.reshape(*batch, 3), line.reshape(*batch, 3))


@dataclass(frozen=True, eq=False)
class _Surface:
    """P in the coordinates y = (c, σ i) (6,), in which distances are Euclidean."""

    n: float
    m: Floats
    q: Floats
    mean: float
    spread: float
    to_pose: Floats
    """(6, 6): y → (platform joint of leg 3, direction), the joint before the base joint of leg 3 is taken off."""
    origin: Floats

    @classmethod
    def of(cls, pentapod: GeneralPentapod) -> _Surface:
        null = pentapod.equations.null_vector * (1.0, -1.0, -1.0, -1.0, -1.0)
        mean, spread = float(pentapod.offsets.mean()), float(pentapod.offsets.std())
        to_pose = np.zeros((6, 6))
        to_pose[:3, :3], to_pose[3:, 3:] = np.eye(3), np.eye(3) / spread
        to_pose[:3, 3:] = (float(pentapod.offsets[2]) - mean) / spread * np.eye(3)
        origin = np.array([*pentapod.base[2], 0.0, 0.0, 0.0, 0.0])
        return cls(float(null[0]), null[1:3], null[3:], mean, spread, to_pose, origin)

    def coordinates(self, position: Floats, direction: Floats) -> Floats:
        return np.concatenate([position + self.mean * direction, self.spread * direction])

    def pose(self, y: Floats) -> Floats:
        """Return leg 3's joint seen from its base joint, and i, (..., 6)."""
        return y @ self.to_pose.T - self.origin

    def __call__(self, y: Floats) -> tuple[Floats, Floats, Floats]:
        """Return P (N,), its gradient (N, 6) and Hessian (N, 6, 6) at y (N, 6)."""
        x = self.pose(y)
        flat, pz, w = x[:, :2], x[:, 2:3], x[:, 5:6]
        a, s = pz * x[:, 3:5] - w * flat, w * self.m - pz * self.q
        value = self.n * (w * pz)[:, 0] + (s * a).sum(axis=1)
        gradient, hessian = np.zeros_like(x), np.zeros((len(x), 6, 6))
        gradient[:, 2], gradient[:, 5] = self.n * w[:, 0], self.n * pz[:, 0]
        hessian[:, 2, 5] = hessian[:, 5, 2] = self.n
        for k in range(2):
            by_a, by_s = np.zeros_like(x), np.zeros_like(x)
            by_a[:, 2], by_a[:, 5], by_a[:, 3 + k], by_a[:, k] = x[:, 3 + k], -x[:, k], pz[:, 0], -w[:, 0]
            by_s[:, 5], by_s[:, 2] = self.m[k], -self.q[k]
            gradient += s[:, k : k + 1] * by_a + a[:, k : k + 1] * by_s
            both = by_s[:, :, None] * by_a[:, None, :]
            hessian += both + both.swapaxes(1, 2)
            for row, column, sign in ((2, 3 + k, 1.0), (5, k, -1.0)):
                hessian[:, row, column] += sign * s[:, k]
                hessian[:, column, row] += sign * s[:, k]
        return value, gradient @ self.to_pose, self.to_pose.T @ hessian @ self.to_pose


def _nearest(surface: _Surface, own: Floats, search: SphereSearch) -> tuple[float, Floats]:
    """Return the distance of the nearest singular pose that was found, and the pose (6,); infinite and NaN if none."""
    y = np.concatenate([np.tile(own[:3], (search.directions + 1, 1)), _starts(surface, own, search)], axis=1)
    scale = surface.spread
    multipliers = np.zeros((len(y), 2))
    for _ in range(search.steps):
        value, by_y, bent = surface(y)
        unit = 0.5 * (np.square(y[:, 3:]).sum(axis=1) / scale**2 - 1.0)
        by_unit = np.concatenate([np.zeros((len(y), 3)), y[:, 3:] / scale**2], axis=1)
        rows = np.stack([by_y, by_unit], axis=1)
        matrix = np.zeros((len(y), 8, 8))
        matrix[:, :6, :6] = np.eye(6) + multipliers[:, :1, None] * bent
        matrix[:, 3:6, 3:6] += multipliers[:, 1:, None] * np.eye(3) / scale**2
        matrix[:, :6, 6:], matrix[:, 6:, :6] = rows.swapaxes(1, 2), rows
        wanted = np.concatenate([own - y, -np.stack([value, unit], axis=1)], axis=1)
        regular = np.abs(np.linalg.det(matrix)) > 0.0
        step = np.linalg.solve(np.where(regular[:, None, None], matrix, np.eye(8)), wanted[..., None])[..., 0]
        size = np.linalg.norm(step[:, :6], axis=1)
        # The first steps only go back to the surface: long ones lose it.
        share = np.minimum(1.0, scale / np.maximum(size, 1e-300))[:, None]
        y, multipliers = y + share * step[:, :6], np.where(share == 1.0, step[:, 6:], multipliers)
    value, by_y, _ = surface(y)
    y[:, 3:] *= scale / np.linalg.norm(y[:, 3:], axis=1, keepdims=True)
    slope = np.linalg.norm(by_y, axis=1)
    distance = np.linalg.norm(y - own, axis=1)
    on_it = np.isfinite(distance) & (np.abs(value) <= search.settled * scale * np.maximum(slope, 1e-300))
    if not on_it.any():
        return np.inf, np.full(6, np.nan)
    best = int(np.argmin(np.where(on_it, distance, np.inf)))
    return float(distance[best]), y[best]


def _starts(surface: _Surface, own: Floats, search: SphereSearch) -> Floats:
    """Return σ i (N, 3) of the pose's own direction and of others all over the sphere."""
    count = search.directions
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    aside = np.sqrt(1.0 - height**2)
    around = np.stack([aside * np.cos(turn), aside * np.sin(turn), height], axis=1)
    return np.concatenate([own[None, 3:], surface.spread * around])


def _free(surface: _Surface, own: Floats, search: SphereSearch) -> float:
    """Return a radius within which P cannot vanish, by the product rule: |Δ(xy)| ≤ |x||Δy| + |y||Δx| + |Δx||Δy|."""
    x = surface.pose(own)
    flat, pz, along, w = x[:2], float(x[2]), x[3:5], float(x[5])
    a, s = pz * along - w * flat, w * surface.m - pz * surface.q
    value = abs(surface.n * w * pz + s @ a)
    lever = abs(float(surface.to_pose[0, 3])) * surface.spread

    def change(radius: float) -> float:
        turn = radius / surface.spread
        # |Δc|² + σ²|Δi|² ≤ r²: the joint of leg 3 moves by |Δc| + lever |Δi| at most.
        move = radius * float(np.hypot(1.0, lever / surface.spread))
        wide, tall = float(np.linalg.norm(along)), float(np.linalg.norm(flat))
        by_a = abs(pz) * turn + wide * move + abs(w) * move + tall * turn + 2.0 * move * turn
        by_s = float(np.linalg.norm(surface.m)) * turn + float(np.linalg.norm(surface.q)) * move
        first = abs(surface.n) * (abs(w) * move + abs(pz) * turn + move * turn)
        return first + float(np.linalg.norm(s)) * by_a + float(np.linalg.norm(a)) * by_s + by_a * by_s

    low, high = 0.0, 1.0
    while change(high) < value:
        high *= 2.0
    for _ in range(search.halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if change(middle) < value else (low, middle)
    return low
