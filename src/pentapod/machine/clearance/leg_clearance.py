"""Leg clearances: distances between the legs, and between each leg and the spindle's shaft, as capsules."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch
from pentapod.machine.machine import Machine


def pair_names(machine: Machine) -> tuple[str, ...]:
    """Return the names of the pairs, in the order of `clearances`: "legs 1-2" ... "leg 1-shaft" ...."""
    names, count = machine.bars.names, machine.robot.n_legs
    pairs = (
        f"legs {a + 1}-{b + 1}" if b < count else f"{names[a]}-{names[b]}"
        for a, b in combinations(range(len(names)), 2)
    )
    return (*pairs, *(f"{name}-shaft" for name in names))


def clearances(machine: Machine, position: ArrayLike, direction: ArrayLike) -> Floats:
    """Return surface-to-surface distances (..., pairs) in metres of poses (..., 3), negative in an overlap.

    First the pairs of legs and passive limb, each a capsule from base joint to platform joint, and with its arm, a
    capsule of the same radius, where it ends beside the line. Then they and the shaft (`Bodies`): there a bar
    that ends on the line ends `joint_radius` short of its platform joint. Where axes cross the distance is −(sum of the
    radii), whatever the depth.
    """
    p, i = as_batch(position, "position", (3,)), as_batch(direction, "direction", (3,))
    bars, bodies = machine.bars, machine.bodies
    base, ends = bars.ends(p, i)
    beside, offsets, radii = bars.beside, bars.offsets, bars.radii
    a, b = np.array(list(combinations(range(len(radii)), 2))).T
    apart = segment_distance(base[..., a, :], ends[..., a, :], base[..., b, :], ends[..., b, :])
    for one, other in ((a, b), (b, a)):
        pairs = beside[other]
        leg, arm = one[pairs], other[pairs]
        feet = p[..., None, :] + offsets[arm][:, None] * i[..., None, :]
        to_arm = segment_distance(base[..., leg, :], ends[..., leg, :], ends[..., arm, :], feet)
        apart[..., pairs] = np.minimum(apart[..., pairs], to_arm)
    legs = apart - (radii[a] + radii[b])

    vectors = ends - base
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    joined = np.where(beside, 0.0, bodies.joint_radius)[:, None]
    short = base + vectors * np.maximum(1.0 - joined / length, 0.0)
    top = p + machine.line_top * i
    nose = p + (machine.tool_length - bodies.shaft_end) * i
    shaft = segment_distance(base, short, top[..., None, :], nose[..., None, :])
    return np.concatenate([legs, shaft - radii - bodies.shaft_radius], axis=-1)


def segment_distance(start_a: ArrayLike, end_a: ArrayLike, start_b: ArrayLike, end_b: ArrayLike) -> Floats:
    """Return the distances (...,) in metres between segments a and b, ends (..., 3), broadcast.

    Degenerate (one point) and parallel segments are allowed. Source: C. Ericson, Real-Time Collision
    Detection, section 5.1.9. Minimising over one segment's parameter, then the other's, then the first's
    again is exact for this convex problem, since the first guess is exact wherever no end is hit.
    """
    tiny = 1e-30  # m²: keeps a division by the length of a degenerate segment finite
    a0, a1 = as_batch(start_a, "start_a", (3,)), as_batch(end_a, "end_a", (3,))
    b0, b1 = as_batch(start_b, "start_b", (3,)), as_batch(end_b, "end_b", (3,))
    along_a, along_b, between = a1 - a0, b1 - b0, a0 - b0
    aa = np.maximum(_dot(along_a, along_a), tiny)
    bb = np.maximum(_dot(along_b, along_b), tiny)
    ab, a_gap, b_gap = _dot(along_a, along_b), _dot(along_a, between), _dot(along_b, between)
    parallel = np.maximum(aa * bb - ab * ab, tiny * aa * bb + tiny * tiny)
    s = np.clip((ab * b_gap - a_gap * bb) / parallel, 0.0, 1.0)
    t = np.clip((ab * s + b_gap) / bb, 0.0, 1.0)
    s = np.clip((ab * t - a_gap) / aa, 0.0, 1.0)
    gap = between + s[..., None] * along_a - t[..., None] * along_b
    return np.sqrt(_dot(gap, gap))


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("...i,...i->...", a, b)
