"""How far a pose is from the singularities, in units a person can use (kinematics notes, section 4).

Singular ⇔ w = 0 or S = 0 (or the geometry itself is: `architectural_measure`). The locus depends on δ alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch
from pentapod.kinematics.batches import as_poses
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.forward.quadratic import w_and_s


def singularity_values(pentapod: LinearPentapod, position: ArrayLike, direction: ArrayLike) -> tuple[Floats, Floats]:
    """Return w (dimensionless) and S (metres), each (...), of poses (..., 3): zero on a singularity.

    w is the z component of the direction; S = δ w px − (δu − 1) pz. Their signs name the component.
    """
    p, i = as_poses(position, direction)
    w, s = np.broadcast_arrays(*w_and_s(p, i, pentapod.delta, pentapod.lever))
    return w.copy(), s.copy()


def position_distance(pentapod: LinearPentapod, position: ArrayLike, direction: ArrayLike) -> Floats:
    """Return how far (..., metres) a pose (..., 3) can shift in any direction, unturned, before S = 0.

    For a fixed direction S = 0 is a plane that contains the y direction: |S| / √(δ²w² + (1 − δu)²).
    """
    i = as_batch(direction, "direction", (3,))
    w, s = singularity_values(pentapod, position, i)
    slope = np.hypot(pentapod.delta * w, 1.0 - pentapod.delta * i[..., 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(slope == 0.0, 0.0, np.abs(s) / slope)


def singular_plane(
    pentapod: LinearPentapod, direction: ArrayLike, *, tool_length: float = 0.0
) -> tuple[Floats, Floats]:
    """Return the plane of positions with S = 0 for directions (..., 3): unit normals (..., 3), offsets (...) metres.

    n · x = offset for the tips x = p + tool_length · i (p itself by default); n points to where S > 0. The plane
    contains the y direction. Paper's (20) and (21), divided by w: with that factor, as printed, (20) holds for every
    position when w = 0. NaN for the direction u = 1/δ, w = 0, for which S = 0 wherever the platform is.
    """
    i = as_batch(direction, "direction", (3,))
    u, w = i[..., 0], i[..., 2]
    n1, n3 = pentapod.delta * w, 1.0 - pentapod.delta * u
    slope = np.hypot(n1, n3)
    slope = np.where(slope == 0.0, np.nan, slope)
    # n · p = −lever · w, and the tip lies n · i = δwu + (1 − δu)w = w tool lengths further along the normal.
    return np.stack([n1, np.zeros_like(n1), n3], axis=-1) / slope[..., None], (tool_length - pentapod.lever) * w / slope


def orientation_distance(
    pentapod: LinearPentapod, position: ArrayLike, direction: ArrayLike, *, about: float = 0.0
) -> Floats:
    """Return the angle (..., radians) by which the line can turn in any direction before w = 0 or S = 0.

    It turns about the point f = p + about · i, which stays: p itself by default, the tip with about = tool
    length (metres). position and direction (..., 3), unit. S = 0 is a cone of directions, N·i = −fz with
    N = (−δ fz, 0, δ fx + lever − about), which exists where |fz| ≤ |N|. Angles are taken by the arc tangent,
    which keeps its digits everywhere.
    """
    p, i = as_poses(position, direction)
    u, v, w = np.moveaxis(i, -1, 0)
    fixed = p + about * i
    fx, fz = fixed[..., 0], fixed[..., 2]
    # δ w fx + (1 − δu) fz + (lever − about) w = 0: the offsets counted from the fixed point are z_i − about.
    n1, n3 = -pentapod.delta * fz, pentapod.delta * fx + (pentapod.lever - about)
    to_equator = np.arctan2(np.abs(w), np.hypot(u, v))
    norm_squared = n1 * n1 + n3 * n3
    sine_squared = norm_squared - fz * fz
    across = np.sqrt((n3 * v) ** 2 + (n3 * u - n1 * w) ** 2 + (n1 * v) ** 2)
    to_cone = np.abs(np.arctan2(across, n1 * u + n3 * w) - np.arctan2(np.sqrt(np.maximum(sine_squared, 0.0)), -fz))
    to_cone = np.where(sine_squared < 0.0, np.inf, np.where(norm_squared == 0.0, 0.0, to_cone))
    return np.minimum(to_equator, to_cone)


def architectural_measure(pentapod: LinearPentapod) -> float:
    """Return how far the geometry is from being singular in every pose: `LinearPentapod.conditioning`."""
    return pentapod.conditioning
