"""Clearances between the legs, and between each leg and the spindle's shaft."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch
from pentapod.machine.clearance.segments import segment_distance
from pentapod.machine.machine import Machine


def pair_names(machine: Machine) -> tuple[str, ...]:
    """Return the names of the pairs, in the order of `clearances`: "legs 1-2" ... "leg 1-shaft" ...."""
    count = machine.robot.n_legs
    legs = tuple(f"legs {a + 1}-{b + 1}" for a, b in combinations(range(count), 2))
    return legs + tuple(f"leg {k + 1}-shaft" for k in range(count))


def clearances(machine: Machine, position: ArrayLike, direction: ArrayLike) -> Floats:
    """Return surface-to-surface distances (..., pairs) in metres of poses (..., 3), negative in an overlap.

    First the pairs of legs, each a capsule from base joint to platform joint. Then the legs against the
    shaft (`Bodies`): there a leg ends `joint_radius` short of its platform joint, where it is joined to the
    shaft. Between capsules whose axes cross the depth is not measured further: −(sum of the radii) is least.
    """
    p, i = as_batch(position, "position", (3,)), as_batch(direction, "direction", (3,))
    robot, bodies = machine.robot, machine.bodies
    vectors = robot.leg_vectors(p, i)
    base = robot.base_joints
    ends = base + vectors
    a, b = np.array(list(combinations(range(robot.n_legs), 2))).T
    legs = segment_distance(base[a], ends[..., a, :], base[b], ends[..., b, :]) - 2.0 * bodies.leg_radius

    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    short = base + vectors * np.maximum(1.0 - bodies.joint_radius / length, 0.0)
    top = p + robot.offsets.min() * i
    nose = p + (machine.tool_length - bodies.shaft_end) * i
    shaft = segment_distance(base, short, top[..., None, :], nose[..., None, :])
    return np.concatenate([legs, shaft - bodies.leg_radius - bodies.shaft_radius], axis=-1)
