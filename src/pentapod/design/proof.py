"""Proofs: what a design keeps in its whole work volume, by branch and bound over boxes of poses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.design.bounds import Boxes
from pentapod.design.figures import in_poses
from pentapod.design.geometry import Geometry, rim

ROUNDING = 1e-7
"""Share of a value by which a bound is made worse: far more than rounding can make of these few operations."""

Bound = Callable[[Boxes], Floats]


@dataclass(frozen=True)
class ProofOptions:
    """How close a bound comes to the worst pose that is known, and how long it is tried.

    length, angle, clearance, singular: metres and radians; force: share of the value. reserve: so many
    of these steps the search keeps from a need, more than 1: the rest is how much worse than its sample a pose may be.
    around, levels, azimuths: of the dense sample on the rim, and on circles half as large. climbs: so often its worst
    poses are made worse, each time by half as far. most: boxes for each of both groups of figures. block: boxes
    at once.
    """

    length: float = 2e-4
    angle: float = 2e-3
    clearance: float = 1e-4
    singular: float = 1e-3
    force: float = 2e-3
    reserve: float = 1.5
    around: int = 24
    levels: int = 3
    azimuths: int = 36
    climbs: int = 6
    most: int = 400_000
    block: int = 4096


OPTIONS = ProofOptions()

SHAPE: dict[str, tuple[float, str]] = {
    "shortest_leg": (-1.0, "length"), "longest_leg": (1.0, "length"), "base_cone": (1.0, "angle"),
    "platform_least": (-1.0, "angle"), "platform_most": (1.0, "angle"), "leg_clearance": (-1.0, "clearance"),
    "shaft_clearance": (-1.0, "clearance"), "singular_distance": (-1.0, "singular"),
}  # fmt: skip
"""Sense (1: the greatest is the worst) and tolerance of each figure of shape."""

FORCES = ("amplification", "sensitivity")


@dataclass(frozen=True, eq=False)
class Proof(Value):
    """Worst values in the whole work volume, by figure, SI. proven: bounds; found: of the worst pose that is known.

    boxes: how many the proof took. settled: whether every bound is as close to `found` as the options ask.
    """

    proven: dict[str, float]
    found: dict[str, float]
    boxes: int
    settled: bool


def dense_worst(design: Geometry, axes: Floats, options: ProofOptions = OPTIONS) -> dict[str, float]:
    """Return the worst value of each figure on the dense sample."""
    return worst_of(in_poses(design, axes, *design.poses(dense_poses(options))))


def dense_poses(options: ProofOptions = OPTIONS) -> Floats:
    """Return the unit poses (N, 5) of the dense sample: rims, and circles half as large."""
    return rim(options.around, options.levels, options.azimuths, (0.5, 1.0))


def worst_of(values: dict[str, Floats]) -> dict[str, float]:
    """Return the worst over poses of figures (N,)."""
    least = {name for name, (sense, _) in SHAPE.items() if sense < 0.0} | {"top"}
    return {name: float(v.min() if name in least else v.max()) for name, v in values.items()}


def prove(design: Geometry, axes: Floats, options: ProofOptions = OPTIONS) -> Proof:
    """Return bounds of the figures over the whole work volume and cone of directions."""
    found = dense_worst(design, axes, options)
    shape = {name: kind for name, kind in SHAPE.items() if name in found}
    senses = np.array([sense for sense, _ in shape.values()])
    steps = np.array([getattr(options, kind) for _, kind in shape.values()])
    worst = senses * np.array([found[name] for name in shape])
    values, worst, count, settled = _bounded(design, axes, bounds_of_shape, list(shape), senses, worst, steps, options)
    proven = dict(zip(shape, (senses * values).tolist(), strict=True))
    found |= dict(zip(shape, (senses * worst).tolist(), strict=True))
    worst = np.array([found[name] for name in FORCES])
    values, worst, more, also = _bounded(
        design, axes, bounds_of_forces, list(FORCES), np.ones(2), worst, options.force * worst, options
    )
    proven |= dict(zip(FORCES, values.tolist(), strict=True))
    found |= dict(zip(FORCES, worst.tolist(), strict=True))
    proven["top"] = found["top"] = float(design.centre[2] - 0.5 * design.height + design.levers.min())
    return Proof(proven, found, count + more, settled and also)


def bounds_of_shape(boxes: Boxes) -> Floats:
    """Return bounds (N, figures) of the figures of shape, in their order; the greater the worse."""
    bodies, (low, high) = boxes.design.bodies, boxes.platform_cosine
    shortest, longest = boxes.lengths
    columns = [
        -shortest.min(axis=1),
        longest.max(axis=1),
        _angle(boxes.base_cosine.min(axis=1)),
        -_angle(high.max(axis=1)),
        _angle(low.min(axis=1)),
        2.0 * bodies.leg_radius - boxes.apart.min(axis=1),
        bodies.leg_radius + bodies.shaft_radius - boxes.shaft.min(axis=1),
    ]
    if boxes.design.delta is not None:
        columns.append(-boxes.singular)
    return np.stack(columns, axis=1)


def bounds_of_forces(boxes: Boxes) -> Floats:
    """Return bounds (N, 2) of `FORCES`."""
    return np.stack(boxes.force_bounds(), axis=1)


def _angle(cosine: Floats) -> Floats:
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def _bounded(
    design: Geometry,
    axes: Floats,
    bound: Bound,
    names: list[str],
    senses: Floats,
    worst: Floats,
    steps: Floats,
    options: ProofOptions,
) -> tuple[Floats, Floats, int, bool]:
    """Return bounds of figures, the worst values found, the boxes it took, and whether all are within `steps`.

    worst: known values, the greater the worse. A box is done when no bound is more than a step above the worst value
    that is known; else it is halved across its longest side, measured by how far a joint moves.
    """
    centre, half = _start(design)
    above = np.full((len(centre), len(names)), np.inf)
    proven, count = np.full(len(names), -np.inf), 0
    while len(centre) and count < options.most:
        block = slice(max(len(centre) - options.block, 0), None)
        boxes = Boxes(design, axes, centre[block], half[block])
        bounds = bound(boxes)
        bounds = np.where(np.isnan(bounds), np.inf, bounds + ROUNDING * np.abs(bounds))
        bounds = np.minimum(bounds, above[block])
        centre, half, above = centre[: block.start], half[: block.start], above[: block.start]
        count += len(bounds)
        open_ = (bounds > worst + steps).any(axis=1)
        proven = np.maximum(proven, bounds[~open_].max(axis=0, initial=-np.inf))
        if not open_.any():
            continue
        at = in_poses(design, axes, boxes.tips[open_], boxes.directions[open_])
        worst = np.maximum(worst, np.array([(s * at[name]).max() for name, s in zip(names, senses, strict=True)]))
        split = _halves(design, boxes.centre[open_], boxes.half[open_])
        centre, half = np.concatenate([centre, split[0]]), np.concatenate([half, split[1]])
        above = np.concatenate([above, np.repeat(bounds[open_], 2, axis=0)])
    settled = not len(centre)
    return np.maximum(proven, above.max(axis=0, initial=-np.inf)), worst, count, settled


def _start(design: Geometry) -> tuple[Floats, Floats]:
    """Return boxes that cover the work volume."""
    sides = (
        (0.0, 0.5 * design.diameter, 1), (0.0, 2.0 * np.pi, 8), (-0.5 * design.height, 0.5 * design.height, 1),
        (0.0, design.tilt, 1), (0.0, 2.0 * np.pi, 8),
    )  # fmt: skip
    halves = [0.5 * (high - low) / parts for low, high, parts in sides]
    middles = [low + half * (2.0 * np.arange(parts) + 1.0) for (low, _, parts), half in zip(sides, halves, strict=True)]
    centre = np.stack([axis.ravel() for axis in np.meshgrid(*middles, indexing="ij")], axis=-1, dtype=np.float64)
    return centre, np.broadcast_to(halves, centre.shape).copy()


def _halves(design: Geometry, centre: Floats, half: Floats) -> tuple[Floats, Floats]:
    """Return both halves of each box."""
    lever = float(np.abs(design.levers).max())
    far, lean = centre[:, 0] + half[:, 0], np.sin(centre[:, 3] + half[:, 3])
    size = np.stack([np.ones(len(far)), far, np.ones(len(far)), np.full(len(far), lever), lever * lean], axis=-1)
    side = np.argmax(half * size, axis=1)
    rows = np.arange(len(side))
    smaller = half.copy()
    smaller[rows, side] *= 0.5
    shift = np.zeros_like(half)
    shift[rows, side] = smaller[rows, side]
    both = np.stack([centre - shift, centre + shift], axis=1).reshape(-1, half.shape[1])
    twice = np.repeat(smaller, 2, axis=0)
    return np.asarray(both, dtype=np.float64), np.asarray(twice, dtype=np.float64)
