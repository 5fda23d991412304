"""Leg rearrangements that leave the singularities where they are: a pencil of lines, and cross ratios.

Source: J. Borràs and F. Thomas, "Singularity-invariant leg rearrangements in line-plane components" (2009, the paper's
[9]). A leg from (x, y) in the base to z on the line enters the singularity polynomial (2) through its row (z, x, y, xz,
yz, 1) alone. The five rows span a hyperplane, C·row = 0 with the cofactors C of the paper's matrix (1), and any five
independent rows of it give the same polynomial, up to a factor. So a leg may move to all (x, y, z) with

    C1 z + C2 x + C3 y + C4 xz + C5 yz + C6 = 0:

for each z a line in the base, and these lines form a pencil through one vertex. It is projective to the platform line:
four lines have the cross ratio of the four z. In the quadratic family the line is x = z/δ, the vertex at infinity.

The leg equations are linear in the same rows *(derived)*: where row = Σ λ_k row_k, Σ λ_k = 1, then in every pose
l² − n = Σ λ_k (l_k² − n_k), n = x² + y² + z². So the lengths before and after a rearrangement follow from each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, frozen, set_frozen
from pentapod.base.errors import ArrayError, MachineError
from pentapod.base.values import Value
from pentapod.kinematics.families.general import GeneralPentapod
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.forward.singularity_polynomial import singularity_cofactors

_ON_SURFACE = 1e-9
"""Distance from its line, as a share of the base's size, within which an attachment counts as on it."""


@dataclass(frozen=True, eq=False)
class EquivalentLeg(Value):
    """The length of a leg that moves no singularity, by those of the five legs: l² = shares · l_k² + constant.

    shares (5,), of sum 1; constant: m². base (2,) and offset: where its joints are, metres.
    """

    base: Floats
    offset: float
    shares: Floats
    constant: float

    def __post_init__(self) -> None:
        set_frozen(self, base=frozen(self.base, "base", (2,)), shares=frozen(self.shares, "shares", (5,)))

    def length(self, legs: ArrayLike) -> Floats:
        """Return its length (...), metres, by those of the five legs (..., 5); NaN where no pose has these."""
        squared = np.square(as_floats(legs, "legs", (5,))) @ self.shares + self.constant
        with np.errstate(invalid="ignore"):
            return np.sqrt(squared)


@dataclass(frozen=True, eq=False)
class LegPencil(Value):
    """Where legs of a pentapod may be attached without moving a singularity.

    cofactors (6,): C1 … C6 of the pentapod, with leg 3's joints as the origin, scaled to largest 1 for coordinates in
    units of `size`, metres. origin (3,): leg 3's (x, y, z).
    """

    pentapod: FiveLegs
    cofactors: Floats
    origin: Floats
    size: float

    @classmethod
    def of(cls, pentapod: LinearPentapod | GeneralPentapod) -> LegPencil:
        """Return the pencil of a pentapod."""
        origin = np.append(pentapod.base[2], pentapod.offsets[2])
        size = float(np.abs(pentapod.base - pentapod.base[2]).max())
        scaled = GeneralPentapod((pentapod.base - origin[:2]) / size, (pentapod.offsets - origin[2]) / size)
        cofactors = singularity_cofactors(scaled)
        return cls(pentapod, frozen(cofactors / np.abs(cofactors).max(), "cofactors", (6,)), origin, size)

    def lines(self, offsets: ArrayLike) -> Floats:
        """Return the lines (..., 3) of offsets (...): (a, b, c) with a x + b y + c = 0, a² + b² = 1, metres.

        NaN for the offset, if there is one, at which every base attachment does.
        """
        z = (as_floats(offsets, "offsets") - self.origin[2]) / self.size
        c1, c2, c3, c4, c5, c6 = self.cofactors
        a, b, c = c2 + c4 * z, c3 + c5 * z, (c1 * z + c6) * self.size
        length = np.hypot(a, b)
        length = np.where(length > 0.0, length, np.nan)
        c = c - a * self.origin[0] - b * self.origin[1]
        return np.stack([a / length, b / length, c / length], axis=-1)

    @property
    def vertex(self) -> Floats:
        """The point (3,) through which all lines go, homogeneous: (x, y, 1) metres, or (x, y, 0) a direction."""
        _, c2, c3, c4, c5, _ = self.cofactors
        c1, c6 = self.cofactors[0] * self.size, self.cofactors[5] * self.size
        point = np.cross([c2, c3, c6], [c4, c5, c1])
        if abs(point[2]) * self.size > _ON_SURFACE * np.abs(point[:2]).max():
            return np.append(point[:2] / point[2] + self.origin[:2], 1.0)
        return np.append(point[:2] / np.hypot(*point[:2]), 0.0)

    def distance(self, base: ArrayLike, offset: float) -> float:
        """Return how far a base attachment (2,) is from the line of an offset, metres."""
        a, b, c = self.lines(offset)
        x, y = as_floats(base, "base", (2,))
        return float(abs(a * x + b * y + c))

    def leg(self, base: ArrayLike, offset: float) -> EquivalentLeg:
        """Return the leg between a base attachment (2,) and an offset, metres. Raises ArrayError: not on its line."""
        at = as_floats(base, "base", (2,))
        off = self.distance(at, offset)
        if not off <= _ON_SURFACE * self.size:
            raise ArrayError("this leg would move the singularities", value=off, expected="an attachment on its line")
        rows = self._rows(self.pentapod.base, self.pentapod.offsets)
        row = self._rows(at[None], np.array([offset]))[0]
        shares = np.linalg.lstsq(rows.T, row, rcond=None)[0]
        own = np.square(self.pentapod.base).sum(axis=1) + np.square(self.pentapod.offsets)
        return EquivalentLeg(at, float(offset), shares, float(at @ at + offset * offset - shares @ own))

    def rearranged(self, leg: int, base: ArrayLike, offset: float) -> GeneralPentapod:
        """Return the pentapod with leg 0 … 4 moved to a base attachment (2,) and an offset: the same singularities.

        Raises ArrayError where that leg would move them, MachineError where the design becomes singular.
        """
        if leg not in range(self.pentapod.n_legs):
            raise ArrayError("there is no such leg", value=leg, expected="0 … 4, legs 1 to 5")
        share = float(self.leg(base, offset).shares[leg])
        if abs(share) < _ON_SURFACE:
            raise MachineError(
                "the design would be architecturally singular: the other four legs determine this one",
                key="base", value=share, expected="a leg that is not determined by the other four",
            )  # fmt: skip
        bases, offsets = self.pentapod.base.copy(), self.pentapod.offsets.copy()
        bases[leg], offsets[leg] = base, offset
        return GeneralPentapod(bases, offsets)

    def _rows(self, base: Floats, offsets: Floats) -> Floats:
        (x, y), z = ((base - self.origin[:2]) / self.size).T, (offsets - self.origin[2]) / self.size
        return np.stack([z, x, y, x * z, y * z, np.ones_like(z)], axis=-1)


def cross_ratio(a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike) -> Floats:
    """Return (a − c)(b − d) / ((b − c)(a − d)) (...) of four numbers (...)."""
    a, b, c, d = (as_floats(x, "numbers") for x in (a, b, c, d))
    return (a - c) * (b - d) / ((b - c) * (a - d))
