"""SixLegPlatform: a 6-SPU platform, five of whose legs are a linear pentapod (kinematics notes, section 6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pentapod.base.arrays import Floats, as_batch, frozen, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.kinematics.batches import as_poses, broadcast, common_batch
from pentapod.kinematics.families.general import GeneralPentapod
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.five_legs import given
from pentapod.kinematics.forward.turning import dihedral, frame_of, twist
from pentapod.kinematics.mode import as_labels


@dataclass(frozen=True, eq=False)
class SixLegPlatform(Value):
    """A linear pentapod's line made a platform by a sixth leg from sixth_base to sixth_joint.

    sixth_base (3,), machine frame; sixth_joint (3,), platform frame: its origin is p, its third axis the line's
    direction i, so the joint's offset along the line is the third number and its distance from the line the length
    of the first two; all in metres. A pose is p (..., 3) and the rotation (..., 3, 3) that turns the platform's frame
    into the machine's: its third column is i.

    A mode's label is three signs: those of the line (a `Component` of a `LinearPentapod`, a `Mode` of a
    `GeneralPentapod`) and the sign of the twist, on which side of the plane through the line and sixth joint the
    sixth base joint lies. There are at most 8 real modes, two for each of the line's four; over the complex numbers
    8 in the quadratic family and 16 in general.

    Raises MachineError: numbers that are not finite, wrong shapes, a sixth joint on the line.
    """

    pentapod: LinearPentapod | GeneralPentapod
    sixth_base: Floats
    sixth_joint: Floats

    def __post_init__(self) -> None:
        base, joint = given(self.sixth_base, "sixth_base", (3,)), given(self.sixth_joint, "sixth_joint", (3,))
        size = max(float(np.abs(self.pentapod.base).max()), float(np.abs(joint).max()))
        if not np.hypot(joint[0], joint[1]) > 1e-12 * size:
            raise MachineError(
                "the sixth joint lies on the line: the sixth leg cannot hold the platform's turn about it",
                key="sixth_joint",
                value=joint.tolist(),
                expected="a joint off the platform's third axis",
            )
        set_frozen(self, sixth_base=frozen(base, "sixth_base"), sixth_joint=frozen(joint, "sixth_joint"))

    @property
    def labels(self) -> NDArray[np.int8]:
        """The labels (8, 3) of the modes, in the order in which `assembly_modes` returns them."""
        return np.array([(*label, turn) for label in self.pentapod.branches for turn in (1, -1)], dtype=np.int8)

    def leg_vectors(self, position: ArrayLike, rotation: ArrayLike) -> Floats:
        """Return b_k − a_k (..., 6, 3), metres, of positions (..., 3) and rotations (..., 3, 3)."""
        p, r = _pose(position, rotation)
        sixth = p + r @ self.sixth_joint - self.sixth_base
        return np.concatenate([self.pentapod.leg_vectors(p, r[..., 2]), sixth[..., None, :]], axis=-2)

    def leg_lengths(self, position: ArrayLike, rotation: ArrayLike) -> Floats:
        """Return leg lengths (..., 6), metres, of positions (..., 3) and rotations (..., 3, 3)."""
        p, r = _pose(position, rotation)
        sixth = np.linalg.norm(p + r @ self.sixth_joint - self.sixth_base, axis=-1)
        return np.concatenate([self.pentapod.leg_lengths(p, r[..., 2]), sixth[..., None]], axis=-1)

    def jacobian(self, position: ArrayLike, rotation: ArrayLike) -> Floats:
        """Return ∂legs/∂(p, ω) (..., 6, 6): dp of the origin in m/m, turn ω (machine frame) in m/rad."""
        p, r = _pose(position, rotation)
        vectors = self.leg_vectors(p, r)
        unit: Floats = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
        arms = self.pentapod.offsets[:, None] * r[..., None, :, 2]
        arms = np.concatenate([arms, (r @ self.sixth_joint)[..., None, :]], axis=-2)
        turning: Floats = np.cross(arms, unit)
        return np.concatenate([unit, turning], axis=-1)

    def twist(self, position: ArrayLike, rotation: ArrayLike) -> Floats:
        """Return (p + z_6 i − a_6) · (i × (b_6 − p − z_6 i)) (...), m²: zero where leg 6 lies in the platform's plane.

        With the polynomial (2) of the five legs it makes up all singularities: the determinant of `jacobian` is
        their product divided by that of the six leg lengths.
        """
        p, r = _pose(position, rotation)
        i, arm = r[..., 2], r[..., :2] @ self.sixth_joint[:2]
        return twist(p + self.sixth_joint[2] * i - self.sixth_base, i, arm)

    def label(self, position: ArrayLike, rotation: ArrayLike) -> NDArray[np.int8]:
        """Return the signs (..., 3) of each pose's mode: the line's two and the twist's; 0 where singular or NaN."""
        p, r = _pose(position, rotation)
        turn = np.nan_to_num(np.sign(self.twist(p, r)))[..., None]
        return np.concatenate([self.pentapod.branch(p, r[..., 2]), turn.astype(np.int8)], axis=-1)

    def pose(self, legs: ArrayLike, label: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions (..., 3) and rotations (..., 3, 3) in a mode: three signs (..., 3).

        legs (..., 6) metres; the labels, each ±1, broadcast against their batch. NaN where no pose of this mode
        has these leg lengths (`platform_obstacles` says why), and where a sign is 0 or NaN. Raises ArrayError.
        """
        signs = as_labels(as_batch(label, "label", (3,)), "label", "for the line's two signs and the twist's")
        lengths, signs = broadcast(as_batch(legs, "legs", (6,)), signs, ("legs", "label"))
        p, i = self.pentapod.pose(lengths[..., :5], signs[..., :2])
        seen = p + self.sixth_joint[2] * i - self.sixth_base
        arm = dihedral(seen, i, float(np.hypot(*self.sixth_joint[:2])), lengths[..., 5], signs[..., 2])
        rotation = frame_of(i, arm, float(np.arctan2(self.sixth_joint[1], self.sixth_joint[0])))
        return np.where(np.isnan(rotation[..., 0]), np.nan, p), rotation

    def assembly_modes(self, legs: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions (..., 8, 3) and rotations (..., 8, 3, 3) of all modes, in the order of `labels`.

        legs (..., 6) metres. NaN in the modes that do not exist: none, 2, 4, 6 or all 8 of them.
        """
        return self.pose(as_batch(legs, "legs", (6,))[..., None, :], self.labels)

    def sixth_leg_range(self, position: ArrayLike, direction: ArrayLike) -> tuple[Floats, Floats]:
        """Return the shortest and longest sixth leg (...), metres, as the platform turns about a line (..., 3)."""
        p, i = as_poses(position, direction)
        seen = p + self.sixth_joint[2] * i - self.sixth_base
        height, distance = np.einsum("...k,...k->...", seen, i), np.linalg.norm(np.cross(seen, i), axis=-1)
        radius = float(np.hypot(*self.sixth_joint[:2]))
        return np.hypot(height, distance - radius), np.hypot(height, distance + radius)


def _pose(position: ArrayLike, rotation: ArrayLike) -> tuple[Floats, Floats]:
    """Return positions (..., 3) and rotations (..., 3, 3) of one batch. Raises ArrayError for other shapes."""
    p, r = as_batch(position, "position", (3,)), as_batch(rotation, "rotation", (3, 3))
    batch = common_batch(p, r, ("position", "rotation"), tail=2)
    return np.broadcast_to(p, (*batch, 3)), np.broadcast_to(r, (*batch, 3, 3))
