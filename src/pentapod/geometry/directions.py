"""Unit vectors: angles between them, tangent frames, cones."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats
from pentapod.base.errors import ArrayError


def normalised(vectors: ArrayLike, name: str = "direction") -> Floats:
    """Return vectors (..., 3) scaled to unit length. Raises ArrayError where one has no length."""
    v = as_floats(vectors, name, (3,))
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    if (length < 1e-300).any():
        raise ArrayError(f"{name} has zero length", expected="a vector that points somewhere")
    return v / length


def angle_between(a: ArrayLike, b: ArrayLike) -> Floats:
    """Return the angle in [0, π] radians between vectors (..., 3), accurate at 0 and at π.

    Kahan's formula, 2 atan2(‖â − b̂‖, ‖â + b̂‖): the arc cosine loses half the digits near 0.
    """
    u, v = normalised(a), normalised(b)
    return 2.0 * np.arctan2(np.linalg.norm(u - v, axis=-1), np.linalg.norm(u + v, axis=-1))


def partway(start: Floats, end: Floats, share: Floats) -> Floats:
    """Return unit vectors (..., 3) that lie `share` (...), 0 to 1, of the way from unit start to unit end.

    On great circles, evenly. Between opposite vectors all ways are as short: one of them is taken.
    """
    angle = np.asarray(share * angle_between(start, end))[..., None]
    aside = end - np.einsum("...i,...i->...", start, end)[..., None] * start
    length = np.linalg.norm(aside, axis=-1, keepdims=True)
    any_way = tangent_frame(start)[0]
    aside = np.where(length > 1e-12, aside / np.where(length > 1e-12, length, 1.0), any_way)
    # Near opposites the first difference keeps few digits: once more makes it square.
    aside = normalised(aside - np.einsum("...i,...i->...", start, aside)[..., None] * start)
    mixed = np.cos(angle) * start + np.sin(angle) * aside
    return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)


def arc_weights(angle: Floats, share: Floats) -> tuple[Floats, Floats]:
    """Return a and b, so that a·start + b·end lies `share`, 0 to 1, of the way on the arc of this angle between them.

    angle, share: of one shape. The arc of two unit vectors, evenly; equal or opposite ones have none, and are joined by
    the straight line.
    """
    sine = np.sin(angle)
    bent = sine > 1e-9
    a = np.divide(np.sin((1.0 - share) * angle), sine, out=1.0 - share, where=bent)
    return a, np.divide(np.sin(share * angle), sine, out=share.copy(), where=bent)


def tangent_frame(directions: ArrayLike) -> tuple[Floats, Floats]:
    """Return unit t1, t2 (..., 3) with (t1, t2, direction) right-handed. Directions are unit.

    In the upper half space they are e_x, e_y carried along the great circle from e_z to the direction; in the
    lower one the same from −e_z (with e_x, −e_y). So they are smooth within each half space, at both poles
    too, and jump at the equator.
    """
    d = as_floats(directions, "directions", (3,))
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    # Below the equator the frame is that of the mirrored direction, so that 1 + |z| never cancels.
    side = np.where(z < 0.0, -1.0, 1.0)
    k = 1.0 / (1.0 + side * z)
    t1 = np.stack([1.0 - x * x * k, -x * y * k, -side * x], axis=-1)
    t2 = np.stack([-x * y * k, 1.0 - y * y * k, -side * y], axis=-1)
    return t1, t2 * side[..., None]
