"""Proofs for constrained platforms, as a robot is asked for them, by `constrained_equations`."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats
from pentapod.kinematics.platforms.constrained_equations import OPTIONS, Equations, Tubes, W, X, Y, scale_of
from pentapod.kinematics.proof_results import BranchProof, Chords, ProvenMeasure
from pentapod.kinematics.robot import Poses


class ProvenByKrawczyk:
    """Methods of `ConstrainedPlatform`: proofs in continuous time."""

    proven_measures = (
        ProvenMeasure("w", "deg", 1.0, "least angle between tool axis and base plane,", "enclosure of the pose"),
        ProvenMeasure(
            "", "mm/mm", 1.0, "least change of some leg for each mm that the platform shifts along an axis,",
            "by Krawczyk's operator on the equations of legs, frame and passive joint",
        ),
    )  # fmt: skip

    def prove(self, leg_coefficients: Floats, ends: Poses, branch: ArrayLike, *, leg_error: float = 0.0) -> BranchProof:
        """Prove, interval by interval, that the motion is continuous, unique and regular, and keeps the sign of w."""
        z, equations = _unknowns(self, *ends), Equations(self)
        tubes = equations.tubes(z[:-1], z[1:], leg_coefficients, leg_error)
        sign = float(np.asarray(branch)[-1])
        upright = np.minimum(sign * z[:-1, 11], sign * z[1:, 11]) - tubes.deviation[:, 11]
        proven = tubes.joined() & (upright > 0.0)
        doubt = np.where(proven[:, None], np.nan, [0.0, 1.0])
        with np.errstate(divide="ignore"):
            regular = np.where(proven, 1.0 / tubes.sensitivity, 0.0)
        lower = np.column_stack([np.where(proven, upright, 0.0), regular])
        return BranchProof(proven, np.zeros(len(proven), dtype=np.bool_), doubt, lower)

    def prove_chords(
        self, legs: Floats, start: Poses, end: Poses, branch: ArrayLike, *, offsets: Floats, base_axes: Floats
    ) -> Chords:
        """Return `Chords` from the deviation of the solutions from the straight line between the poses."""
        robot = cast("Any", self)
        first, second = _unknowns(self, *start), _unknowns(self, *end)
        tubes = Equations(self).tubes(first, second, legs, 0.0)
        at_p, at_i = _norm(robot, tubes.deviation[:, :3]), _size(tubes.deviation[:, W])
        speeds = _speeds(robot, tubes, offsets)
        reach = np.abs(offsets)
        longest = np.linalg.norm(0.5 * (first + second)[:, W], axis=1)
        joint = _of_joints(robot, tubes.deviation)
        with np.errstate(invalid="ignore"):
            angles = np.where(tubes.proven & (longest > 5.0 / 6.0), 1.3 * at_i, np.inf)
            vectors, after = robot.leg_vectors(*start), robot.leg_vectors(*end)
            moved = np.linalg.norm(after - vectors, axis=2) + joint
            length = np.linalg.norm(vectors, axis=2)
            swing = np.where(moved < length, np.arcsin(np.minimum(moved / length, 1.0)), np.pi)
            turned = np.linalg.norm((second - first)[:, W], axis=1) + at_i
            lean = swing + (2.0 * np.arcsin(np.minimum(0.5 * turned, 1.0)))[:, None]
            at_base = _angles(vectors, base_axes) + swing
            at_platform = _angles(vectors, start[1][:, None])
            known = tubes.proven[:, None] & np.isfinite(swing)
            base = np.where(known, np.cos(np.minimum(at_base, np.pi)) - OPTIONS.slack, -1.0)
            low = np.where(known, np.cos(np.minimum(at_platform + lean, np.pi)) - OPTIONS.slack, -1.0)
            high = np.where(known, np.cos(np.maximum(at_platform - lean, 0.0)) + OPTIONS.slack, 1.0)
        return Chords(
            tubes.proven,
            _of_points(at_p, at_i, reach),
            angles,
            speeds,
            base,
            np.stack([low, high], axis=2),
            np.where(tubes.proven, moved.max(axis=1), np.inf),
        )

    def enclose(self, poses: Poses, legs: Floats, offsets: Floats) -> tuple[Floats, Floats]:
        """Return bounds of how far points of the line and the direction get, for legs in a hull."""
        deviation = Equations(self).box(_unknowns(self, *poses), legs)
        turn = _size(deviation[:, W])
        known = np.isfinite(turn)
        by_turn = np.abs(offsets) * np.where(known, turn, 0.0)[:, None]
        points = _norm(cast("Any", self), deviation[:, :3])[:, None] + by_turn
        return np.where(known[:, None], points, np.inf), turn

    def enclose_joints(self, poses: Poses, legs: Floats) -> Floats:
        """Return bounds (N, 5) of how far the platform joints get."""
        return _of_joints(cast("Any", self), Equations(self).box(_unknowns(self, *poses), legs))


def _unknowns(robot: Any, position: Floats, direction: Floats) -> Floats:
    rotation = robot.rotation(position, direction)
    columns = [rotation[..., k] for k in range(3)]
    return np.concatenate([position / scale_of(robot), *columns], axis=1)


def _size(components: Floats) -> Floats:
    return np.linalg.norm(components, axis=1)


def _norm(robot: Any, components: Floats) -> Floats:
    return scale_of(robot) * np.linalg.norm(components, axis=1)


def _of_joints(robot: Any, deviation: Floats) -> Floats:
    """Return bounds (N, 5) of the platform joints' deviation, metres, from that of z (N, 12)."""
    axes = np.stack([_size(deviation[:, s]) for s in (X, Y, W)], axis=1)
    known = np.isfinite(axes).all(axis=1, keepdims=True)
    found = _norm(robot, deviation[:, :3])[:, None] + np.where(known, axes, 0.0) @ np.abs(robot.joints).T
    return np.where(known, found, np.inf)


def _of_points(at_p: Floats, at_i: Floats, reach: Floats) -> Floats:
    """Return bounds (N, K) for points of the line from those (N,) of p and i; infinite where they are."""
    known = np.isfinite(at_p + at_i)[:, None]
    return np.where(known, at_p[:, None] + reach * np.where(known[:, 0], at_i, 0.0)[:, None], np.inf)


def _speeds(robot: Any, tubes: Tubes, offsets: Floats) -> Floats:
    """Return bounds (N, K) of the speeds of points of the line, metres per duration of the chord."""
    p, i = scale_of(robot) * tubes.velocity[:, :3], tubes.velocity[:, W]
    found = [np.linalg.norm(p + offset * i, axis=1).max(axis=1) for offset in offsets.tolist()]
    off_p, off_i = _norm(robot, tubes.off[:, :3]), _size(tubes.off[:, W])
    return (np.stack(found, axis=1) + _of_points(off_p, off_i, np.abs(offsets))) * (1.0 + OPTIONS.slack)


def _angles(vectors: Floats, axes: Floats) -> Floats:
    cosine = np.einsum("nkc,nkc->nk", vectors, np.broadcast_to(axes, vectors.shape))
    return np.arccos(np.clip(cosine / (np.linalg.norm(vectors, axis=2) * np.linalg.norm(axes, axis=-1)), -1.0, 1.0))
