"""AsBuiltPentapod: a linear pentapod as it was measured, near the family it was designed in but never exactly in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pentapod.base.arrays import Floats, as_batch
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.kinematics.arithmetic import Arithmetic, Vector
from pentapod.kinematics.batches import broadcast
from pentapod.kinematics.families.as_built_forward import Nominal, as_built_pose
from pentapod.kinematics.families.as_built_quick import quick_poses
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.legs_on_rings import LegsOnRings, broadcast_to_legs
from pentapod.kinematics.proofs.by_leg_equations import ProvenByLegEquations
from pentapod.kinematics.robot import Branch, Robot, SingularSurface


@dataclass(frozen=True, eq=False)
class AsBuiltPentapod(Value, LegsOnRings, ProvenByLegEquations):
    """A machine with the base joints, offsets, radii of rings and zeros of `LegsOnRings`, as they are.

    nominal: the machine that it was built to be; poses are named by its branches, and distances from singularities are
    those of its.

    Raises MachineError as `LegsOnRings`; and where branches and poses are asked of one that knows no nominal machine.
    """

    base: Floats
    offsets: Floats
    radii: Floats
    zeros: Floats
    nominal: Nominal | None = None

    @classmethod
    def of(
        cls,
        nominal: FiveLegs | LegsOnRings,
        *,
        base_errors: ArrayLike = 0.0,
        offset_errors: ArrayLike = 0.0,
        radii: ArrayLike = 0.0,
        zeros: ArrayLike = 0.0,
    ) -> AsBuiltPentapod:
        """Return a machine with errors (metres) added: base_errors (5, 3), the others (5,), or one for all."""
        base = nominal.base_joints + broadcast_to_legs(base_errors, "base_errors", (5, 3))
        offsets = nominal.offsets + broadcast_to_legs(offset_errors, "offset_errors", (5,))
        rings = nominal.radii + broadcast_to_legs(radii, "radii", (5,))
        scales = nominal.zeros + broadcast_to_legs(zeros, "zeros", (5,))
        known = nominal.nominal if isinstance(nominal, AsBuiltPentapod) else nominal
        return cls(base, offsets, rings, scales, known if isinstance(known, Nominal) else None)

    @property
    def branches(self) -> tuple[Branch, ...]:
        """Those of the nominal machine."""
        return self._nominal.branches

    @property
    def singularities(self) -> tuple[SingularSurface, ...]:
        """Those of the nominal machine."""
        return self._nominal.singularities

    @property
    def conditioning(self) -> float:
        """That of the nominal machine."""
        return self._nominal.conditioning

    @property
    def numbers(self) -> Mapping[str, object]:
        """All numbers of this machine, and those of the nominal one."""
        own = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "nominal"}
        return {"family": "as built", **own, **{f"nominal {k}": v for k, v in self._nominal.numbers.items()}}

    def branch(self, position: ArrayLike, direction: ArrayLike) -> NDArray[np.int8]:
        """Return the signs (..., 2) of the nominal machine's branch in the same poses (..., 3)."""
        return self._nominal.branch(position, direction)

    def pose(self, legs: ArrayLike, branch: ArrayLike) -> tuple[Floats, Floats]:
        """Return the proven poses (..., 3) of leg readings (..., 5) in a branch. NaN without proof.

        By `quick_poses`, and by `as_built_pose` where that proves nothing.
        """
        position, direction, proven = quick_poses(self, self._nominal, legs, branch)
        if not proven.all():
            readings, signs = broadcast(as_batch(legs, "legs"), as_batch(branch, "branch"), ("legs", "branch"))
            found = as_built_pose(self, self._nominal, readings[~proven], signs[~proven])
            known = found.proven[..., None]
            position[~proven] = np.where(known, found.position, np.nan)
            direction[~proven] = np.where(known, found.direction, np.nan)
        return position, direction

    @property
    def _nominal(self) -> Nominal:
        if self.nominal is None:
            raise MachineError(
                "a machine as built has poses only beside its nominal geometry",
                key="nominal",
                remedy="AsBuiltPentapod.of(nominal, ...)",
            )
        return self.nominal

    def singularity_margins(self, p: Vector, i: Vector, branch: Branch, do: Arithmetic) -> list[Any]:
        """Return those of the nominal machine in the same pose; the proofs are of the machine as built."""
        return self._nominal.singularity_margins(p, i, branch, do)


def as_pentapod(robot: Robot, purpose: str) -> AsBuiltPentapod:
    """Return a linear pentapod as one to which errors can be added; raises MachineError, which names the purpose."""
    if isinstance(robot, Nominal):
        return AsBuiltPentapod.of(robot)
    if isinstance(robot, AsBuiltPentapod) and robot.nominal is not None:
        return robot
    raise MachineError(
        f"{purpose} needs a linear pentapod", key="robot", value=type(robot).__name__,
        expected="a machine of the family quadratic, general or pentakins",
    )  # fmt: skip
