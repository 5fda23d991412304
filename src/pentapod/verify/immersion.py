"""How deep a tool goes into a mesh at any time: swept along straight stretches, and how far the motion is off those.

A stretch is some chords between samples. On it the tool is swept as if its pivot went straight and its axis turned
evenly: exactly, between the samples too. Where the motion really is differs from that by what is measured at the
samples and what is proven of the chords between them (lemmas 12 and 13 of docs/proofs.md). Stretches that may hold
something deeper than what is
known are cut into eight, down to single chords; most programs are decided long before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from pentapod.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import angle_between, arc_weights
from pentapod.geometry.runs import marked_runs
from pentapod.kinematics.blocks import blocks
from pentapod.toolpath.mesh_distance import MeshDistance
from pentapod.toolpath.solids import Solid
from pentapod.toolpath.sweep import RESOLUTION_M, TouchingBody, sweep, touch
from pentapod.verify.replay import Replay

_LONGEST, _CUT = 64, 8
_FAR_M = 1e-3
"""Gaps are not looked at beyond this: farther is as good."""
_NEAR_M, _NEAR = 2e-6, 0.03
"""A proven depth is not improved on where it is this much, or this share of what is allowed, above one that is met."""
_WIDEST = 1.0
"""Radians: arcs that turn farther are not taken for one stretch."""
_LOOKED_AT, _AT_ONCE = 512, 4096
_BLOCK = 1 << 10  # stretches


@dataclass(frozen=True)
class Immersion:
    """The largest depth, metres; a negative one is a gap. sample: where.

    met: it is the depth at that moment, and others may be larger; else none is larger at any time.
    """

    most: float
    sample: int
    met: bool = False


@dataclass(frozen=True, eq=False)
class _Stretches:
    """From sample starts (n,) to ends (n,)."""

    starts: Ints
    ends: Ints

    def where(self, keep: Bools | slice | Ints) -> _Stretches:
        return _Stretches(self.starts[keep], self.ends[keep])

    def cut(self, size: int) -> _Stretches:
        """Return the stretches of at most `size` chords that make these up."""
        parts = -(-(self.ends - self.starts) // size)
        number = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
        starts = np.repeat(self.starts, parts) + size * number
        return _Stretches(starts, np.minimum(starts + size, np.repeat(self.ends, parts)))


def immersion(
    replay: Replay, surface: MeshDistance, solids: tuple[Solid, ...], chords: Bools, *, bound: float
) -> Immersion:
    """Return how deep solids of the tool go into a mesh of the workpiece frame on some chords (M − 1,) of a replay.

    Ends early where a depth that is met is above `bound`, metres.
    """
    body = TouchingBody(solids, replay.toolpath.pivot)
    lever = max(max(abs(s.low - body.pivot), abs(s.high - body.pivot)) + _width(s) for s in solids)
    if all(solid.is_ball and solid.low == body.pivot for solid in solids):
        lever = 0.0  # the ball's path does not know how the tool turns about its centre
    met = _met(replay, surface, body, chords)
    if met.most > bound:
        return met
    most = replace(met, most=-np.inf, met=False)
    size, todo = _LONGEST, _runs(chords).cut(_LONGEST)
    while len(todo.starts):
        stray = _strays(replay, todo, lever)
        order = np.argsort(stray, kind="stable")
        again = np.zeros(len(order), dtype=np.bool_)
        for part in blocks(len(order), _AT_ONCE):
            rows = order[part]
            own, off = todo.where(rows), stray[rows]
            target = _target(met, bound)
            enough = target - float(_unresolved(target)) - float(off[-1])
            depth, known = _swept(replay, surface, body, own, max(enough, -_FAR_M))
            upper = depth + _unresolved(depth) + off
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
        size //= _CUT
        todo = todo.where(again).cut(max(size, 1))
    # What was not looked into is not known to be the deepest: then the place of the deepest that is.
    return most if most.most > _target(met, bound) else replace(most, sample=met.sample)


def _target(met: Immersion, bound: float) -> float:
    """Return up to where a proven depth is not improved on."""
    return met.most + max(_NEAR_M, _NEAR * (bound - met.most))


def _unresolved(depth: ArrayLike) -> Floats:
    """Return by how much a depth may be larger than the sweep says."""
    return RESOLUTION_M + 0.01 * np.maximum(depth, 0.0)


def _width(solid: Solid) -> float:
    return max(solid.low_radius, solid.high_radius) + solid.rounding


def _runs(chords: Bools) -> _Stretches:
    """Return the runs of marked chords."""
    return _Stretches(*marked_runs(chords).T)


def _met(replay: Replay, surface: MeshDistance, body: TouchingBody, chords: Bools) -> Immersion:
    """Return the largest depth at some samples; −1 mm where nothing is nearer."""
    own = np.flatnonzero(chords)
    samples = own[:: max(1, len(own) // _LOOKED_AT)]
    axes = replay.axes[samples]
    tips = replay.pivots[samples] - body.pivot * axes
    depths = touch(surface.tree, body, tips, axes, threshold=-_FAR_M).deepest
    deepest = int(np.argmax(depths))
    return Immersion(max(float(depths[deepest]), -_FAR_M), int(samples[deepest]), met=True)


def _swept(
    replay: Replay, surface: MeshDistance, body: TouchingBody, of: _Stretches, threshold: float
) -> tuple[Floats, Bools]:
    """Return depths (n,) on straight stretches, none below `threshold`, and whether (n,) they are above it."""
    both = np.stack([of.starts, of.ends], axis=1).ravel()
    axes = replay.axes[both]
    tips = replay.pivots[both] - body.pivot * axes
    depth = sweep(surface.tree, body, tips, axes, threshold=threshold, every=2).deepest
    return np.maximum(depth, threshold), depth > threshold


def _strays(replay: Replay, stretches: _Stretches, lever: float) -> Floats:
    """Return by how much (n,) points of the tool are at most off the straight stretch, at any time, metres.

    Infinite where the tool turns too far for that to be said. lever: how far they are from the pivot at most.

    A moment is compared with the place of the stretch that is nearest to it. Between two samples that place goes
    evenly, and unit vectors on an arc θ are off the line through two of them by no more than θ²/8.
    """
    found = np.empty(len(stretches.starts))
    for part in blocks(len(found), _BLOCK):
        found[part] = _stray(replay, stretches.where(part), lever)
    return found


def _stray(replay: Replay, of: _Stretches, lever: float) -> Floats:
    # Samples and the chords that they begin; the last sample of a stretch is where it ends.
    counts = of.ends - of.starts
    begins = np.cumsum(counts) - counts
    sample = np.repeat(of.starts - begins, counts) + np.arange(counts.sum())
    start, end = replay.pivots[of.starts], replay.pivots[of.ends]
    first, last = replay.axes[of.starts], replay.axes[of.ends]
    way, turn = end - start, last - first
    square = np.einsum("ij,ij->i", way, way) + lever**2 * np.einsum("ij,ij->i", turn, turn)
    owner = np.repeat(np.arange(len(counts)), counts)
    off, turned = replay.pivots[sample] - start[owner], replay.axes[sample] - first[owner]
    along = np.einsum("ij,ij->i", off, way[owner]) + lever**2 * np.einsum("ij,ij->i", turned, turn[owner])
    share = np.divide(along, square[owner], out=np.zeros_like(along), where=square[owner] > 0.0)
    share = np.clip(share, 0.0, 1.0)[:, None]
    aside = np.maximum.reduceat(np.linalg.norm(off - share * way[owner], axis=1), begins)
    away = np.maximum.reduceat(replay.survey.away[sample], begins)
    if lever == 0.0:
        return aside + away
    angle = angle_between(first, last)
    a, b = arc_weights(angle[owner, None], share)
    swung = replay.axes[sample] - (a * first[owner] + b * last[owner])
    apart = np.maximum.reduceat(np.linalg.norm(swung, axis=1), begins) + 0.125 * angle**2
    tilt = np.arcsin(np.minimum(apart, 1.0)) + np.maximum.reduceat(replay.survey.turned[sample], begins)
    # An axis as far as a radius from the arc may point anywhere.
    return np.where((angle < _WIDEST) & (apart < 1.0), aside + away + lever * tilt, np.inf)
