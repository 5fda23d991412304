"""Proofs of a platform whose roll follows its line: the five legs' proofs, and bounds of the roll by the sixth leg."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.platforms.six_leg import SixLegPlatform
from pentapod.kinematics.proof_results import BranchProof, Chords, ProvenMeasure
from pentapod.kinematics.robot import Poses


@dataclass(frozen=True)
class RollOptions:
    """How far the roll may be from its law, and how bounds are rounded.

    off_law: |cos ψ| beyond which readings have no pose: they are of another program. slack: share that is added to
    bounds, for rounding.
    """

    off_law: float = 0.05
    slack: float = 1e-9


ROLL = RollOptions()


class ProvenRoll:
    """Methods of `RolledPlatform`, and the numbers that its proofs use."""

    platform: SixLegPlatform

    @property
    def line(self) -> Any:
        """The robot of the first five legs."""
        return self.platform.pentapod

    @property
    def foot(self) -> float:
        """Where the sixth joint's arm meets the line: its offset, metres."""
        return float(self.platform.sixth_joint[2])

    @property
    def radius(self) -> float:
        """The length of the sixth joint's arm, metres."""
        return float(np.hypot(*self.platform.sixth_joint[:2]))

    def seen(self, p: Floats, i: Floats) -> Floats:
        """Return the vectors (..., 3) from the sixth base joint to the foot of the arm."""
        return p + self.foot * i - self.platform.sixth_base

    @property
    def proven_measures(self) -> tuple[ProvenMeasure, ...]:
        """Those of the line, and the angle of the sixth leg's arm from the plane in which it holds no roll."""
        meaning = "least angle between the sixth joint's arm and the plane of line and sixth base joint,"
        return (*self.line.proven_measures, ProvenMeasure("roll", "deg", 1.0, meaning, "enclosure of the pose"))

    def prove(self, leg_coefficients: Floats, ends: Poses, branch: ArrayLike, *, leg_error: float = 0.0) -> BranchProof:
        """Prove that the line stays in its branch, and that the sixth leg holds the roll at all times."""
        line = self.line.prove(leg_coefficients[:, :5], ends, branch, leg_error=leg_error)
        hull = leg_coefficients[:, :5].swapaxes(1, 2)
        if leg_error > 0.0:  # five errors at once are in the hull of one of five times the size in each leg
            steps = 5.0 * leg_error * np.concatenate([np.eye(5), -np.eye(5)])
            hull = (hull[:, :, None] + steps).reshape(len(hull), -1, 5)
        start = (ends[0][:-1], ends[1][:-1])
        points, turn = self.line.enclose(start, hull, np.array([self.foot]))
        bent = self._roll(start, points[:, 0], turn, leg_coefficients[:, 5], leg_error).cosine
        held = bent < 1.0
        lower = np.where(held, np.sqrt(np.maximum(1.0 - np.square(np.minimum(bent, 1.0)), 0.0)), 0.0)
        doubt = np.where((line.proven & ~held)[:, None], [0.0, 1.0], line.doubt)
        return BranchProof(line.proven & held, line.refuted, doubt, np.column_stack([line.lower, lower]))

    def prove_chords(
        self, legs: Floats, start: Poses, end: Poses, branch: ArrayLike, *, offsets: Floats, base_axes: Floats
    ) -> Chords:
        """Return `Chords` of the line; the sixth leg's cosines are bounded by how far its joints move."""
        points = np.append(offsets, self.foot)
        line = self.line.prove_chords(legs[:, :5], start, end, branch, offsets=points, base_axes=base_axes[:5])
        chord = np.linalg.norm(end[0] - start[0] + self.foot * (end[1] - start[1]), axis=1)
        moved, turned = chord + line.deviations[:, -1], np.linalg.norm(end[1] - start[1], axis=1) + line.angles
        roll = self._roll(start, moved, turned, legs[:, 5], 0.0)
        vector = cast("Any", self).leg_vectors(*start)[:, 5]
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
            np.where(known, roll.joint, np.inf),
        )

    def enclose(self, poses: Poses, legs: Floats, offsets: Floats) -> tuple[Floats, Floats]:
        """Return bounds of how far points of the line and its direction get: the first five legs decide."""
        return self.line.enclose(poses, legs[..., :5], offsets)

    def enclose_joints(self, poses: Poses, legs: Floats) -> Floats:
        """Return bounds (N, 6) of how far the platform joints get: the sixth turns with the roll, too."""
        line = self.line
        points, turned = line.enclose(poses, legs[..., :5], np.append(line.offsets, self.foot))
        roll = self._roll(poses, points[:, -1], turned, legs[..., 5], 0.0)
        return np.column_stack([points[:, :-1], roll.joint])

    def _roll(self, start: Poses, moved: Floats, turned: Floats, lengths: Floats, error: float) -> _RollBounds:
        """Return bounds for a line whose foot of the arm moves by `moved` and whose direction by `turned` (N,) at most.

        start: poses (N, 3). lengths (N, k + 1): Bernstein coefficients of the sixth reading, wrong by `error` at most.
        """
        p, i = start
        seen, radius = self.seen(p, i), self.radius
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
