"""Path tracking of a general linear pentapod along leg lengths, through poses where w or pz vanishes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, as_batch
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.kinematics.families.general import GeneralPentapod


@dataclass(frozen=True)
class TrackingOptions:
    """When two neighbouring rows are near enough to tell a pose from its mirror image.

    near: angle by which (pz/l_3, w) may turn between them, radians; mirror images are π apart. halvings: how often an
    interval is halved at most.
    """

    near: float = 0.25 * np.pi
    halvings: int = 30


OPTIONS = TrackingOptions()


@dataclass(frozen=True, eq=False)
class FollowedPath(Value):
    """Positions and directions (N, 3) along a path. lost_at: the first row that could not be reached, or None.

    Rows from lost_at on are NaN: there the legs have no pose, or the motion comes so near a singularity that the
    mirror images cannot be told apart any more.
    """

    position: Floats
    direction: Floats
    lost_at: int | None


def follow(pentapod: GeneralPentapod, legs: ArrayLike, position: ArrayLike, direction: ArrayLike) -> FollowedPath:
    """Return the poses along leg lengths (N, 5), metres, that continue the pose (3,), (3,) of the first row.

    The legs move linearly between rows. The order of the root is kept, as it is by every motion that meets no
    singularity; of the two mirror images (pz, w) and (−pz, −w) the one that continues the row before is taken:
    intervals in which (pz/l_3, w) turns too far to decide are halved. So w may change its sign, and
    the `Mode`'s image with it. Raises ArrayError: wrong shapes, a first pose whose legs are not those of the first row.
    """
    rows = as_batch(legs, "legs", (None, 5))
    p, i = as_batch(position, "position", (3,)), as_batch(direction, "direction", (3,))
    for value, name, axes in ((rows, "legs", 2), (p, "position", 1), (i, "direction", 1)):
        if value.ndim != axes or not value.size:
            raise ArrayError(f"{name} has shape {value.shape}", expected="legs (N, 5) and one pose, (3,) and (3,)")
    error = float(np.abs(pentapod.leg_lengths(p, i) - rows[0]).max())
    if not error <= 1e-6 * float(rows[0].max()):
        raise ArrayError("the pose does not have the legs of the first row", value=error, expected="no difference")
    order = int(pentapod.branch(p, i)[0])
    rows, given_row = _refined(pentapod, rows, order)
    q, j = pentapod.pose(rows, (order, 1))
    angles = _angles(pentapod, rows, q, j)
    keep, sure = _continued(angles)
    start = np.cos(angles[0] - _angles(pentapod, rows[:1], p[None], i[None])[0])
    image = np.where(start < 0.0, -1.0, 1.0) * np.concatenate([[1.0], np.cumprod(np.where(keep, 1.0, -1.0))])
    lost = np.flatnonzero(~sure)
    alive = np.arange(len(rows)) <= (lost[0] if len(lost) else len(rows))
    if np.isnan(angles[0]):
        alive[:] = False
    flip = np.stack([np.ones_like(image), np.ones_like(image), image], axis=-1)
    found = np.where(alive[:, None], q * flip, np.nan)[given_row], np.where(alive[:, None], j * flip, np.nan)[given_row]
    gone = np.flatnonzero(np.isnan(found[0][:, 0]))
    return FollowedPath(*found, lost_at=int(gone[0]) if len(gone) else None)


def _angles(pentapod: GeneralPentapod, rows: Floats, position: Floats, direction: Floats) -> Floats:
    """Return the angle (N,) of (pz/l_3, w), pz that of leg 3's platform joint; NaN where there is no pose."""
    w = direction[:, 2]
    return np.arctan2(w * rows[:, 2], position[:, 2] + pentapod.offsets[2] * w)


def _continued(angles: Floats) -> tuple[Bools, Bools]:
    """Return (N − 1,): whether the next angle, not its mirror image, continues this one; and if that is sure."""
    cosine = np.cos(np.diff(angles))
    return cosine >= 0.0, np.abs(cosine) >= np.cos(OPTIONS.near)


def _refined(pentapod: GeneralPentapod, rows: Floats, order: int) -> tuple[Floats, np.ndarray]:
    """Return rows with as many more between them as it takes to be sure of each; and where the given ones are."""
    at = np.arange(len(rows), dtype=np.float64)
    every, stations = rows, at
    for _ in range(OPTIONS.halvings):
        angles = _angles(pentapod, every, *pentapod.pose(every, (order, 1)))
        unsure = np.flatnonzero(~_continued(angles)[1] & np.isfinite(angles[:-1]) & np.isfinite(angles[1:]))
        if not len(unsure):
            break
        middle = 0.5 * (stations[unsure] + stations[unsure + 1])
        stations = np.insert(stations, unsure + 1, middle)
        whole = np.minimum(stations.astype(np.intp), max(len(rows) - 2, 0))
        part = (stations - whole)[:, None]
        every = (1.0 - part) * rows[whole] + part * rows[np.minimum(whole + 1, len(rows) - 1)]
    return every, np.searchsorted(stations, at)
