"""Reach: a bound from above on the distance between two places that the tool tip can be at, cheap to compute."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.distance import pdist

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine


@dataclass(frozen=True)
class ReachOptions:
    """cells: along each axis, of the grid that encloses the tips. rail: shift of a leg's ends in rail travels."""

    cells: int = 40
    rail: float = 2.0


def tip_cells(machine: Machine, options: ReachOptions = ReachOptions()) -> tuple[Floats, float]:
    """Return the middles (M, 3) of cells that enclose all tips within strokes and base cones, and the cells' radius.

    Sound for any tool axis: the tip is always as far from a platform joint as in one pose. Other limits only make the
    reach smaller. Rails may stand anywhere.
    """
    robot, legs, joints = machine.robot, machine.legs, machine.joints
    position, direction = np.zeros(3), np.array([0.0, 0.0, 1.0])
    ends = robot.platform_joints(position, direction) - machine.tool_length * direction
    vectors = robot.leg_vectors(position, direction)
    slack = np.linalg.norm(ends, axis=1)
    # A reading may differ from the length of its leg by a constant.
    slack += np.abs(robot.leg_lengths(position, direction) - np.linalg.norm(vectors, axis=1))
    if machine.guides is not None:
        slack += options.rail * np.ptp(machine.guides.travel, axis=1)
    far, base = (legs.max_length + slack)[:, None], robot.base_joints
    low, high = (base - far).max(axis=0), (base + far).min(axis=0)
    if not (high > low).all():
        return np.empty((0, 3)), 0.0
    size = (high - low) / options.cells
    radius = 0.5 * float(np.linalg.norm(size))
    axes = [start + step * (np.arange(options.cells) + 0.5) for start, step in zip(low, size, strict=True)]
    middles = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    for k in range(robot.n_legs):
        apart = middles - base[k]
        distance, around = np.linalg.norm(apart, axis=1), slack[k] + radius
        turn = np.arcsin(np.minimum(around / np.maximum(distance, around), 1.0))
        cosine = np.clip(apart @ joints.base_axes[k] / np.maximum(distance, 1e-300), -1.0, 1.0)
        kept = (distance - around <= legs.max_length[k]) & (distance + around >= legs.min_length[k])
        kept &= (np.arccos(cosine) <= joints.base_cone[k] + turn) | (distance <= around)
        middles = middles[kept]
    return middles, radius


def reach(machine: Machine) -> float:
    """Return a bound from above on the distance between any two tips of a machine, metres; 0 where it has none."""
    middles, radius = tip_cells(machine)
    if len(middles) < 4 or (np.ptp(middles, axis=0) == 0.0).any():
        return float(np.linalg.norm(np.ptp(middles, axis=0))) + 2.0 * radius if len(middles) else 0.0
    hull = middles[ConvexHull(middles).vertices]
    return float(pdist(hull).max()) + 2.0 * radius
