"""How deep a tool goes into a mesh at any time: swept along straight stretches, and how far the motion is off those.

A stretch is some chords between samples. On it the tool is swept as if its tilt centre went straight and its axis
turned evenly: exactly, between the samples too. Where the motion really is differs from that by what is measured at the
samples and what is proven of the chords between them (lemmas 12 and 13 of docs/proofs.md). Stretches that may hold
something deeper than what is
known are cut into eight, down to single chords; most programs are decided long before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats
from pentapod.geometry.solids import Solid
from pentapod.mesh.query.distance import MeshDistance
from pentapod.mesh.query.swept_depth import RESOLUTION_M, TouchingBody, sweep, touch
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.replay import Replay
from pentapod.verify.replay.stretches import CUT, LONGEST, Stretches, strays

_FAR_M = 1e-3
"""Gaps are not looked at beyond this: farther is as good."""
_NEAR_M, _NEAR = 2e-6, 0.03
"""A proven depth is not improved on where it is this much, or this share of what is allowed, above one that is met."""
_LOOKED_AT, _AT_ONCE = 512, 4096


@dataclass(frozen=True)
class Immersion:
    """The largest depth, metres; a negative one is a gap. sample: where.

    met: it is the depth at that moment, and others may be larger; else none is larger at any time.
    """

    most: float
    sample: int
    met: bool = False


def immersion(
    replay: Replay, surface: MeshDistance, solids: tuple[Solid, ...], chords: Bools, *, bound: float
) -> Immersion:
    """Return how deep solids of the tool go into a mesh of the workpiece frame on some chords (M − 1,) of a replay.

    Ends early where a depth that is met is above `bound`, metres.
    """
    body = TouchingBody(solids, replay.toolpath.tilt_centre)
    lever = max(max(abs(s.low - body.tilt_centre), abs(s.high - body.tilt_centre)) + _width(s) for s in solids)
    if all(solid.is_ball and solid.low == body.tilt_centre for solid in solids):
        lever = 0.0  # the ball's path does not know how the tool turns about its centre
    met = _met(replay, surface, body, chords)
    if met.most > bound:
        return met
    most = replace(met, most=-np.inf, met=False)
    size, todo = LONGEST, Stretches.along(chords).cut(LONGEST)
    while len(todo.starts):
        stray = strays(replay, todo, lever)
        order = np.argsort(stray, kind="stable")
        again = np.zeros(len(order), dtype=np.bool_)
        for part in blocks(len(order), _AT_ONCE):
            rows = order[part]
            own, off = todo.where(rows), stray[rows]
            target = _target(met, bound)
            enough = target - float(depth_resolution(target)) - float(off[-1])
            depth, known = _swept(replay, surface, body, own, max(enough, -_FAR_M))
            upper = depth + depth_resolution(depth) + off
            lower = np.where(known, depth - off, -np.inf)
            deepest = int(np.argmax(lower))
            if lower[deepest] > met.most:
                met = Immersion(float(lower[deepest]), int(own.starts[deepest]), met=True)
                if met.most > bound:
                    return met
            again[rows] = (upper > target) & (size > 1)
            kept = np.where(again[rows], -np.inf, upper)
            worst = int(np.argmax(kept))
            if kept[worst] > most.most:
                most = Immersion(float(kept[worst]), int(own.starts[worst]))
        size //= CUT
        todo = todo.where(again).cut(max(size, 1))
    # What was not looked into is not known to be the deepest: then the place of the deepest that is.
    return most if most.most > _target(met, bound) else replace(most, sample=met.sample)


def _target(met: Immersion, bound: float) -> float:
    """Return up to where a proven depth is not improved on."""
    return met.most + max(_NEAR_M, _NEAR * (bound - met.most))


def depth_resolution(depth: ArrayLike) -> Floats:
    """Return by how much a depth may be larger than the sweep says."""
    return RESOLUTION_M + 0.01 * np.maximum(depth, 0.0)


def _width(solid: Solid) -> float:
    return max(solid.low_radius, solid.high_radius) + solid.rounding


def _met(replay: Replay, surface: MeshDistance, body: TouchingBody, chords: Bools) -> Immersion:
    """Return the largest depth at some samples; −1 mm where nothing is nearer."""
    own = np.flatnonzero(chords)
    samples = own[:: max(1, len(own) // _LOOKED_AT)]
    axes = replay.axes[samples]
    tips = replay.tilt_centres[samples] - body.tilt_centre * axes
    depths = touch(surface.tree, body, tips, axes, threshold=-_FAR_M).deepest
    deepest = int(np.argmax(depths))
    return Immersion(max(float(depths[deepest]), -_FAR_M), int(samples[deepest]), met=True)


def _swept(
    replay: Replay, surface: MeshDistance, body: TouchingBody, of: Stretches, threshold: float
) -> tuple[Floats, Bools]:
    """Return depths (n,) on straight stretches, none below `threshold`, and whether (n,) they are above it."""
    both = np.stack([of.starts, of.ends], axis=1).ravel()
    axes = replay.axes[both]
    tips = replay.tilt_centres[both] - body.tilt_centre * axes
    depth = sweep(surface.tree, body, tips, axes, threshold=threshold, every=2).deepest
    return np.maximum(depth, threshold), depth > threshold
