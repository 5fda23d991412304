"""Self-motions of linear pentapods with base joints in a plane: which designs have them, and what they look like.

A self-motion moves the platform line while all legs keep their lengths. G. Nawratil and J. Schicho classify them for
any base ("Self-motions of pentapods with linear platform", arXiv 1510.03567); for a plane base and a design that is not
architecturally singular it is short *(derived)*. The poses of given lengths are on a line (t, px, py, u, v) =
start + τ n, where f = (1 − |b|²)(l_3² − |a|²) − (t − a·b)² = 0, a = (px, py), b = (u, v). A self-motion has infinitely
many τ, so f = 0 for all. Let A, B, T be the parts of n in a, b and t.

- τ⁴: (A × B)² = 0, A and B are parallel.
- B = 0: τ² says (1 − |b|²)|A|² + (T − A·b)² = 0, so w = 0 and T = A·b: the line is level, keeps its direction and
  moves on a circle. The legs keep their lengths where z_k − z_3 = (Â·(a_k − a_3)) / (Â·b): the quadratic family, with
  its x axis along A, and |δ| ≥ 1.
- B ≠ 0: another point of the line in place of leg 3's joint, at the offset z where a + z b is constant, leaves f as it
  is. τ³ says that this point keeps its distance from the origin, τ² that it is on the base plane: the line turns about
  a point P of the base. Legs to that point keep their lengths; the others do where their base joints are on one line
  through P.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, frozen, set_frozen
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.kinematics.families.general import GeneralPentapod
from pentapod.kinematics.families.quadratic import LinearPentapod

Kind = Literal["circular translation", "turn about a point of the base"]


@dataclass(frozen=True, eq=False)
class SelfMotions(Value):
    """A family of self-motions of a design.

    kind. along (2,): unit, in the base: of a translation, where the circles' planes point; of a turn, of the line on
    which P is. slope: δ of a translation, |δ| ≥ 1; NaN else. offset: metres, of the point of the line that stays at P;
    NaN for a translation. origin (2,): metres, leg 3's base joint; of a turn, a point of the line of P.
    """

    kind: Kind
    along: Floats
    slope: float
    offset: float
    origin: Floats
    third: float
    """The offset of leg 3, metres."""

    def __post_init__(self) -> None:
        set_frozen(self, along=frozen(self.along, "along", (2,)), origin=frozen(self.origin, "origin", (2,)))

    def poses(self, angles: ArrayLike, *, size: float, shift: float, side: int = 1) -> tuple[Floats, Floats]:
        """Return positions and directions (..., 3) of one self-motion at angles (...), radians; metres.

        A translation: size is the circle's radius, metres; shift: of its middle across its plane; side: which of the
        two level directions. A turn: size is the cosine, within ±1, of the line with the base's line; shift: of P along
        that. Raises ArrayError for such a size or side that does not exist.
        """
        turn = as_floats(angles, "angles")
        if side not in (1, -1):
            raise ArrayError("there are two sides", key="side", value=side, expected="1 or -1")
        first, up = np.append(self.along, 0.0), np.array([0.0, 0.0, 1.0])
        across = np.array([-self.along[1], self.along[0], 0.0])
        circle = np.cos(turn)[..., None], np.sin(turn)[..., None]
        middle = np.append(self.origin, 0.0)
        if self.kind == "circular translation":
            cosine = 1.0 / self.slope
            i = cosine * first + side * np.sqrt(max(1.0 - cosine * cosine, 0.0)) * across
            joint = middle + shift * across + size * (circle[0] * first + circle[1] * up)
            return joint - self.third * i, np.broadcast_to(i, joint.shape).copy()
        if not abs(size) <= 1.0:
            raise ArrayError("size is out of range", value=size, expected="a cosine, -1 to 1")
        i = size * first + np.sqrt(1.0 - size * size) * (circle[0] * across + circle[1] * up)
        return middle + shift * first - self.offset * i, i


def self_motions(pentapod: LinearPentapod | GeneralPentapod, *, tolerance: float = 1e-9) -> tuple[SelfMotions, ...]:
    """Return all families of self-motions of a design; none, for most.

    tolerance: as a share of the size of the base, how far joints may be from fulfilling a condition. Every design
    within it of one that has self-motions nearly has them: its legs hold those poses badly.
    """
    base, offsets = pentapod.base, pentapod.offsets
    size = float(np.ptp(base, axis=0).max())
    near, found = tolerance * size, list[SelfMotions]()
    # z_k − z_3 = δ Â·(a_k − a_3): an affine map of the base attachments, |δ| its slope.
    gradient, *_ = np.linalg.lstsq(base - base[2], offsets - offsets[2], rcond=None)
    slope = float(np.linalg.norm(gradient))
    if slope >= 1.0 and np.abs((base - base[2]) @ gradient - (offsets - offsets[2])).max() <= near:
        along = gradient / slope
        found.append(SelfMotions("circular translation", along, slope, np.nan, base[2], float(offsets[2])))
    taken: list[float] = []
    for offset in offsets.tolist():
        if any(abs(offset - other) <= near for other in taken):
            continue
        taken.append(offset)
        others = base[np.abs(offsets - offset) > near]
        middle = others.mean(axis=0)
        _, spread, axes = np.linalg.svd(others - middle)
        if spread[-1] <= near:
            third = float(offsets[2])
            found.append(SelfMotions("turn about a point of the base", axes[0], np.nan, offset, middle, third))
    return tuple(found)
