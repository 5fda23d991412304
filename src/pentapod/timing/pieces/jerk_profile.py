"""Jerk-limited profile of a piece: caps on the accelerations that jerk limits leave usable, then the jerk passes."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.threads import in_threads
from pentapod.timing.jerk.jerk_limited import JerkProblem, JerkProfile, jerk_limited
from pentapod.timing.jerk.options import JerkOptions
from pentapod.timing.jerk.rows import JerkRows, MeasureExcess
from pentapod.timing.limits.limit import AccelerationRows
from pentapod.timing.path.path import PathDerivatives
from pentapod.timing.pieces.grid import parts, subdivided
from pentapod.timing.pieces.piece import PieceProfile
from pentapod.timing.topp.stages import Failure


def jerk_limited_profile(profile: PieceProfile, measure: MeasureExcess, options: JerkOptions) -> JerkProfile | Failure:
    """Return the fastest profile below a piece's that keeps the jerk limits too; measure: of its setpoints."""
    limits = profile.limits
    caps = limits.caps(profile.derivatives, profile.full_ceiling, moving=profile.moving)
    capped = np.flatnonzero((caps < 1.0).any(axis=0))

    def capped_rows(path: PathDerivatives) -> tuple[AccelerationRows, Floats]:
        """Return rows (n, R) no looser than laws within the jerk limits can use, and ceilings (n,)."""
        scales = (profile.acceleration_scale, profile.speed_scale)
        acceleration, speed = (np.interp(path.s, profile.s, scale) for scale in scales)
        shares = np.repeat(acceleration[:, None], caps.shape[1], axis=1)
        for row in capped:
            shares[:, row] *= np.interp(path.s, profile.s, caps[:, row])
        return limits.rows(path).over(shares), limits.ceiling(path) * speed**2

    def rows_at(s: Floats) -> JerkRows:
        path = PathDerivatives(profile.piece, s, 3)
        rows, ceiling = capped_rows(path)
        return JerkRows(rows.first, rows.second, rows.offset, limits.jerk_rows(path), ceiling)

    s, x = profile.s, profile.x
    if len(capped):
        s = _fine_grid(profile)
        x = np.interp(s, profile.s, profile.x)
        found = in_threads(lambda part: capped_rows(PathDerivatives(profile.piece, s[part])), parts(len(s) - 1))
        first, second, offset, ceiling = (
            _overlapping(column)
            for column in zip(*((y.first, y.second, y.offset, top) for y, top in found), strict=True)
        )
        below = profile.fastest(s, AccelerationRows(first, second, offset), ceiling)
        x = x if isinstance(below, Failure) else np.minimum(x, below)
    return jerk_limited(JerkProblem(s, x, rows_at, profile.piece.knots, options, limits.period, measure))


def _fine_grid(profile: PieceProfile) -> Floats:
    """Return the gridpoints and more between them, so that no stage lasts longer than a period of the controller.

    With capped accelerations the law switches where the profile's own grid has no points for it.
    """
    speed, period = np.sqrt(profile.x), profile.limits.period
    if period <= 0.0:
        return profile.s
    counts = np.ceil(2.0 * np.diff(profile.s) / (speed[:-1] + speed[1:]) / period).astype(np.intp)
    return subdivided(profile.s, counts)


def _overlapping(columns: tuple[Floats, ...]) -> Floats:
    """Return the rows of parts, each of which ends with the next one's first row; one row for all stays one."""
    return columns[0] if len(columns[0]) == 1 else np.concatenate([*(y[:-1] for y in columns), columns[-1][-1:]])
