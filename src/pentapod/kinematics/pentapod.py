"""LinearPentapod: the robot's pure geometry and its kinematics. No limits, no bodies."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from pentapod.arrays import Floats, as_batch, as_floats, frozen, set_frozen
from pentapod.errors import MachineError
from pentapod.kinematics.component import COMPONENTS
from pentapod.kinematics.quadratic import LinearPart, solve


@dataclass(frozen=True, eq=False)
class LinearPentapod:
    """Five base attachments a_i = (x_i, y_i, 0) and offsets z_i along the platform line, b_i = p + z_i i.

    base (5, 2) and offsets (5,) in metres; delta: the constant z_i − z_3 = δ (x_i − x_3) of the quadratic
    family. Build one with `LinearPentapod.quadratic`. Machine frame: the base plane is z = 0.
    """

    base: Floats
    offsets: Floats
    delta: float
    _reduced_base: Floats = field(init=False, repr=False)
    _linear: LinearPart = field(init=False, repr=False)

    @classmethod
    def quadratic(cls, base: ArrayLike, delta: float) -> LinearPentapod:
        """Return the pentapod with offsets z_i = δ x_i. base (5, 2) metres. Raises MachineError if singular."""
        xy = as_floats(base, "base", (5, 2))
        return cls(xy, delta * xy[:, 0], float(delta))

    def __post_init__(self) -> None:
        base = frozen(self.base, "base", (5, 2))
        reduced = frozen(base - base[2], "base", (5, 2))
        set_frozen(self, base=base, offsets=frozen(self.offsets, "offsets", (5,)), _reduced_base=reduced)
        try:
            set_frozen(self, _linear=LinearPart.of(reduced, self.delta))
        except np.linalg.LinAlgError as error:
            raise MachineError("the geometry is architecturally singular", remedy="move a base attachment") from error

    def leg_vectors(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return b_i − a_i (..., 5, 3) in metres for positions p and unit directions i (..., 3)."""
        p, i = as_batch(position, "position", (3,)), as_batch(direction, "direction", (3,))
        legs = p[..., None, :] + self.offsets[:, None] * i[..., None, :]
        legs[..., :2] -= self.base
        return legs

    def leg_lengths(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return leg lengths (..., 5) in metres for positions p and unit directions i (..., 3), machine frame."""
        d = self.leg_vectors(position, direction)
        return np.sqrt(np.einsum("...ij,...ij->...i", d, d))

    def assembly_modes(self, legs: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions and directions (..., 4, 3) of the four modes, in the order of `COMPONENTS`.

        legs (..., 5) metres. NaN where no pose has these leg lengths: then all four modes are NaN.
        """
        l2 = np.square(as_batch(legs, "legs", (5,)))[..., None, :]
        signs = np.array(COMPONENTS, dtype=np.float64)
        return self._from_reduced(*solve(l2, self._linear, self.delta, signs[:, 0], signs[:, 1]))

    def pose(self, legs: ArrayLike, component: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions and directions (..., 3) in a component: a `Component`, or signs (..., 2).

        legs (..., 5) metres. NaN where no pose has these leg lengths.
        """
        l2 = np.square(as_batch(legs, "legs", (5,)))
        signs = as_batch(component, "component", (2,))
        return self._from_reduced(*solve(l2, self._linear, self.delta, signs[..., 0], signs[..., 1]))

    def _from_reduced(self, position: Floats, direction: Floats) -> tuple[Floats, Floats]:
        position = position - self.offsets[2] * direction
        position[..., :2] += self.base[2]
        return position, direction
