"""RolledPlatform: a 6-SPU platform as a robot of tool poses, its roll about the tool axis chosen by a law.

A pose of the tool is a line; the platform's turn about it is free to choose, since the spindle's axis is the line. The
law keeps the arm of the sixth joint perpendicular to the plane of the line and the sixth base joint a_6. There the
twist (`SixLegPlatform.twist`) is as large as it can be: the sixth leg holds the roll best, as far from its singularity
as the line allows. With s = p + z_6 i − a_6, r the arm's length and M = |s × i| the distance of a_6 from the line:

    arm = ± r (s × i) / M,   l_6² = |s|² + r²   (the arm is perpendicular to s).

The first five legs alone decide where the line is, whatever the sixth reads; the sixth decides the roll:
cos ψ = (l_6² − |s|² − r²) / (2 M r), ψ the arm's angle from the plane, 90° on the law. Between setpoints l_6 is off the
law by little, and the roll by as little: the proofs bound it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pentapod.base.arrays import Floats, as_batch, frozen
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.kinematics.arithmetic import Arithmetic, Joints, Vector, dot
from pentapod.kinematics.batches import joined_poses
from pentapod.kinematics.platforms.roll_proofs import ROLL, ProvenRoll
from pentapod.kinematics.platforms.six_leg import SixLegPlatform, rotation_to
from pentapod.kinematics.robot import Branch, SingularSurface


@dataclass(frozen=True, eq=False)
class RolledPlatform(Value, ProvenRoll):
    """A six-leg platform whose roll follows the pose of its line. side: the sign of the twist, +1 or −1.

    Leg 6 ends beside the line: `offsets` has the foot of its arm. Raises MachineError for another side.
    """

    platform: SixLegPlatform
    side: int = 1
    n_legs = 6

    def __post_init__(self) -> None:
        if self.side not in (1, -1):
            raise MachineError("there are two sides", key="side", value=self.side, expected="1 or -1")

    @property
    def base_joints(self) -> Floats:
        """The joints on the base (6, 3)."""
        return frozen(np.vstack([self.line.base_joints, self.platform.sixth_base]), "base_joints")

    @property
    def offsets(self) -> Floats:
        """The platform offsets (6,): of leg 6, where its arm meets the line."""
        return frozen(np.append(self.line.offsets, self.foot), "offsets")

    @property
    def arms(self) -> Floats:
        """The lengths of the arms (6,): that of leg 6 alone."""
        return frozen(np.append(np.zeros(5), self.radius), "arms")

    @property
    def branches(self) -> tuple[Branch, ...]:
        """Those of the line: the twist keeps its side."""
        return self.line.branches

    @property
    def singularities(self) -> tuple[SingularSurface, ...]:
        """Those of the line, and where it runs through the sixth base joint: there no roll is held."""
        return (*self.line.singularities, SingularSurface("line through the sixth base joint", "mm"))

    @property
    def conditioning(self) -> float:
        """That of the line's five legs."""
        return self.line.conditioning

    @property
    def numbers(self) -> Mapping[str, object]:
        """All numbers of the geometry."""
        line = {f"line {name}": value for name, value in self.line.numbers.items()}
        own = {"sixth_base": self.platform.sixth_base, "sixth_joint": self.platform.sixth_joint, "side": self.side}
        return {"family": "six legs", **line, **own}

    def branch(self, position: ArrayLike, direction: ArrayLike) -> NDArray[np.int8]:
        """Return the signs (..., 2) of the line's branch; 0 where it or the roll is singular, and for NaN."""
        p, i = joined_poses(position, direction)
        held = np.linalg.norm(np.cross(self.seen(p, i), i), axis=-1) > 0.0
        return np.where(held[..., None], self.line.branch(p, i), 0).astype(np.int8)

    def rotation(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return the rotations (..., 3, 3) of the platform by the law, in poses (..., 3): `SixLegPlatform`."""
        p, i = joined_poses(position, direction)
        azimuth = float(np.arctan2(self.platform.sixth_joint[1], self.platform.sixth_joint[0]))
        return rotation_to(i, self._arm(p, i), azimuth)

    def pose(self, legs: ArrayLike, branch: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions and directions (..., 3) of leg lengths (..., 6) in a branch.

        NaN where the first five have no pose in it, and where the sixth does not hold the roll near its law.
        """
        lengths = as_batch(legs, "legs", (6,))
        p, i = self.line.pose(lengths[..., :5], branch)
        seen = self.seen(p, i)
        squares = np.square(lengths[..., 5]) - np.square(seen).sum(axis=-1) - self.radius**2
        across = 2.0 * self.radius * np.linalg.norm(np.cross(seen, i), axis=-1)
        with np.errstate(invalid="ignore"):
            on_law = (np.abs(squares) <= ROLL.off_law * across)[..., None]
        return np.where(on_law, p, np.nan), np.where(on_law, i, np.nan)

    def leg_lengths(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return leg lengths (..., 6), metres, of poses (..., 3)."""
        p, i = joined_poses(position, direction)
        sixth = np.sqrt(np.square(self.seen(p, i)).sum(axis=-1) + self.radius**2)
        return np.concatenate([self.line.leg_lengths(p, i), sixth[..., None]], axis=-1)

    def leg_vectors(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return the vectors (..., 6, 3) from base joints to platform joints."""
        p, i = joined_poses(position, direction)
        sixth = self.seen(p, i) + self._arm(p, i)
        return np.concatenate([self.line.leg_vectors(p, i), sixth[..., None, :]], axis=-2)

    def platform_joints(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return where the legs end (..., 6, 3)."""
        return self.base_joints + self.leg_vectors(position, direction)

    def jacobian(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return ∂legs/∂(p, i) (..., 6, 6) with the roll on its law: m/m, then metres per change of i."""
        p, i = joined_poses(position, direction)
        seen = self.seen(p, i)
        unit = seen / np.sqrt(np.square(seen).sum(axis=-1, keepdims=True) + self.radius**2)
        sixth = np.concatenate([unit, self.foot * unit], axis=-1)
        return np.concatenate([self.line.jacobian(p, i), sixth[..., None, :]], axis=-2)

    def passive_wrenches(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return an array (..., 0, 6): six legs hold the platform, no passive joint does."""
        return np.zeros((*joined_poses(position, direction)[0].shape[:-1], 0, 6))

    def hinges(self, position: ArrayLike, direction: ArrayLike) -> Mapping[int, Floats]:
        """Return nothing: no leg hangs in a revolute joint."""
        return {}

    def leg_derivatives(self, tips: Sequence[tuple[Floats, Floats]], tool_length: float) -> list[Floats]:
        """Return leg lengths (n, 6) and their derivatives along a curve, of as many orders as are given."""
        d = [tip + (tool_length - self.foot) * axis for tip, axis in tips]
        d[0] = d[0] - self.platform.sixth_base

        def products(a: int, b: int) -> Floats:
            return np.einsum("nk,nk->n", d[a], d[b])

        sixth, order = [np.sqrt(products(0, 0) + self.radius**2)], len(tips) - 1
        if order >= 1:
            sixth.append(products(0, 1) / sixth[0])
        if order >= 2:
            sixth.append((products(1, 1) + products(0, 2) - sixth[1] ** 2) / sixth[0])
        if order >= 3:
            sixth.append((3.0 * products(1, 2) + products(0, 3) - 3.0 * sixth[1] * sixth[2]) / sixth[0])
        line = self.line.leg_derivatives(tips, tool_length)
        return [np.column_stack(both) for both in zip(line, sixth, strict=True)]

    def vectors_of(self, p: Vector, i: Vector, do: Arithmetic, joints: Joints | None = None) -> list[Vector]:
        """Return `leg_vectors`, one for each leg, by a formula for numbers and symbols alike; joints: as moved."""
        moved = None if joints is None else (joints[0][:5], joints[1][:5])
        foot, base = self.foot, self.platform.sixth_base.tolist()
        if joints is not None:
            foot, base = joints[1][5], [*joints[0][5], 0.0][:3]
        s = [p[k] + foot * i[k] - base[k] for k in range(3)]
        n = [s[1] * i[2] - s[2] * i[1], s[2] * i[0] - s[0] * i[2], s[0] * i[1] - s[1] * i[0]]
        share = self.side * self.radius / do.sqrt(dot(n, n))
        return [*self.line.vectors_of(p, i, do, moved), [s[k] + share * n[k] for k in range(3)]]

    def lengths_of(self, vectors: Sequence[Vector], do: Arithmetic) -> list[Any]:
        """Return the lengths of vectors."""
        return [do.sqrt(dot(d, d)) for d in vectors]

    def singularity_margins(self, p: Vector, i: Vector, branch: Branch, do: Arithmetic) -> list[Any]:
        """Return those of the line, and the distance M of the sixth base joint from it."""
        s = [p[k] + self.foot * i[k] - self.platform.sixth_base[k] for k in range(3)]
        n = [s[1] * i[2] - s[2] * i[1], s[2] * i[0] - s[0] * i[2], s[0] * i[1] - s[1] * i[0]]
        return [*self.line.singularity_margins(p, i, branch, do), do.sqrt(dot(n, n))]

    def _arm(self, p: Floats, i: Floats) -> Floats:
        """Return the arm (..., 3) by the law; NaN where the line runs through the sixth base joint."""
        normal = np.cross(self.seen(p, i), i)
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.side * self.radius * normal / np.linalg.norm(normal, axis=-1, keepdims=True)
