"""Speed profile of one piece between two exact stops: ṡ² at gridpoints, and the shares of the limits that it uses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, row_maxima
from pentapod.timing.limits.limit import AccelerationRows, Motion
from pentapod.timing.limits.limits import Limits
from pentapod.timing.path.path import PathDerivatives, PieceLike
from pentapod.timing.pieces.grid import parts
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.topp.engine import Engine, fastest
from pentapod.timing.topp.stages import STANDS_BEYOND, Failure

INSIDE_STAGES = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
"""Fractions of a stage at which limits are checked inside it."""


@dataclass(frozen=True, eq=False)
class PieceProfile:
    """Squared speeds x (N + 1,) in m²/s² at stations s (N + 1,) in metres of a piece, linear in s between.

    acceleration_scale, speed_scale (N + 1,): factors ≤ 1 on the limits at each gridpoint, where a law at full limits
    was measured to exceed them. x_start, x_end: x that is given at the ends, 0 at rests.
    """

    piece: PieceLike
    limits: Limits
    s: Floats
    x: Floats
    acceleration_scale: Floats
    speed_scale: Floats
    engine: Engine = "core"
    x_start: float = 0.0
    x_end: float = 0.0

    @property
    def moving(self) -> bool:
        """Whether a speed is given at one of its ends."""
        return max(self.x_start, self.x_end) > 0.0

    @cached_property
    def derivatives(self) -> PathDerivatives:
        """Derivatives of the path at the gridpoints."""
        return PathDerivatives(self.piece, self.s)

    @cached_property
    def full_ceiling(self) -> Floats:
        """Largest x (N + 1,) at each gridpoint within the unscaled limits, m²/s²."""
        return self.limits.ceiling(self.derivatives)

    def ceiling(self) -> Floats:
        """Return the largest x (N + 1,) at each gridpoint that any path acceleration allows, m²/s²."""
        return self.full_ceiling * self.speed_scale**2

    def ceiling_inside(self, stages: Bools) -> Floats:
        """Return the largest x in the middle of some stages (N,)."""
        k = np.flatnonzero(stages)
        path = PathDerivatives(self.piece, (self.s[k] + self.s[k + 1]) / 2.0)
        return self.limits.ceiling(path) * np.minimum(self.speed_scale[k], self.speed_scale[k + 1]) ** 2

    def rows(self) -> AccelerationRows:
        """Return the scaled rows (N + 1, R) of the accelerations at the gridpoints."""
        return self.limits.rows(self.derivatives).over(self.acceleration_scale[:, None])

    def solved(self) -> PieceProfile | Failure:
        """Return the fastest profile on this grid with these scales."""
        x = self.fastest(self.s, self.rows(), self.ceiling())
        if not isinstance(x, Failure):
            return self.with_(x=x)
        names = self.limits.row_names(self.derivatives)
        limits = tuple(dict.fromkeys(names[row] for row in x.conflict))
        if x.reason == STANDS_BEYOND:
            told = self.limits.at_rest(self.derivatives, x.gridpoint, x.conflict[0])
            x = replace(x, reason=f"{STANDS_BEYOND}: {told}")
        return replace(x, limits=limits, station=float(self.s[x.gridpoint]) if x.gridpoint >= 0 else None)

    def fastest(self, s: Floats, rows: AccelerationRows, ceiling: Floats) -> Floats | Failure:
        """Return the largest x (n,) at stations s (n,) with these rows and ceilings, and the profile's end speeds."""
        at_rest = np.abs(rows.offset).max(axis=1)
        if (at_rest >= 1.0).any():
            k = int(at_rest.argmax())
            return Failure(k, STANDS_BEYOND, (int(np.abs(rows.offset[k]).argmax()),))
        ends = {"x_start": self.x_start, "x_end": self.x_end}
        return fastest(s, rows.first, rows.second, ceiling, offset=rows.offset, **ends, engine=self.engine)

    def rescaled(self, acceleration: Floats, speed: Floats) -> PieceProfile | Failure:
        """Return the profile solved again with further factors (N + 1,) on the limits."""
        scales = {
            "acceleration_scale": self.acceleration_scale * acceleration,
            "speed_scale": self.speed_scale * speed,
        }
        return self.with_(**scales).solved()

    def with_(self, **changes: Any) -> PieceProfile:
        """Return a copy on the same grid, which keeps the path's derivatives."""
        copy = replace(self, **changes)
        for name in ("derivatives", "full_ceiling"):
            if name in self.__dict__:
                copy.__dict__[name] = self.__dict__[name]
        return copy

    def path_accelerations(self) -> Floats:
        """Return s̈ (N,) of each stage, m/s²."""
        return np.diff(self.x) / (2.0 * np.diff(self.s))

    def shares_inside(self) -> tuple[Floats, Floats]:
        """Return the largest shares (N,) of the limits of speed, and of acceleration, inside each stage."""
        found = [self._shares_inside(part) for part in parts(len(self.s) - 1)]
        return np.concatenate([speeds for speeds, _ in found]), np.concatenate([pushes for _, pushes in found])

    def _shares_inside(self, part: slice) -> tuple[Floats, Floats]:
        ds, dx = np.diff(self.s[part]), np.diff(self.x[part])
        s = (self.s[part][:-1, None] + INSIDE_STAGES * ds[:, None]).ravel()
        x = (self.x[part][:-1, None] + INSIDE_STAGES * dx[:, None]).ravel()
        path, motion = PathDerivatives(self.piece, s), Motion.of(x, np.repeat(dx / (2.0 * ds), len(INSIDE_STAGES)))
        speeds, pushes = (self.limits.largest(group, path, motion) for group in ("speed", "acceleration"))
        return speeds.reshape(len(ds), -1).max(axis=1), pushes.reshape(len(ds), -1).max(axis=1)

    def active(self, law: MotionLaw | None = None) -> tuple[Ints, Floats]:
        """Return the constraint (N + 1,) with the largest share at each gridpoint, and this share.

        law: the jerk-limited law below this profile, where there is one; the shares are then those of this law.
        """
        if law is None:
            u = self.path_accelerations()
            before, after = (
                self.limits.shares(self.derivatives, Motion.of(self.x, pushes))
                for pushes in (np.append(u[0], u), np.append(u, u[-1]))
            )
            shares = np.maximum(before, after)
        else:
            t = np.interp(self.s, law.stations, law.times)
            j = law.jerks[np.clip(np.searchsorted(law.times, t, "right") - 1, 0, len(law.jerks) - 1)]
            v, a = law(t, 1), law(t, 2)
            shares = self.limits.shares(PathDerivatives(self.piece, self.s, 3), Motion(v**2, v, a, j))
        return shares.argmax(axis=1), row_maxima(shares)
