"""Modes at power-on: which poses fit the readings of the legs, and the machine's strokes, joints and bodies."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, as_floats, frozen, set_frozen
from pentapod.base.errors import InputError
from pentapod.base.refusal import Refusal, stage
from pentapod.base.values import Result, Value
from pentapod.geometry.directions import angle_between
from pentapod.kinematics.all_modes.all_modes import all_poses
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.legs_on_rings import LegsOnRings
from pentapod.kinematics.mode import Mode
from pentapod.kinematics.platforms.constrained import ConstrainedPlatform
from pentapod.kinematics.robot import Branch, Robot
from pentapod.machine.clearance.leg_clearance import clearances, pair_names
from pentapod.machine.machine import Machine


@dataclass(frozen=True, eq=False)
class AssemblyPose(Value):
    """One pose that the legs allow. tip (3,) metres, axis (3,) tip → spindle, machine frame.

    error: by how much the tip can be elsewhere, metres, proven for the error of the legs; infinite close to a
    singularity, where nothing excludes the pose. excluded: the limits of the machine that the pose breaks for certain,
    in words; none where it fits.
    """

    branch: Branch
    tip: Floats
    axis: Floats
    error: float
    excluded: tuple[str, ...]

    def __post_init__(self) -> None:
        set_frozen(self, tip=frozen(self.tip, "tip", (3,)), axis=frozen(self.axis, "axis", (3,)))

    @property
    def located(self) -> bool:
        """Whether it is proven how far away the pose can be."""
        return bool(np.isfinite(self.error))

    @property
    def fits(self) -> bool:
        """Whether no limit excludes it."""
        return not self.excluded


@dataclass(frozen=True, eq=False)
class AssemblyPoses(Result):
    """All poses that the legs allow, by branches of the robot.

    complete: whether it is proven that there is no other one.
    """

    poses: tuple[AssemblyPose, ...]
    complete: bool

    @property
    def admissible(self) -> tuple[AssemblyPose, ...]:
        """Those that fit the machine's limits: the true one is among them."""
        return tuple(pose for pose in self.poses if pose.fits)


@stage
def admissible_modes(machine: Machine, legs: ArrayLike, *, leg_error: float = 1e-5) -> AssemblyPoses | Refusal:
    """Return all poses of leg readings (n_legs,), metres, and which of them fit strokes, cones and bodies.

    leg_error: metres by which each reading may be wrong. A pose is excluded only where it breaks a limit for all
    lengths within that error, so the true one is among the admissible ones; a Refusal says where this cannot be proven:
    lengths without a pose, or close to a singularity, where two modes meet. With base joints in a plane there are no
    other poses (lemma 1 of docs/proofs.md); for a machine as built all are searched (lemma 17), and where that proves
    nothing the poses are those that continue the nominal ones. Where legs end beside the line, the platform counts as
    turned about it by the machine's law, as every program leaves it; where passive joints turn it, the poses are
    those that a search from many starts finds, that of the machine's home first; others close to a singularity count
    as admissible. Raises InputError.
    """
    robot, count = machine.robot, machine.robot.n_legs
    readings = as_floats(legs, "legs")
    if readings.shape != (count,) or not (readings > 0.0).all():
        raise InputError(
            "not the lengths of the legs", key="legs", value=readings.tolist(), expected=f"{count} positive lengths"
        )
    if not 0.0 <= leg_error < np.inf:
        raise InputError("must not be negative", key="leg_error", value=leg_error, expected="metres")
    branches, position, direction, complete = _all_modes(robot, readings, leg_error)
    if not len(position) or not np.isfinite(position).all():
        return Refusal("modes", *_without_pose(machine, readings, leg_error))
    signs = np.array(list(product((-1.0, 1.0), repeat=count)))
    hull = np.broadcast_to(readings + leg_error * signs, (len(branches), len(signs), count))
    points = np.array([*machine.bars.offsets, machine.tool_length])
    moved, turned = robot.enclose((position, direction), hull, points)
    if robot.arms.any():
        moved[:, :count] = robot.enclose_joints((position, direction), hull)
    known: Bools = np.asarray(np.isfinite(moved).all(axis=1), dtype=np.bool_)
    if not (known[0] if isinstance(robot, ConstrainedPlatform) else known.all()):
        near = [str(branch) for branch, sure in zip(branches, known, strict=True) if not sure]
        return Refusal(
            "modes",
            f"close to a singularity in {', '.join(near)}: modes meet within {1e3 * leg_error:g} mm of the legs",
            remedy="read the legs more exactly, or look at the machine",
        )
    excluded = _excluded(machine, readings, position, direction, moved, turned, leg_error)
    tips = position + machine.tool_length * direction
    return AssemblyPoses(
        tuple(
            AssemblyPose(branch, tips[k], -direction[k], float(moved[k, -1]), excluded[k])
            for k, branch in enumerate(branches)
        ),
        complete,
    )


def _all_modes(robot: Robot, legs: Floats, leg_error: float) -> tuple[tuple[Branch, ...], Floats, Floats, bool]:
    """Return branches, positions and directions (K, 3) of all modes, and whether these are proven to be all."""
    branches = robot.branches
    if isinstance(robot, LegsOnRings):
        found = all_poses(robot, legs, leg_error=leg_error)
        named = {tuple(branch): branch for branch in branches}
        signs = [tuple(pair) for pair in robot.branch(found.position, found.direction).tolist()]
        if found.complete and not any(0 in pair for pair in signs):
            # Of a machine that knows the branch of home alone there can be poses in others.
            labels = [named.get(pair, Mode(*pair)) for pair in signs]
            order = sorted(range(len(signs)), key=lambda k: branches.index(labels[k]) if labels[k] in branches else 4)
            labels = tuple(labels[k] for k in order)
            return labels, found.position[order], found.direction[order], True
    if isinstance(robot, ConstrainedPlatform):
        position, direction = robot.all_poses(legs)
        signs = robot.branch(position, direction).tolist()
        return tuple(Mode(*pair) for pair in signs), position, direction, False
    all_legs = np.broadcast_to(legs, (len(branches), robot.n_legs))
    position, direction = robot.pose(all_legs, np.array(branches, dtype=np.float64))
    known: Bools = np.asarray(np.isfinite(position).all(axis=1), dtype=np.bool_)
    if robot.arms.any() and known.any():  # the other modes turn the platform about its line otherwise than the machine
        branches = tuple(branch for branch, there in zip(branches, known, strict=True) if there)
        position, direction = position[known], direction[known]
    return branches, position, direction, isinstance(robot, FiveLegs)


def _without_pose(machine: Machine, legs: Floats, leg_error: float) -> tuple[str, tuple[()], str]:
    """Return cause, no diagnosis, and remedy for legs without a proven pose."""
    outside = _strokes(machine, legs, leg_error)
    cause = "these legs have no pose that is proven" + (f"; {', '.join(outside)}" if outside else "")
    return cause, (), "check that the lengths are in millimetres and in the order of the legs"


def _strokes(machine: Machine, legs: Floats, leg_error: float) -> list[str]:
    """Return the legs (n_legs,) whose readings are beyond their strokes, in words."""
    limits, found = machine.legs, list[str]()
    for k, (length, low, high) in enumerate(zip(legs, limits.min_length, limits.max_length, strict=True), start=1):
        if length < low - leg_error or length > high + leg_error:
            found.append(f"leg {k} reads {1e3 * length:.6g} mm, stroke {1e3 * low:g} to {1e3 * high:g}")
    return found


def _excluded(
    machine: Machine,
    legs: Floats,
    position: Floats,
    direction: Floats,
    moved: Floats,
    turned: Floats,
    leg_error: float,
) -> list[tuple[str, ...]]:
    """Return for each pose (N, 3) the limits that it breaks for certain.

    moved (N, bars + 1): by how much platform joints and tip can be elsewhere; turned (N,): how far the direction's
    end can.
    """
    robot, joints = machine.robot, machine.joints
    vectors = robot.leg_vectors(position, direction)
    length = np.linalg.norm(vectors, axis=2)
    slack = np.arcsin(np.minimum(moved[:, : robot.n_legs] / length, 1.0))
    swing = slack + 2.0 * np.arcsin(np.minimum(0.5 * turned, 1.0))[:, None]
    base = angle_between(vectors, joints.base_axes)
    platform = angle_between(-vectors, -direction[:, None, :])
    gaps = clearances(machine, position, direction) + 2.0 * moved.max(axis=1)[:, None]
    low, high = joints.platform_range.T
    strokes, pairs, found = _strokes(machine, legs, leg_error), pair_names(machine), list[tuple[str, ...]]()
    for n in range(len(position)):
        broken = list(strokes)
        for k in range(robot.n_legs):
            if base[n, k] - slack[n, k] > joints.base_cone[k]:
                cone = np.degrees(joints.base_cone[k])
                broken.append(f"base joint {k + 1} at {np.degrees(base[n, k]):.1f}°, cone {cone:g}°")
            if platform[n, k] + swing[n, k] < low[k] or platform[n, k] - swing[n, k] > high[k]:
                most, least, seen = (np.degrees(x) for x in (high[k], low[k], platform[n, k]))
                broken.append(f"platform joint {k + 1} at {seen:.1f}°, range {least:g}° to {most:g}°")
        broken += [f"{pairs[k]} touch" for k in np.flatnonzero(gaps[n] < 0.0)]
        found.append(tuple(broken))
    return found
