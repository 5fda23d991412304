"""Rigid motions between points, and the centre of a ball from distances, by least squares."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from pentapod.base.arrays import Floats
from pentapod.base.errors import ArrayError
from pentapod.geometry.rigid import RigidTransform

FEWEST = 3
"""Points that fix a rigid motion."""

THIN = 1e-3
"""Width of positions, as a share of their length, below which they are on a line: turns about it are not fixed."""


def rigid_motion(points: Floats, onto: Floats) -> RigidTransform:
    """Return the rigid motion that lays points (N, 3) on others as well as possible.

    Raises ArrayError where it is not determined: fewer than three points, or all on a line.
    """
    if len(points) < FEWEST:
        what = "too few positions to find the instrument's frame"
        raise ArrayError(what, value=len(points), expected=f"at least {FEWEST} in each set-up")
    middle, target = points.mean(axis=0), onto.mean(axis=0)
    spreads = np.linalg.svd(onto - target, compute_uv=False)
    if spreads[1] < THIN * spreads[0]:
        what = "the positions are on a line: they do not fix the instrument's frame"
        raise ArrayError(what, remedy="measure poses to all sides")
    turn, _ = Rotation.align_vectors(onto - target, points - middle)
    return RigidTransform(turn.as_matrix(), target - turn.apply(middle))


def ball_centre(targets: Floats, distances: Floats) -> Floats:
    """Return the point (3,) whose distances from targets (N, 3) are the given ones (N,). Raises ArrayError for N < 4.

    The squares of the distances give a first centre by linear equations; targets in a plane leave two, the one below
    and the one above: the better one is returned, or the one further along z.
    """
    if len(targets) <= FEWEST:
        what = "too few distances to find where the ball stands"
        raise ArrayError(what, value=len(targets), expected=f"more than {FEWEST} in each set-up")
    middle = targets.mean(axis=0)
    local = targets - middle
    _, _, axes = np.linalg.svd(local)
    squares = np.square(distances) - np.square(local).sum(axis=1)
    flat = (local @ axes[:2].T) * -2.0
    inside = np.linalg.lstsq(np.c_[flat, np.ones(len(flat))], squares, rcond=None)[0]
    height = np.sqrt(max(float(inside[2]) - float(inside[:2] @ inside[:2]), 0.0))
    found: list[tuple[float, float, Floats]] = []
    for side in (height, -height):
        first = middle + inside[:2] @ axes[:2] + side * axes[2]
        fit = least_squares(lambda c: np.linalg.norm(targets - c, axis=1) - distances, first)
        found.append((float(fit.cost), -float(fit.x[2]), np.asarray(fit.x, dtype=np.float64)))
    return min(found, key=lambda one: (round(one[0], 15), one[1]))[2]
