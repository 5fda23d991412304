"""Unit vectors: angles, interpolation on great circles, tangent frames, rotation-minimising frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, row_lengths
from pentapod.base.errors import ArrayError

NEARLY_OPPOSITE = 3.0
"""Angle between directions, radians, beyond which the great circle between them is arbitrary."""


def normalised(vectors: ArrayLike, name: str = "direction") -> Floats:
    """Return vectors (..., 3) scaled to unit length. Raises ArrayError where one has no length."""
    v = as_floats(vectors, name, (3,))
    length = row_lengths(v)[..., None]
    if (length < 1e-300).any():
        raise ArrayError(f"{name} has zero length", expected="a vector that points somewhere")
    return v / length


def angle_between(a: ArrayLike, b: ArrayLike) -> Floats:
    """Return the angle in [0, π] radians between vectors (..., 3), accurate at 0 and at π.

    Kahan's formula, 2 atan2(‖â − b̂‖, ‖â + b̂‖): the arc cosine loses half the digits near 0.
    """
    u, v = normalised(a), normalised(b)
    return 2.0 * np.arctan2(row_lengths(u - v), row_lengths(u + v))


def partway(start: Floats, end: Floats, share: Floats) -> Floats:
    """Return the spherical interpolation (..., 3) at `share` (...), 0 to 1, from unit start to unit end.

    Between opposite vectors, which no single great circle joins, one of them is taken.
    """
    angle = np.asarray(share * angle_between(start, end))[..., None]
    across = end - np.einsum("...i,...i->...", start, end)[..., None] * start
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    any_across = tangent_frame(start)[0]
    across = np.where(length > 1e-12, across / np.where(length > 1e-12, length, 1.0), any_across)
    # For nearly opposite vectors the difference keeps few digits: orthogonalise once more.
    across = normalised(across - np.einsum("...i,...i->...", start, across)[..., None] * start)
    mixed = np.cos(angle) * start + np.sin(angle) * across
    return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)


def eased(share: Floats) -> Floats:
    """Return shares from 0 to 1 (N,) that begin and end at rest, without acceleration: a quintic of those given."""
    return share**3 * (10.0 - 15.0 * share + 6.0 * share * share)


def turned(start: Floats, end: Floats, share: Floats, by: Floats) -> Floats:
    """Return the spherical interpolation (N, 3) at `share` (N,) from unit start (3,) to unit end (3,).

    Nearly opposite directions are joined through `by` (3,), unit, or its part perpendicular to the start.
    """
    if float(angle_between(start, end)) < NEARLY_OPPOSITE:
        return partway(np.broadcast_to(start, (len(share), 3)), np.broadcast_to(end, (len(share), 3)), share)
    across = by - (by @ start) * start
    length = float(np.linalg.norm(across))
    middle = across / length if length > 1e-6 else tangent_frame(start)[0]
    early = share < 0.5
    ends = np.where(early[:, None], start, middle), np.where(early[:, None], middle, end)
    return partway(*ends, np.where(early, 2.0 * share, 2.0 * share - 1.0))


def fastest_turn(start: Floats, end: Floats) -> float:
    """Return a bound, radians per unit of `share`, on how fast `turned` turns from unit start (3,) to unit end (3,).

    Nearly opposite directions are an angle a apart. The way round turns a right angle in its first half, and up to
    3/2 π − a in its second, at twice that rate.
    """
    angle = float(angle_between(start, end))
    return angle if angle < NEARLY_OPPOSITE else 3.0 * np.pi - 2.0 * angle


def arc_weights(angle: Floats, share: Floats) -> tuple[Floats, Floats]:
    """Return weights a, b of the spherical interpolation a·start + b·end at `share`, 0 to 1, of an arc of this angle.

    angle, share: of one shape. Equal or opposite vectors are interpolated linearly.
    """
    sine = np.sin(angle)
    bent = sine > 1e-9
    a = np.divide(np.sin((1.0 - share) * angle), sine, out=1.0 - share, where=bent)
    return a, np.divide(np.sin(share * angle), sine, out=share.copy(), where=bent)


def tangent_frame(directions: ArrayLike) -> tuple[Floats, Floats]:
    """Return unit t1, t2 (..., 3) with (t1, t2, direction) right-handed. Directions are unit.

    In the upper half space they are e_x, e_y transported along the great circle from e_z to the direction; in the lower
    one e_x, −e_y from −e_z. So they are smooth within each half space, also at the poles, and jump at the equator.
    """
    d = as_floats(directions, "directions", (3,))
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    # Below the equator the frame is that of the mirrored direction, so that 1 + |z| never cancels.
    side = np.where(z < 0.0, -1.0, 1.0)
    k = 1.0 / (1.0 + side * z)
    t1 = np.stack([1.0 - x * x * k, -x * y * k, -side * x], axis=-1)
    t2 = np.stack([-x * y * k, 1.0 - y * y * k, -side * y], axis=-1)
    return t1, t2 * side[..., None]


def rotation_minimising_frames(directions: ArrayLike) -> Floats:
    """Return unit pairs (N, 2, 3) across unit directions (N, 3), by parallel transport along them (Bishop 1975).

    Each pair is the one before, turned by the smallest rotation that takes its direction to the next; between opposite
    directions one such rotation is chosen. The pairs are smooth at the equator and the poles too.
    """
    d = as_floats(directions, "directions", (3,))
    t1, t2 = tangent_frame(d)
    here, there = d[:-1], d[1:]
    along = (t1[:-1] * there).sum(axis=1) / np.maximum(1.0 + (here * there).sum(axis=1), 1e-12)
    moved = t1[:-1] - along[:, None] * (here + there)
    # The angle from the tangent frames to the transported ones is a cumulative sum.
    turn = np.arctan2((moved * t2[1:]).sum(axis=1), (moved * t1[1:]).sum(axis=1))
    angle = np.concatenate([[0.0], np.cumsum(turn)])[:, None]
    return np.stack([np.cos(angle) * t1 + np.sin(angle) * t2, np.cos(angle) * t2 - np.sin(angle) * t1], axis=1)
