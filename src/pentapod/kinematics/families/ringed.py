"""RingedPentapod: base joints anywhere in space, legs to rings around the tool axis, as LinuxCNC's pentakins has them.

There is no closed form of its forward kinematics, and no plane of the base by which its modes could be named. The
component of the configuration space in which the machine stands at home is the one that counts: `pose` returns what is
continued from there, with proof.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pentapod.base.arrays import Floats, as_batch, frozen, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.kinematics.arithmetic import NUMPY, Arithmetic, Vector
from pentapod.kinematics.batches import broadcast, joined_poses
from pentapod.kinematics.families.ringed_poses import poses_from_home
from pentapod.kinematics.five_legs import given
from pentapod.kinematics.legs_on_rings import LegsOnRings
from pentapod.kinematics.mode import Mode, as_labels
from pentapod.kinematics.proofs.by_leg_equations import ProvenByLegEquations
from pentapod.kinematics.robot import Branch, SingularSurface
from pentapod.kinematics.wrench_determinant import leg_wrenches, wrench_determinant, zero_distance

UPRIGHT = np.array([0.0, 0.0, 1.0])
"""The direction of the tool at home."""


@dataclass(frozen=True, eq=False)
class RingedPentapod(Value, LegsOnRings, ProvenByLegEquations):
    """Five legs as `LegsOnRings` describes them. home (3,): p of a pose with the tool along +z, metres.

    A branch is named by the sign of the Jacobian's determinant and that of w (a `Mode`). Several poses can have the
    same legs and the same name: `pose` returns the one that is continued from home, and none in the other branches.

    Raises MachineError as `LegsOnRings`, and for a home that is singular.
    """

    base: Floats
    offsets: Floats
    radii: Floats
    home: Floats
    zeros: Floats = field(default_factory=lambda: np.zeros(5))
    singularities = (
        SingularSurface("plane across home's tool axis, w = 0", "deg"),
        SingularSurface("singular surface, to first order", "mm"),
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        set_frozen(self, home=frozen(given(self.home, "home", (3,)), "home"))
        if 0 in self.branches[0]:
            raise MachineError(
                "home is singular: the legs do not hold the platform there", key="home", value=self.home.tolist(),
                expected="a pose with the tool along +z, in which the machine stands firmly",
            )  # fmt: skip

    @property
    def branches(self) -> tuple[Branch, ...]:
        """That of home alone: `pose` knows no other."""
        return (Mode(*self.branch(self.home, UPRIGHT).tolist()),)

    @property
    def conditioning(self) -> float:
        """The reciprocal condition number of the legs' wrenches at home, with the base's radius as unit of length."""
        wrenches = leg_wrenches(*self._legs(list(self.home), list(UPRIGHT), NUMPY), NUMPY)
        size = float(np.linalg.norm(self.offsets - self.offsets.mean()))
        values = np.linalg.svd(
            np.array([[*(force or ()), *np.divide(moment, size)] for force, moment in wrenches]), compute_uv=False
        )
        return float(values[-1] / values[0])

    @property
    def numbers(self) -> Mapping[str, object]:
        """All numbers of the geometry."""
        own = {name: getattr(self, name) for name in ("base", "offsets", "radii", "home", "zeros")}
        return {"family": "pentakins", **own}

    def branch(self, position: ArrayLike, direction: ArrayLike) -> NDArray[np.int8]:
        """Return the signs (..., 2) of determinant and w; 0 on a singularity and for NaN."""
        p, i = joined_poses(position, direction)
        with np.errstate(invalid="ignore", divide="ignore"):
            value = self._determinant(list(np.moveaxis(p, -1, 0)), list(np.moveaxis(i, -1, 0)), NUMPY)
        return np.nan_to_num(np.sign(np.stack([value, i[..., 2]], axis=-1))).astype(np.int8)

    def pose(self, legs: ArrayLike, branch: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions and directions (..., 3) of leg readings (..., 5) in a branch, continued from home.

        NaN where no continuation is proven, and where its end is in another branch.
        """
        signs = as_labels(as_batch(branch, "branch", (2,)), "branch", "for the determinant and for w")
        readings, signs = broadcast(as_batch(legs, "legs", (5,)), signs, ("legs", "branch"))
        batch, readings, signs = readings.shape[:-1], readings.reshape(-1, 5), signs.reshape(-1, 2)
        p, i = np.full((2, len(readings), 3), np.nan)
        usual = np.flatnonzero((signs == self.branches[0]).all(axis=1))
        p[usual], i[usual] = poses_from_home(self, (self.home, UPRIGHT), readings[usual])
        wrong = ~(self.branch(p, i) == signs).all(axis=1)
        p[wrong] = i[wrong] = np.nan
        return p.reshape(*batch, 3), i.reshape(*batch, 3)

    def singularity_margins(self, p: Vector, i: Vector, branch: Branch, do: Arithmetic) -> list[Any]:
        """Return w, and the determinant by the length of its gradient in p.

        The second is the distance by which the platform can shift unturned to the singular surface, to first order.
        """
        mode = Mode(*branch)
        distance = zero_distance(lambda at: self._determinant(at, i, do), p, do)
        return [mode.image * i[2], mode.order * distance]

    def _legs(self, p: Vector, i: Vector, do: Arithmetic) -> tuple[Vector, list[Vector], list[Vector]]:
        return p, self.vectors_of(p, i, do), self.base.tolist()

    def _determinant(self, p: Vector, i: Vector, do: Arithmetic) -> Any:
        """Return the determinant of the legs' wrenches and the moment about the line, which nothing holds."""
        return wrench_determinant([*leg_wrenches(*self._legs(p, i, do), do), (None, i)])
