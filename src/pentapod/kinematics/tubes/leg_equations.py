"""The five leg equations and the unit length of the direction, for any geometry near a linear pentapod.

Leg k runs from a_k, anywhere in space, to the nearest point of a circle of radius r_k around the platform line at
p + z_k i (r_k = 0: to that point itself). With d = p − a, e = d + z i and ρ = |d × i|, the distance of a from
the line, its length is l² = (d·i + z)² + (ρ − r)², so that for a unit direction

    G_k = ½ (|e|² + r² − l²) − r ρ = 0,  k = 1 ... 5,      G_6 = ½ (|i|² − 1) = 0.

In this form G is a quadratic polynomial of (p, i) where r = 0, and nothing is a root or a quotient but ρ. Everything
here takes plain arrays and balls alike: one formula for the solver and for the proof. Vectors have their three
components on the first axis, legs are on the second, the batch is last: (3, 5, N).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar, cast, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.forward.quadratic import LinearPart
from pentapod.kinematics.jacobian import invert
from pentapod.numerics.balls import Ball

Q = TypeVar("Q", Floats, Ball)

_NEXT, _AFTER = [1, 2, 0], [2, 0, 1]


class BuiltLegs(Protocol):
    """A robot whose legs satisfy the equations; all in metres."""

    @property
    def base_joints(self) -> Floats:
        """The joints on the base (5, 3)."""
        ...

    @property
    def offsets(self) -> Floats:
        """The platform offsets along the line (5,)."""
        ...

    @property
    def radii(self) -> Floats:
        """The radii of the rings on which legs end (5,)."""
        ...

    @property
    def zeros(self) -> Floats:
        """Zero errors of the scales (5,): reading minus length."""
        ...


@runtime_checkable
class QuadraticLegs(BuiltLegs, Protocol):
    """Legs of the quadratic family, z_i = z_3 + δ (x_i − x_3)."""

    @property
    def delta(self) -> float:
        """δ, no unit."""
        ...

    @property
    def lever(self) -> float:
        """z_3 − δ x_3, metres."""
        ...

    @property
    def linear_part(self) -> LinearPart:
        """The linear half of the forward kinematics."""
        ...


class PosedLegs(BuiltLegs, Protocol):
    """Legs with forward kinematics."""

    def pose(self, legs: ArrayLike, branch: ArrayLike, /) -> tuple[Floats, Floats]:
        """Return positions and directions (..., 3) of leg readings (..., 5) in a branch."""
        ...


class PosedQuadraticLegs(QuadraticLegs, PosedLegs, Protocol):
    """Legs of the quadratic family with forward kinematics."""


@dataclass(frozen=True, eq=False)
class Legs(Generic[Q]):
    """The geometry at one moment: base (3, 5, N), offsets, radii and lengths (5, N), or N = 1. rings (5, 1): r ≠ 0."""

    base: Q
    offsets: Q
    radii: Q
    lengths: Q
    rings: Bools


@dataclass(frozen=True, eq=False)
class LegEquationRows(Generic[Q]):
    """∂G_k/∂p and ∂G_k/∂i (3, 5, N) in metres and metres squared; e (3, 5, N) and ρ (5, N), metres.

    ρ is 0 for legs without a ring.
    """

    by_position: Q
    by_direction: Q
    e: Q
    rho: Q


def length_scale(robot: BuiltLegs) -> float:
    """Return the metres that count as much as a radian: the base's radius, rounded to a power of two."""
    joints = robot.base_joints
    size = np.linalg.norm(joints - joints.mean(axis=0), axis=1).max()
    return float(2.0 ** np.round(np.log2(size)))


def dot(a: Q, b: Q) -> Q:
    """Return the scalar products of vectors (3, ...)."""
    product = a * b
    return cast("Q", product[0] + product[1] + product[2])


def cross(a: Q, b: Q) -> Q:
    """Return the vector products of vectors (3, ...)."""
    return a[_NEXT] * b[_AFTER] - a[_AFTER] * b[_NEXT]


def rows(position: Q, direction: Q, legs: Legs[Q]) -> LegEquationRows[Q]:
    """Return the derivatives of the leg equations at positions and directions (3, N)."""
    p, i = position[:, None], direction[:, None]
    d, z = p - legs.base, legs.offsets
    e = d + z * i
    if not legs.rings.any():
        return LegEquationRows(e, z * e, e, masked(dot(e, e), legs.rings))
    normal = cross(d, i)
    rho = root(dot(normal, normal))
    n = normal / rho
    pull_p = masked(legs.radii * cross(i, n), legs.rings)
    pull_i = masked(legs.radii * cross(n, d), legs.rings)
    return LegEquationRows(e - pull_p, z * e - pull_i, e, masked(rho, legs.rings))


def residuals(position: Q, direction: Q, legs: Legs[Q]) -> Q:
    """Return G_1 ... G_5 (5, N), metres squared."""
    p, i = position[:, None], direction[:, None]
    d = p - legs.base
    e = d + legs.offsets * i
    r, length = legs.radii, legs.lengths
    g = 0.5 * (dot(e, e) - length * length)
    if not legs.rings.any():
        return g
    normal = cross(d, i)
    return g + masked(r * (0.5 * r - root(dot(normal, normal))), legs.rings)


def root(a: Q) -> Q:
    """Return the square roots."""
    return a.sqrt() if isinstance(a, Ball) else np.sqrt(a)


def masked(a: Q, mask: Bools) -> Q:
    """Return `a` where the mask holds, exactly 0 elsewhere: also where `a` is NaN."""
    return a.where(mask) if isinstance(a, Ball) else np.where(mask, a, 0.0)


def mids(legs: Legs[Ball]) -> Legs[Floats]:
    """Return the midpoints alone."""
    return Legs(legs.base.mid, legs.offsets.mid, legs.radii.mid, legs.lengths.mid, legs.rings)


def float_jacobian(found: LegEquationRows[Floats], direction: Floats, scale: float) -> Floats:
    """Return ∂G/∂(p / scale, i) (N, 6, 6) of directions (3, N)."""
    matrix = np.zeros((direction.shape[-1], 6, 6))
    matrix[:, :5, :3] = np.moveaxis(scale * found.by_position, -1, 0).swapaxes(1, 2)
    matrix[:, :5, 3:] = np.moveaxis(found.by_direction, -1, 0).swapaxes(1, 2)
    matrix[:, 5, 3:] = direction.T
    return matrix


def ball_jacobian(found: LegEquationRows[Ball], direction: Ball, scale: float) -> Ball:
    """Return ∂G/∂(p / scale, i) (N, 6, 6) of directions (3, N); scale is a power of two."""
    mid = float_jacobian(
        LegEquationRows(found.by_position.mid, found.by_direction.mid, found.e.mid, found.rho.mid), direction.mid, scale
    )
    rad = float_jacobian(
        LegEquationRows(found.by_position.rad, found.by_direction.rad, found.e.rad, found.rho.rad), direction.rad, scale
    )
    return Ball(mid, rad)


@dataclass(frozen=True)
class NewtonOptions:
    """When Newton's method ends.

    iterations: at most. settled: size of a step, in radians and in the length that counts as much, below which one last
    step follows; the error that is left after it is rounding.
    """

    iterations: int = 12
    settled: float = 1e-9


def newton(
    position: Floats, direction: Floats, legs: Legs[Floats], scale: float, options: NewtonOptions = NewtonOptions()
) -> tuple[Floats, Floats, Bools]:
    """Return poses (3, N) near the given ones that satisfy the leg equations, and where Newton's method converged (N,).

    scale: metres that count as much as a radian, a power of two. A pose that is NaN or meets a singular Jacobian does
    not converge; it comes back as NaN or as the last iterate.
    """
    p, i = position.copy(), direction.copy()
    settled = np.zeros(p.shape[-1], dtype=bool)
    open_ = np.flatnonzero(np.isfinite(p.sum(axis=0) + i.sum(axis=0)))
    last = np.zeros(p.shape[-1], dtype=bool)
    for _ in range(options.iterations):
        if not open_.size:
            break
        x, d, some = p[:, open_], i[:, open_], _taken(legs, open_)
        jacobian = float_jacobian(rows(x, d, some), d, scale)
        values = np.empty((len(open_), 6))
        values[:, :5] = residuals(x, d, some).T
        values[:, 5] = 0.5 * (np.einsum("cn,cn->n", d, d) - 1.0)
        step = np.einsum("nij,nj->ni", invert(jacobian, np.nan), values)
        p[:, open_] -= scale * step[:, :3].T
        i[:, open_] -= step[:, 3:].T
        size = np.abs(step).max(axis=-1)
        settled[open_[last[open_]]] = True
        last[open_] = size < options.settled
        open_ = open_[~settled[open_] & np.isfinite(size)]
    return p, i, settled & np.isfinite(p.sum(axis=0) + i.sum(axis=0))


def _taken(legs: Legs[Floats], which: np.ndarray) -> Legs[Floats]:
    """Return the geometry of some of the batch; quantities that are the same for all stay so."""

    def take(a: Floats) -> Floats:
        return a if a.shape[-1] == 1 else a[..., which]

    return Legs(take(legs.base), take(legs.offsets), take(legs.radii), take(legs.lengths), legs.rings)
