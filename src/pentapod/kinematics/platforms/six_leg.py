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
from pentapod.kinematics.mode import as_labels

_ARM_ROUNDING = 16.0 * float(np.finfo(np.float64).eps)


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
        by_turn: Floats = np.cross(arms, unit)
        return np.concatenate([unit, by_turn], axis=-1)

    def twist(self, position: ArrayLike, rotation: ArrayLike) -> Floats:
        """Return (p + z_6 i − a_6) · (i × (b_6 − p − z_6 i)) (...), m²: zero where leg 6 lies in the platform's plane.

        With the polynomial (2) of the five legs it makes up all singularities: the determinant of `jacobian` is
        their product divided by that of the six leg lengths.
        """
        p, r = _pose(position, rotation)
        i, arm = r[..., 2], r[..., :2] @ self.sixth_joint[:2]
        return _signed_volume(p + self.sixth_joint[2] * i - self.sixth_base, i, arm)

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
        arm = _arm(seen, i, float(np.hypot(*self.sixth_joint[:2])), lengths[..., 5], signs[..., 2])
        rotation = rotation_to(i, arm, float(np.arctan2(self.sixth_joint[1], self.sixth_joint[0])))
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


def _signed_volume(seen: Floats, axis: Floats, arm: Floats) -> Floats:
    """Return seen · (axis × arm) (...): signed volume, zero where all three are coplanar. Each (..., 3)."""
    return np.einsum("...k,...k->...", seen, np.cross(axis, arm))


def _arm(seen: Floats, axis: Floats, radius: float, length: Floats, side: Floats) -> Floats:
    """Return the arm (..., 3) of a radius, perpendicular to axis (..., 3): |seen + arm| = length, twist of sign `side`.

    seen (..., 3) leads from the fixed point to the foot of the arm on the line; all in metres. With h = seen · axis,
    M the distance of the fixed point from the line and λ² = length² − h², the arm, M and λ are a plane
    triangle: it exists where |M − radius| ≤ λ ≤ M + radius, to within rounding. NaN elsewhere, where side is 0 or
    NaN, and where M = 0.
    """
    height = np.einsum("...k,...k->...", seen, axis)
    across = seen - height[..., None] * axis
    distance = np.linalg.norm(across, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        reach = np.sqrt(np.maximum((length - height) * (length + height), 0.0))
        # 1 ∓ cos ψ = each of these by 2 M r: the half angle keeps its digits at both ends
        scale = distance + radius + reach
        outer = (distance + radius - reach) * scale
        inner = (reach - np.abs(distance - radius)) * (reach + np.abs(distance - radius))
        slack = _ARM_ROUNDING * np.square(scale + np.abs(height))
        exists = (outer >= -slack) & (inner >= -slack) & (np.abs(side) == 1.0) & (distance > 0.0)
        angle = 2.0 * np.arctan2(np.sqrt(np.maximum(outer, 0.0)), np.sqrt(np.maximum(inner, 0.0)))
        angle = np.where(exists & (length >= 0.0), -side * angle, np.nan)  # seen · (axis × arm) = −M r sin ψ
        towards = across / distance[..., None]
    return radius * (np.cos(angle)[..., None] * towards + np.sin(angle)[..., None] * np.cross(axis, towards))


def rotation_to(axis: Floats, arm: Floats, azimuth: float) -> Floats:
    """Return rotations (..., 3, 3) from (0, 0, 1) to axis and (cos azimuth, sin azimuth, 0) to the arm's direction."""
    radial: Floats = arm / np.linalg.norm(arm, axis=-1, keepdims=True)
    tangential = np.cross(axis, radial)
    c, s = float(np.cos(azimuth)), float(np.sin(azimuth))
    first, second = c * radial - s * tangential, s * radial + c * tangential
    return np.stack([first, second, axis + 0.0 * arm], axis=-1)
