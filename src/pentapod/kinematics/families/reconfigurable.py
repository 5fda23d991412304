"""ReconfigurablePentapod: base joints on guides, and a singular locus that does not move (paper, section V).

Why it does not: of the design the locus w S = 0 knows δ and z_i − δ x_i alone, S = δ w px + (1 − δu) pz +
(z_i − δ x_i) w with the same z_i − δ x_i for all five legs. A guide along y changes no x_i, and one in any other
direction of the base plane changes z_i by δ times what it changes x_i. What the guides do change is F, the factor that
must not be 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, frozen, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.kinematics.arithmetic import Joints
from pentapod.kinematics.families.conics import conic_determinant, forbidden_conic
from pentapod.kinematics.families.quadratic import LinearPentapod


@dataclass(frozen=True, eq=False)
class ReconfigurablePentapod(Value):
    """A pentapod of the quadratic family whose base joints slide on straight guides in the base plane.

    pentapod: the machine with all slides at 0. guides (5, 2): unit directions, (0, 0) for a joint that is fixed.
    travel (5, 2): least and greatest slide of each, metres. Where a guide has a part along x the platform's joint moves
    with it along the platform line, by δ times that part. Slides are arrays (..., 5) in metres.

    Raises MachineError for guides that are neither unit nor zero, and a travel that ends before it starts.
    """

    pentapod: LinearPentapod
    guides: Floats
    travel: Floats

    def __post_init__(self) -> None:
        set_frozen(self, guides=frozen(self.guides, "guides", (5, 2)), travel=frozen(self.travel, "travel", (5, 2)))
        length = np.linalg.norm(self.guides, axis=1)
        if not ((length == 0.0) | (np.abs(length - 1.0) < 1e-9)).all():
            raise MachineError("guides must be unit directions, or zero", key="guides", value=length.tolist())
        if not (self.travel[:, 0] <= self.travel[:, 1]).all():
            raise MachineError("a guide ends before it starts", key="travel", value=self.travel.tolist())

    @classmethod
    def along_y(cls, pentapod: LinearPentapod, travel: ArrayLike) -> ReconfigurablePentapod:
        """Return the machine with all guides parallel to y: platform joints stay where they are on the line."""
        return cls(pentapod, np.tile((0.0, 1.0), (5, 1)), as_floats(travel, "travel"))

    @classmethod
    def along_x(cls, pentapod: LinearPentapod, travel: ArrayLike) -> ReconfigurablePentapod:
        """Return the machine with all guides parallel to x, and offsets that move with them."""
        return cls(pentapod, np.tile((1.0, 0.0), (5, 1)), as_floats(travel, "travel"))

    def base_at(self, rail_positions: ArrayLike) -> Floats:
        """Return the base attachments (..., 5, 2), metres."""
        return self.pentapod.base + as_floats(rail_positions, "rail_positions", (5,))[..., None] * self.guides

    def offsets_at(self, rail_positions: ArrayLike) -> Floats:
        """Return the platform offsets (..., 5), metres."""
        moved = as_floats(rail_positions, "rail_positions", (5,)) * self.guides[:, 0]
        return self.pentapod.offsets + self.pentapod.delta * moved

    def moved(self, joints: Joints, rail_positions: Sequence[Any]) -> Joints:
        """Return joints of this machine after its guides moved on by slides (5), numbers or expressions."""
        both = list(zip(rail_positions, self.guides.tolist(), strict=True))
        bases = [[x + slide * gx, y + slide * gy] for (x, y), (slide, (gx, gy)) in zip(joints[0], both, strict=True)]
        return bases, [
            z + self.pentapod.delta * slide * gx for z, (slide, (gx, _)) in zip(joints[1], both, strict=True)
        ]

    def at(self, rail_positions: ArrayLike) -> LinearPentapod:
        """Return the pentapod with its guides at slides (5,). Raises MachineError where that one is singular."""
        return LinearPentapod(self.base_at(rail_positions), self.offsets_at(rail_positions), self.pentapod.delta)

    def determinant(self, rail_positions: ArrayLike) -> Floats:
        """Return F (...), paper's (13), at slides (..., 5): metres to the 6th power."""
        return conic_determinant(self.base_at(rail_positions))

    def forbidden_rail_positions(self, leg: int, rail_positions: ArrayLike) -> Floats:
        """Return the positions (k,), metres, of guide `leg` (0 … 4) at which F = 0, the others staying at slides (5,).

        They are where the guide meets the conic through the other four attachments: none, one or two, in rising order,
        whether within the travel or not. A guide along y meets it once at most. Empty too for a fixed joint, or where F
        is 0 all along the guide: `determinant` tells which.
        """
        conic = forbidden_conic(self.base_at(rail_positions), leg)
        x, y = self.pentapod.base[leg] - conic.origin
        gx, gy = self.guides[leg]
        a, b, _, d, e, g = conic.coefficients
        powers = np.array(
            [
                gx * (a * gx + b * gy),
                2.0 * a * x * gx + b * (x * gy + y * gx) + d * gx + e * gy,
                a * x * x + b * x * y + d * x + e * y + g,
            ]
        )
        sizes = np.abs(powers)
        powers[sizes <= 1e-15 * sizes.max(initial=0.0)] = 0.0
        roots = np.roots(np.trim_zeros(powers, "f")) if powers.any() else np.zeros(0)
        return np.sort(np.asarray(roots[np.isreal(roots)].real, dtype=np.float64))

    def stays_regular(self, start: ArrayLike, end: ArrayLike) -> bool:
        """Return whether F keeps its sign while all guides move evenly from start to end (5,).

        F is then a polynomial of degree 6 at most in the way gone; its real roots in [0, 1] are looked for.
        """
        a, b = as_floats(start, "start", (5,)), as_floats(end, "end", (5,))
        at = 0.5 - 0.5 * np.cos(np.pi * (np.arange(7) + 0.5) / 7)
        values = self.determinant(a + at[:, None] * (b - a))
        ends = self.determinant(np.stack([a, b]))
        if not ends[0] * ends[1] > 0.0:
            return False
        fitted = np.polynomial.Chebyshev.fit(at, values, 6, domain=[0.0, 1.0])
        dense = fitted(np.linspace(0.0, 1.0, 201))
        roots = fitted.roots()
        inside = (np.abs(roots.imag) < 1e-7) & (roots.real > -1e-9) & (roots.real < 1.0 + 1e-9)
        return bool((dense * ends[0] > 0.0).all() and not inside.any())
