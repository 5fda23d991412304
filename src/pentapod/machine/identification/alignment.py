"""Frames: rigid motions between points, the centre of a ball from distances, the frame of the base joints."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from pentapod.base.arrays import Floats
from pentapod.base.errors import ArrayError
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.machine.calibration.parameters import PARAMETERS

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
    turn = Rotation.align_vectors(onto - target, points - middle)[0]
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


def in_base_frame(built: AsBuiltPentapod, covariance: Floats, nominal: Floats) -> tuple[AsBuiltPentapod, Floats]:
    """Return a machine, and the covariance (30, 30) of its numbers, in the frame in which its base joints fit best.

    nominal (5, 3): the joints on which they are laid by a rigid motion, as no instrument saw the machine's frame. The
    covariance has no part in the six directions of rigid motions: the frame is defined, not measured.
    """
    motion = rigid_motion(built.base, nominal)
    base = motion.apply(built.base)
    # The best fit is where no rigid motion of the nominal joints has a part in what is left: the same for every fit.
    moves, defined = rigid_motions(base), rigid_motions(nominal)
    free = moves @ np.linalg.solve(defined.T @ moves, defined.T)
    of_base: Floats = (np.eye(len(free)) - free) @ np.kron(np.eye(len(base)), motion.rotation)
    places = np.array([k for k, name in enumerate(PARAMETERS) if name[-1] in "xyz"])
    change = np.eye(len(PARAMETERS))
    change[np.ix_(places, places)] = of_base
    moved = AsBuiltPentapod(base, built.offsets, built.radii, built.zeros, built.nominal)
    return moved, change @ covariance @ change.T


def rigid_motions(points: Floats) -> Floats:
    """Return how the coordinates of points change (3 N, 6) with shifts and turns about their middle."""
    arms = points - points.mean(axis=0)
    turns = np.asarray(np.cross(np.eye(3)[None], arms[:, None]), dtype=np.float64).swapaxes(1, 2).reshape(-1, 3)
    return np.hstack([np.tile(np.eye(3), (len(points), 1)), turns])
