"""Which cell a pose lies in, and poses that lie in a given cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import ArrayError
from pentapod.kinematics.batches import joined_poses
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.theory.cells import cell_decomposition


def cell_of(pentapod: LinearPentapod, position: ArrayLike, direction: ArrayLike, *, tolerance: float = 1e-12) -> Ints:
    """Return the index (...) in `cell_decomposition(delta).cells` of the cell of each pose (..., 3); −1 for NaN.

    A pose counts as lying on w = 0 or δu = 1 when w or 1 − δu is within `tolerance` of 0, and on pz = 0, px = 0 or
    S = 0 when a shift by `tolerance` times its distance from leg 3's base joint (or the size of the base) takes it
    there.
    """
    p, i = joined_poses(position, direction)
    reduced = p + pentapod.offsets[2] * i
    reduced[..., :2] -= pentapod.base[2]
    u, w = i[..., 0], i[..., 2]
    x, z = reduced[..., 0], reduced[..., 2]
    size = np.maximum(np.linalg.norm(reduced, axis=-1), np.abs(pentapod.base - pentapod.base[2]).max())
    tilt = 1.0 - pentapod.delta * u
    near = tolerance * size
    s = (pentapod.delta * w * x + tilt * z) / np.hypot(pentapod.delta * w, tilt).clip(min=1e-300)
    signs = np.stack(
        [_sign(w, tolerance), _sign(s, near), _sign(z, near), _sign(x, near), _sign(tilt, tolerance)], axis=-1
    )
    # On w = 0 the sign of S is that of T pz; where S = 0 and pz = 0 but w ≠ 0, px = 0 whatever rounding says.
    flat = signs[..., 0] == 0
    signs[..., 1] = np.where(flat, signs[..., 4] * signs[..., 2], signs[..., 1])
    axis = ~flat & (signs[..., 1] == 0) & (signs[..., 2] == 0)
    signs[..., 3] = np.where(axis, 0, signs[..., 3])
    index = np.full(signs.shape[:-1], -1, dtype=np.intp)
    for k, cell in enumerate(cell_decomposition(pentapod.delta).cells):
        asked = [column for column, sign in enumerate(cell.signs) if sign is not None]
        wanted = np.array([cell.signs[column] for column in asked])
        # The last one that fits: a pose on the y axis has w ≠ 0, S = 0 too.
        index = np.where((signs[..., asked] == wanted).all(axis=-1), k, index)
    known = np.isfinite(p).all(axis=-1) & np.isfinite(i).all(axis=-1)
    return np.where(known, index, -1)


def poses_in_cell(pentapod: LinearPentapod, cell: int, count: int, *, seed: int = 0) -> tuple[Floats, Floats]:
    """Return random positions and directions (count, 3), machine frame, of poses in one cell.

    cell: its index in `cell_decomposition(delta).cells`. Positions are drawn on the scale of the base. Raises
    ArrayError for an index out of range.
    """
    cells = cell_decomposition(pentapod.delta).cells
    if not 0 <= cell < len(cells):
        raise ArrayError("no such cell", value=cell, expected=f"0 … {len(cells) - 1}")
    sign_w, sign_s, sign_z, sign_x, sign_t = cells[cell].signs
    rng = np.random.default_rng(seed)
    size = float(np.abs(pentapod.base - pentapod.base[2]).max())
    kappa = 1.0 / pentapod.delta
    position = size * rng.normal(size=(count, 3))
    for column, sign in ((2, sign_z), (0, sign_x)):
        if sign is not None:
            position[:, column] = sign * np.abs(position[:, column])
    if sign_w == 0:
        steep = abs(pentapod.delta)  # δu lies between −|δ| and |δ|
        low, high = {0: (1.0, 1.0), -1: (1.0, steep), 1: (-steep, min(1.0, steep))}[1 if sign_t is None else sign_t]
        u = np.clip(kappa * rng.uniform(low, high, size=count), -1.0, 1.0)
        v = np.sqrt(1.0 - u * u) * rng.choice((-1.0, 1.0), size=count)
        direction = np.stack([u, v, np.zeros(count)], axis=1)
    else:
        direction = rng.normal(size=(count, 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        direction[:, 2] = (sign_w or 1) * np.abs(direction[:, 2])
        if sign_s is not None:
            height = sign_s * size * np.abs(rng.normal(size=count))
            tilt = 1.0 - pentapod.delta * direction[:, 0]
            position[:, 0] = kappa * (height - tilt * position[:, 2]) / direction[:, 2]
    position[:, :2] += pentapod.base[2]
    return position - pentapod.offsets[2] * direction, direction


def _sign(values: Floats, near: Floats | float) -> Ints:
    return np.where(np.abs(values) <= near, 0, np.sign(np.nan_to_num(values))).astype(np.intp)
