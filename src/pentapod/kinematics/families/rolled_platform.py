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

from pentapod.base.arrays import Bools, Floats, as_batch, frozen
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.kinematics.arithmetic import Arithmetic, Joints, Vector, dot
from pentapod.kinematics.batches import joined_poses
from pentapod.kinematics.families.six_leg import SixLegPlatform, rotation_to
from pentapod.kinematics.proof_results import BranchProof, Chords, ProvenMeasure
from pentapod.kinematics.robot import Branch, Poses, SingularSurface


@dataclass(frozen=True)
class RollOptions:
    """How far the roll may be from its law, and how bounds are rounded.

    off_law: |cos ψ| beyond which readings have no pose: they are of another program. slack: share that is added to
    bounds, for rounding.
    """

    off_law: float = 0.05
    slack: float = 1e-9


ROLL = RollOptions()


@dataclass(frozen=True, eq=False)
class RolledPlatform(Value):
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
        return frozen(np.vstack([self._line.base_joints, self.platform.sixth_base]), "base_joints")

    @property
    def offsets(self) -> Floats:
        """The platform offsets (6,): of leg 6, where its arm meets the line."""
        return frozen(np.append(self._line.offsets, self._foot), "offsets")

    @property
    def branches(self) -> tuple[Branch, ...]:
        """Those of the line: the twist keeps its side."""
        return self._line.branches

    @property
    def singularities(self) -> tuple[SingularSurface, ...]:
        """Those of the line, and where it runs through the sixth base joint: there no roll is held."""
        return (*self._line.singularities, SingularSurface("line through the sixth base joint", "mm"))

    @property
    def conditioning(self) -> float:
        """That of the line's five legs."""
        return self._line.conditioning

    @property
    def numbers(self) -> Mapping[str, object]:
        """All numbers of the geometry."""
        line = {f"line {name}": value for name, value in self._line.numbers.items()}
        own = {"sixth_base": self.platform.sixth_base, "sixth_joint": self.platform.sixth_joint, "side": self.side}
        return {"family": "six legs", **line, **own}

    def branch(self, position: ArrayLike, direction: ArrayLike) -> NDArray[np.int8]:
        """Return the signs (..., 2) of the line's branch; 0 where it or the roll is singular, and for NaN."""
        p, i = joined_poses(position, direction)
        held = np.linalg.norm(np.cross(self._seen(p, i), i), axis=-1) > 0.0
        return np.where(held[..., None], self._line.branch(p, i), 0).astype(np.int8)

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
        p, i = self._line.pose(lengths[..., :5], branch)
        seen = self._seen(p, i)
        squares = np.square(lengths[..., 5]) - np.square(seen).sum(axis=-1) - self._radius**2
        across = 2.0 * self._radius * np.linalg.norm(np.cross(seen, i), axis=-1)
        with np.errstate(invalid="ignore"):
            on_law = (np.abs(squares) <= ROLL.off_law * across)[..., None]
        return np.where(on_law, p, np.nan), np.where(on_law, i, np.nan)

    def leg_lengths(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return leg lengths (..., 6), metres, of poses (..., 3)."""
        p, i = joined_poses(position, direction)
        sixth = np.sqrt(np.square(self._seen(p, i)).sum(axis=-1) + self._radius**2)
        return np.concatenate([self._line.leg_lengths(p, i), sixth[..., None]], axis=-1)

    def leg_vectors(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return the vectors (..., 6, 3) from base joints to platform joints."""
        p, i = joined_poses(position, direction)
        sixth = self._seen(p, i) + self._arm(p, i)
        return np.concatenate([self._line.leg_vectors(p, i), sixth[..., None, :]], axis=-2)

    def platform_joints(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return where the legs end (..., 6, 3)."""
        return self.base_joints + self.leg_vectors(position, direction)

    def jacobian(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return ∂legs/∂(p, i) (..., 6, 6) with the roll on its law: m/m, then metres per change of i."""
        p, i = joined_poses(position, direction)
        seen = self._seen(p, i)
        unit = seen / np.sqrt(np.square(seen).sum(axis=-1, keepdims=True) + self._radius**2)
        sixth = np.concatenate([unit, self._foot * unit], axis=-1)
        return np.concatenate([self._line.jacobian(p, i), sixth[..., None, :]], axis=-2)

    def leg_derivatives(self, tips: Sequence[tuple[Floats, Floats]], tool_length: float) -> list[Floats]:
        """Return leg lengths (n, 6) and their derivatives along a curve, of as many orders as are given."""
        d = [tip + (tool_length - self._foot) * axis for tip, axis in tips]
        d[0] = d[0] - self.platform.sixth_base

        def products(a: int, b: int) -> Floats:
            return np.einsum("nk,nk->n", d[a], d[b])

        sixth, order = [np.sqrt(products(0, 0) + self._radius**2)], len(tips) - 1
        if order >= 1:
            sixth.append(products(0, 1) / sixth[0])
        if order >= 2:
            sixth.append((products(1, 1) + products(0, 2) - sixth[1] ** 2) / sixth[0])
        if order >= 3:
            sixth.append((3.0 * products(1, 2) + products(0, 3) - 3.0 * sixth[1] * sixth[2]) / sixth[0])
        line = self._line.leg_derivatives(tips, tool_length)
        return [np.column_stack(both) for both in zip(line, sixth, strict=True)]

    def vectors_of(self, p: Vector, i: Vector, do: Arithmetic, joints: Joints | None = None) -> list[Vector]:
        """Return `leg_vectors`, one for each leg, by a formula for numbers and symbols alike; joints: as moved."""
        moved = None if joints is None else (joints[0][:5], joints[1][:5])
        foot, base = self._foot, self.platform.sixth_base.tolist()
        if joints is not None:
            foot, base = joints[1][5], [*joints[0][5], 0.0][:3]
        s = [p[k] + foot * i[k] - base[k] for k in range(3)]
        n = [s[1] * i[2] - s[2] * i[1], s[2] * i[0] - s[0] * i[2], s[0] * i[1] - s[1] * i[0]]
        share = self.side * self._radius / do.sqrt(dot(n, n))
        return [*self._line.vectors_of(p, i, do, moved), [s[k] + share * n[k] for k in range(3)]]

    def lengths_of(self, vectors: Sequence[Vector], do: Arithmetic) -> list[Any]:
        """Return the lengths of vectors."""
        return [do.sqrt(dot(d, d)) for d in vectors]

    def singularity_margins(self, p: Vector, i: Vector, branch: Branch, do: Arithmetic) -> list[Any]:
        """Return those of the line, and the distance M of the sixth base joint from it."""
        s = [p[k] + self._foot * i[k] - self.platform.sixth_base[k] for k in range(3)]
        n = [s[1] * i[2] - s[2] * i[1], s[2] * i[0] - s[0] * i[2], s[0] * i[1] - s[1] * i[0]]
        return [*self._line.singularity_margins(p, i, branch, do), do.sqrt(dot(n, n))]

    @property
    def proven_measures(self) -> tuple[ProvenMeasure, ...]:
        """Those of the line, and the angle of the sixth leg's arm from the plane in which it holds no roll."""
        meaning = "least angle between the sixth joint's arm and the plane of line and sixth base joint,"
        return (*self._line.proven_measures, ProvenMeasure("roll", "deg", 1.0, meaning, "enclosure of the pose"))

    def prove(self, leg_coefficients: Floats, ends: Poses, branch: ArrayLike, *, leg_error: float = 0.0) -> BranchProof:
        """Prove that the line stays in its branch, and that the sixth leg holds the roll at all times."""
        line = self._line.prove(leg_coefficients[:, :5], ends, branch, leg_error=leg_error)
        hull = leg_coefficients[:, :5].swapaxes(1, 2)
        if leg_error > 0.0:  # five errors at once are in the hull of one of five times the size in each leg
            steps = 5.0 * leg_error * np.concatenate([np.eye(5), -np.eye(5)])
            hull = (hull[:, :, None] + steps).reshape(len(hull), -1, 5)
        start = (ends[0][:-1], ends[1][:-1])
        points, turn = self._line.enclose(start, hull, np.array([self._foot]))
        bent = self._roll(start, points[:, 0], turn, leg_coefficients[:, 5], leg_error).cosine
        held = bent < 1.0
        lower = np.where(held, np.sqrt(np.maximum(1.0 - np.square(np.minimum(bent, 1.0)), 0.0)), 0.0)
        doubt = np.where((line.proven & ~held)[:, None], [0.0, 1.0], line.doubt)
        return BranchProof(line.proven & held, line.refuted, doubt, np.column_stack([line.lower, lower]))

    def prove_chords(
        self, legs: Floats, start: Poses, end: Poses, branch: ArrayLike, *, offsets: Floats, base_axes: Floats
    ) -> Chords:
        """Return `Chords` of the line; the sixth leg's cosines are bounded by how far its joints move."""
        points = np.append(offsets, self._foot)
        line = self._line.prove_chords(legs[:, :5], start, end, branch, offsets=points, base_axes=base_axes[:5])
        chord = np.linalg.norm(end[0] - start[0] + self._foot * (end[1] - start[1]), axis=1)
        moved, turned = chord + line.deviations[:, -1], np.linalg.norm(end[1] - start[1], axis=1) + line.angles
        roll = self._roll(start, moved, turned, legs[:, 5], 0.0)
        vector = self.leg_vectors(*start)[:, 5]
        length = np.linalg.norm(vector, axis=1)
        known = line.proven & (roll.cosine < 1.0) & (roll.joint < length)
        with np.errstate(invalid="ignore"):
            swing = np.where(known, np.arcsin(np.minimum(roll.joint / length, 1.0)), np.pi) * (1.0 + ROLL.slack)
            lean = swing + np.where(known, 2.0 * np.arcsin(np.minimum(0.5 * turned, 1.0)), np.pi)
        at_base = _angle(vector, base_axes[5]) + swing
        at_platform = _angle(vector, start[1])
        base = np.where(known, np.cos(np.minimum(at_base, np.pi)) - ROLL.slack, -1.0)
        low = np.where(known, np.cos(np.minimum(at_platform + lean, np.pi)) - ROLL.slack, -1.0)
        high = np.where(known, np.cos(np.maximum(at_platform - lean, 0.0)) + ROLL.slack, 1.0)
        sixth = np.stack([low, high], axis=1)[:, None]
        return Chords(
            known,
            np.where(known[:, None], line.deviations[:, :-1], np.inf),
            np.where(known, line.angles, np.inf),
            np.where(known[:, None], line.speeds[:, :-1], np.inf),
            np.column_stack([line.base_cosines, base]),
            np.concatenate([line.platform_cosines, sixth], axis=1),
        )

    def enclose(self, poses: Poses, legs: Floats, offsets: Floats) -> tuple[Floats, Floats]:
        """Return bounds of how far points of the line and its direction get: the first five legs decide."""
        return self._line.enclose(poses, legs[..., :5], offsets)

    @property
    def _line(self) -> Any:
        return self.platform.pentapod

    @property
    def _foot(self) -> float:
        return float(self.platform.sixth_joint[2])

    @property
    def _radius(self) -> float:
        return float(np.hypot(*self.platform.sixth_joint[:2]))

    def _seen(self, p: Floats, i: Floats) -> Floats:
        return p + self._foot * i - self.platform.sixth_base

    def _arm(self, p: Floats, i: Floats) -> Floats:
        """Return the arm (..., 3) by the law; NaN where the line runs through the sixth base joint."""
        normal = np.cross(self._seen(p, i), i)
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.side * self._radius * normal / np.linalg.norm(normal, axis=-1, keepdims=True)

    def _roll(self, start: Poses, moved: Floats, turned: Floats, lengths: Floats, error: float) -> _RollBounds:
        """Return bounds for a line whose foot of the arm moves by `moved` and whose direction by `turned` (N,) at most.

        start: poses (N, 3). lengths (N, k + 1): Bernstein coefficients of the sixth reading, wrong by `error` at most.
        """
        p, i = start
        seen, radius = self._seen(p, i), self._radius
        far, across = np.linalg.norm(seen, axis=1), np.linalg.norm(np.cross(seen, i), axis=1)
        change = turned * (far + moved) + moved  # of s × i
        least = np.maximum(across - change, 0.0)
        high, low = lengths.max(axis=1) + error, np.maximum(lengths.min(axis=1) - error, 0.0)
        longer = high**2 - np.maximum(far - moved, 0.0) ** 2 - radius**2
        shorter = (far + moved) ** 2 + radius**2 - low**2
        off = np.maximum(longer, shorter) + ROLL.slack * (far + high) ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            cosine = np.where(least > 0.0, off / (2.0 * radius * least), np.inf)
            joint = moved + radius * (2.0 * change / (across + least) + np.sqrt(2.0) * np.minimum(cosine, 1.0))
        known: Bools = np.isfinite(moved) & np.isfinite(turned) & np.isfinite(cosine)
        cosine = np.where(known, cosine, np.inf) * (1.0 + ROLL.slack)
        return _RollBounds(cosine, np.where(known, joint, np.inf) * (1.0 + ROLL.slack))


@dataclass(frozen=True)
class _RollBounds:
    """cosine (N,): bounds of |cos ψ|; joint (N,): of how far the sixth platform joint gets from the law's at the start.

    A unit vector along v changes by 2 |Δv| / (|v| + |v + Δv|) at most, and an arm that is off its law by ψ − 90° ends
    2 r sin(|ψ − 90°| / 2) ≤ √2 r |cos ψ| from where it should.
    """

    cosine: Floats
    joint: Floats


def _angle(a: Floats, b: Floats) -> Floats:
    cosine = np.einsum("nk,nk->n", a, np.broadcast_to(b, a.shape)) / np.linalg.norm(a, axis=1)
    return np.arccos(np.clip(cosine / np.linalg.norm(b, axis=-1), -1.0, 1.0))
