"""Upper bound on the depth of a tool in a mesh at all times: branch and bound over straight stretches.

A stretch is some chords between samples. On it the tool is swept as if its tilt centre moved straight and its axis
turned evenly: exactly, between the samples too. The deviation of the real motion from that is measured at the samples
and proven between them (lemmas 12 and 13 of docs/proofs.md). A stretch that may hold a greater depth than the deepest
one found is cut into eight, down to single chords; most programs are decided long before.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats
from pentapod.geometry.solids import Solid
from pentapod.mesh.query.distance import MeshDistance
from pentapod.mesh.query.swept_depth import RESOLUTION_M, TouchingBody, sweep, touch
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.replay import Replay
from pentapod.verify.replay.stretches import Stretches, StretchOptions, deviation_bounds


@dataclass(frozen=True)
class GougeBoundOptions:
    """Options of the search. They change how tight the bound is and what it costs, never whether it holds.

    far_m: gaps are not computed beyond this. near_m, near_share: a bound is not tightened where it is this much, in
    metres or as a share of what is allowed, above a depth that was found. samples: how many are evaluated first.
    at_once: stretches swept together.
    """

    far_m: float = 1e-3
    near_m: float = 2e-6
    near_share: float = 0.03
    samples: int = 512
    at_once: int = 4096
    stretches: StretchOptions = field(default_factory=StretchOptions)


@dataclass(frozen=True)
class GougeBound:
    """depth: metres, negative for a gap. sample: where.

    attained: the tool is that deep there, perhaps deeper elsewhere; else the depth is an upper bound for all times.
    """

    depth: float
    sample: int
    attained: bool = False


def gouge_bound(
    replay: Replay,
    surface: MeshDistance,
    solids: tuple[Solid, ...],
    chords: Bools,
    *,
    bound: float,
    options: GougeBoundOptions = GougeBoundOptions(),
) -> GougeBound:
    """Return the depth of solids of the tool in a mesh of the workpiece frame on some chords (M − 1,) of a replay.

    Ends early where the tool is deeper than `bound`, metres.
    """
    body = TouchingBody(solids, replay.toolpath.tilt_centre)
    lever = max(max(abs(s.low - body.tilt_centre), abs(s.high - body.tilt_centre)) + s.largest_radius for s in solids)
    if all(solid.is_ball and solid.low == body.tilt_centre for solid in solids):
        lever = 0.0  # the path of the ball does not depend on how the tool turns about its centre
    found = _deepest_sample(replay, surface, body, chords, options)
    if found.depth > bound:
        return found
    most = GougeBound(-np.inf, found.sample)
    size = options.stretches.longest
    todo = Stretches.along(chords).cut(size)
    while len(todo.starts):
        deviation = deviation_bounds(replay, todo, lever, options.stretches)
        order = np.argsort(deviation, kind="stable")
        again = np.zeros(len(order), dtype=np.bool_)
        for part in blocks(len(order), options.at_once):
            rows = order[part]
            own, off = todo.where(rows), deviation[rows]
            target = _target(found, bound, options)
            enough = max(target - float(depth_resolution(target)) - float(off[-1]), -options.far_m)
            depth, known = _swept(replay, surface, body, own, enough)
            upper = depth + depth_resolution(depth) + off
            lower = np.where(known, depth - off, -np.inf)
            deepest = int(np.argmax(lower))
            if lower[deepest] > found.depth:
                found = GougeBound(float(lower[deepest]), int(own.starts[deepest]), attained=True)
                if found.depth > bound:
                    return found
            again[rows] = (upper > target) & (size > 1)
            kept = np.where(again[rows], -np.inf, upper)
            worst = int(np.argmax(kept))
            if kept[worst] > most.depth:
                most = GougeBound(float(kept[worst]), int(own.starts[worst]))
        size //= options.stretches.cuts
        todo = todo.where(again).cut(max(size, 1))
    # A stretch that was not cut is not known to be the deepest: then the place of the deepest depth found is named.
    return most if most.depth > _target(found, bound, options) else replace(most, sample=found.sample)


def _target(found: GougeBound, bound: float, options: GougeBoundOptions) -> float:
    """Return the depth up to which a bound is not tightened."""
    return found.depth + max(options.near_m, options.near_share * (bound - found.depth))


def depth_resolution(depth: ArrayLike) -> Floats:
    """Return by how much a depth may be larger than that of the sweep, metres."""
    return RESOLUTION_M + 0.01 * np.maximum(depth, 0.0)


def _deepest_sample(
    replay: Replay, surface: MeshDistance, body: TouchingBody, chords: Bools, options: GougeBoundOptions
) -> GougeBound:
    """Return the largest depth at some samples; −far_m where nothing is nearer."""
    own = np.flatnonzero(chords)
    samples = own[:: max(1, len(own) // options.samples)]
    axes = replay.axes[samples]
    tips = replay.tilt_centres[samples] - body.tilt_centre * axes
    depths = touch(surface.tree, body, tips, axes, threshold=-options.far_m).deepest
    deepest = int(np.argmax(depths))
    return GougeBound(max(float(depths[deepest]), -options.far_m), int(samples[deepest]), attained=True)


def _swept(
    replay: Replay, surface: MeshDistance, body: TouchingBody, of: Stretches, threshold: float
) -> tuple[Floats, Bools]:
    """Return depths (n,) on straight stretches, none below `threshold`, and whether (n,) they are above it."""
    both = np.stack([of.starts, of.ends], axis=1).ravel()
    axes = replay.axes[both]
    tips = replay.tilt_centres[both] - body.tilt_centre * axes
    depth = sweep(surface.tree, body, tips, axes, threshold=threshold, every=2).deepest
    return np.maximum(depth, threshold), depth > threshold
