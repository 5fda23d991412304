"""Evaluation of designs on a sample of poses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.design.design_file import DesignFile, Need
from pentapod.design.figures import in_poses
from pentapod.design.geometry import rim
from pentapod.design.part_poses import PartPoses
from pentapod.design.proof import FORCES, OPTIONS, SHAPE, ProofOptions, dense_poses
from pentapod.design.quantities import QUANTITIES, sampled
from pentapod.design.unknowns import Unknowns

ROUNDED_LENGTH, ROUNDED_ANGLE = 1e-4, float(np.radians(0.1))
"""By how much limits of legs and joints are rounded outwards in a machine's file, at most."""
FAR = 1e6
"""In place of what is not finite: a design in which legs have no length, or that is singular."""


@dataclass(frozen=True, eq=False)
class Sample(Value):
    """What designs are evaluated on. unit (N, 5): unit poses of the work volume; parts: poses of parts."""

    unknowns: Unknowns
    leg_stiffness: float | None
    unit: Floats
    parts: PartPoses


def first_sample(file: DesignFile, parts: PartPoses) -> Sample:
    """Return the sample that a search begins with: the rim of the work volume."""
    return Sample(file.unknowns, file.leg_stiffness, rim(8, 2, 16), parts)


def evaluate(sample: Sample, vector: Floats) -> Floats:
    """Return the quantities of a design (in the order of `QUANTITIES`) on a sample; NaN where one is not known."""
    design = sample.unknowns.design(vector)
    with np.errstate(all="ignore"):
        tips, directions = (
            np.concatenate(both) for both in zip(design.poses(sample.unit), sample.parts.at(design), strict=True)
        )
        found = sampled(design, tips, directions, sample.leg_stiffness)
    values = np.array([found.get(name, np.nan) for name in QUANTITIES])
    return np.where(np.isinf(values), FAR, values)


def evaluated(sample: Sample, vectors: Floats) -> Floats:
    """Return the quantities (N, Q) of designs (N, n)."""
    return np.array([evaluate(sample, vector) for vector in vectors]).reshape(len(vectors), len(QUANTITIES))


def shortfalls(needs: tuple[Need, ...], values: Floats, *, reserve: bool = False) -> Floats:
    """Return by how much designs (N, Q) miss needs (N, needs), in steps of their quantities; at most 0 where kept.

    reserve: keep as much more as a proof may be worse than the worst pose.
    """
    names = list(QUANTITIES)
    columns: list[Floats] = []
    for need in needs:
        quantity = QUANTITIES[need.quantity]
        room = reserve_of(need) if reserve else 0.0
        value = np.nan_to_num(values[:, names.index(need.quantity)], nan=-need.sense * FAR)
        columns.append((need.sense * (value - need.bound) + room) / quantity.scale)
    return np.stack(columns, axis=1) if columns else np.zeros((len(values), 0))


def reserve_of(need: Need, options: ProofOptions = OPTIONS) -> float:
    """Return how much worse than on a dense sample a proven quantity can be, SI."""
    length, angle = options.length + ROUNDED_LENGTH, options.angle + ROUNDED_ANGLE
    kinds = {
        "shortest_leg": length, "longest_leg": length, "stroke": 2.0 * length, "dead_length": 3.0 * length,
        "base_cone": angle, "platform_least": angle, "platform_most": angle, "clearance": options.clearance,
        "singular_distance": options.singular,
    }  # fmt: skip
    shares = {"amplification": options.force, "sensitivity": options.force, "stiffness": 2.0 * options.force}
    shares["stroke_ratio"] = 1e-3
    share = shares.get(need.quantity, 0.0)
    return options.reserve * (kinds.get(need.quantity, 0.0) + share * abs(need.bound))


def worst_poses(sample: Sample, vector: Floats, options: ProofOptions = OPTIONS) -> Floats:
    """Return unit poses (K, 5) in which a design is worse than on the sample: worst of a dense sample, made worse.

    What a need has as reserve is used up by the step of a proof, and by how much worse a pose may be before it counts.
    """
    design = sample.unknowns.design(vector)
    axes = design.base_axes()

    def figures(unit: Floats) -> dict[str, Floats]:
        found = in_poses(design, axes, *design.poses(unit))
        return {name: SHAPE.get(name, (1.0,))[0] * values for name, values in found.items() if name != "top"}

    with np.errstate(all="ignore"):
        here, unit = figures(sample.unit), dense_poses(options)
        dense = {name: values for name, values in figures(unit).items() if np.isfinite(values).all()}
        poses = unit[[int(np.argmax(values)) for values in dense.values()]]
        poses, worst = _climbed(figures, list(dense), poses, options)
    rows: list[int] = []
    for row, name in enumerate(dense):
        step = getattr(options, SHAPE.get(name, (1.0, "force"))[1]) * (worst[row] if name in FORCES else 1.0)
        if worst[row] > here[name].max() + (options.reserve - 1.0) * step:
            rows.append(row)
    return poses[rows]


def _climbed(
    figures: Callable[[Floats], dict[str, Floats]], names: list[str], poses: Floats, options: ProofOptions
) -> tuple[Floats, Floats]:
    """Return unit poses (K, 5) near those given, one for each name, where its figure is greater; and the figures."""
    step = np.array([0.25, np.pi / options.around, 1.0 / max(options.levels - 1, 1), 0.25, np.pi / options.azimuths])
    grid = np.meshgrid(*[(0.0, -1.0, 1.0)] * len(step), indexing="ij")  # the pose itself first: it is kept if all equal
    moves = np.stack([axis.ravel() for axis in grid], axis=-1)
    worst = np.zeros(len(names))
    for _ in range(options.climbs if names else 0):
        near = poses[:, None] + step * moves
        near = np.clip(near, (0.0, -np.inf, -1.0, 0.0, -np.inf), (1.0, np.inf, 1.0, 1.0, np.inf))
        found = figures(near.reshape(-1, len(step)))
        values = np.stack([found[name].reshape(len(names), -1)[row] for row, name in enumerate(names)])
        best, rows = np.nan_to_num(values, nan=-np.inf).argmax(axis=1), np.arange(len(names))
        poses, worst = near[rows, best], values[rows, best]
        step = 0.5 * step
    return poses, worst
