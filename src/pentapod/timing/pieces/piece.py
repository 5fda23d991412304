"""The speed profile of one piece: TOPP-RA, checked between the gridpoints, refined until the limits hold there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.timing.jerk.options import USUAL, JerkOptions
from pentapod.timing.jerk.rows import JerkRows
from pentapod.timing.limits.limit import AccelerationRows, Motion, share_of_room
from pentapod.timing.limits.limits import Limits
from pentapod.timing.path.path import PathDerivatives, PieceLike
from pentapod.timing.pieces.grid import first_grid, parts
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.topp.engine import Engine, fastest
from pentapod.timing.topp.stages import STANDS_BEYOND, Failure

if TYPE_CHECKING:
    from pentapod.timing.jerk.limited import SmoothProfile
    from pentapod.timing.jerk.rows import Measure

_BETWEEN = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
_REFINEMENTS = 4
_SWITCHING_LOSS = 3e-4
"""Share of the duration that may be lost in stages too long to switch where the law should."""

_EASINGS = 3

_FREE_PERIODS = 1.0
"""Periods below which a law limited in jerk needs no freedom; stages between its gridpoints last no longer."""


@dataclass(frozen=True, eq=False)
class PieceProfile:
    """Squared speeds x (N + 1,) in m²/s² at stations s (N + 1,) in metres of a piece, linear in s between.

    ease_acceleration, ease_speed (N + 1,): factors ≤ 1 on the limits at each gridpoint, where a plan at full limits was
    measured to exceed them. x_start, x_end: x that is given at the ends, 0 at rests.
    """

    piece: PieceLike
    limits: Limits
    s: Floats
    x: Floats
    ease_acceleration: Floats
    ease_speed: Floats
    engine: Engine = "core"
    x_start: float = 0.0
    x_end: float = 0.0
    jerk_options: JerkOptions = USUAL

    @property
    def moving(self) -> bool:
        """Whether one of its ends is no rest."""
        return max(self.x_start, self.x_end) > 0.0

    @cached_property
    def derivatives(self) -> PathDerivatives:
        """How the piece moves at the gridpoints."""
        return PathDerivatives(self.piece, self.s)

    def rows(self) -> AccelerationRows:
        """Return the accelerations' rows (N + 1, R) at the gridpoints, eased."""
        return self.limits.rows(self.derivatives).over(self.ease_acceleration[:, None])

    def solved(self) -> PieceProfile | Failure:
        """Return the fastest profile on this grid with these easings."""
        x = self._fastest(self.s, self.rows(), self.ceiling())
        if not isinstance(x, Failure):
            return self.with_(x=x)
        names = self.limits.row_names(self.derivatives)
        limits = tuple(dict.fromkeys(names[row] for row in x.conflict))
        return replace(x, limits=limits, station=float(self.s[x.gridpoint]) if x.gridpoint >= 0 else None)

    def _fastest(self, s: Floats, rows: AccelerationRows, ceiling: Floats) -> Floats | Failure:
        resting = np.abs(rows.offset).max(axis=1)
        if (resting >= 1.0).any():
            k = int(resting.argmax())
            return Failure(k, f"{STANDS_BEYOND}: {resting[k]:.3g} times of it", (int(np.abs(rows.offset[k]).argmax()),))
        ends = {"x_start": self.x_start, "x_end": self.x_end}
        return fastest(s, rows.first, rows.second, ceiling, offset=rows.offset, **ends, engine=self.engine)

    def smooth(self, measure: Measure) -> SmoothProfile | Failure:
        """Return the fastest profile below this one that keeps the jerk limits too; measure: of its setpoints."""
        from pentapod.timing.jerk.limited import jerk_limited  # noqa: PLC0415  (compiled: loaded where it is used)

        s, x = self.s, self.x
        if self._capped.any():
            s = self._fine_grid()
            x = np.interp(s, self.s, self.x)
            found = [self._capped_rows(PathDerivatives(self.piece, s[part])) for part in parts(len(s) - 1)]
            first, second, offset, ceiling = (
                _overlapping(column)
                for column in zip(*((y.first, y.second, y.offset, top) for y, top in found), strict=True)
            )
            capped = self._fastest(s, AccelerationRows(first, second, offset), ceiling)
            x = x if isinstance(capped, Failure) else np.minimum(x, capped)
        least = _FREE_PERIODS * self.limits.period
        return jerk_limited(
            s, x, self._jerk_rows, self.piece.knots, least_step=least, measure=measure, options=self.jerk_options
        )

    def _fine_grid(self) -> Floats:
        """Return the gridpoints and more between them, so that no stage lasts longer than a period.

        The law below lower accelerations switches where this grid has no points for it.
        """
        ds, speed = np.diff(self.s), np.sqrt(self.x)
        longest = _FREE_PERIODS * self.limits.period
        if longest <= 0.0:
            return self.s
        counts = np.ceil(2.0 * ds / (speed[:-1] + speed[1:]) / longest).astype(np.intp)
        stage = np.repeat(np.arange(len(ds)), counts)
        within = np.arange(len(stage)) - np.repeat(np.cumsum(counts) - counts, counts)
        return np.append(self.s[stage] + ds[stage] * (within / counts[stage]), self.s[-1])

    @cached_property
    def _push_caps(self) -> Floats:
        """Shares (N + 1, R) of the rows' limits that no law within the jerk limits exceeds."""
        return self.limits.caps(self.derivatives, self._full_ceiling, moving=self.moving)

    @cached_property
    def _capped(self) -> Bools:
        """Which of the rows (R,) have such a share below 1 somewhere."""
        return np.asarray((self._push_caps < 1.0).any(axis=0))

    def _jerk_rows(self, s: Floats) -> JerkRows:
        path = PathDerivatives(self.piece, s, 3)
        rows, ceiling = self._capped_rows(path)
        return JerkRows(rows.first, rows.second, rows.offset, self.limits.jerk_rows(path), ceiling)

    def _capped_rows(self, path: PathDerivatives) -> tuple[AccelerationRows, Floats]:
        """Return the accelerations' rows (n, R), no looser than laws within the jerk limits can use, and ceilings."""
        acceleration, speed = (np.interp(path.s, self.s, ease) for ease in (self.ease_acceleration, self.ease_speed))
        shares = np.repeat(acceleration[:, None], len(self._capped), axis=1)
        for row in np.flatnonzero(self._capped):
            shares[:, row] *= np.interp(path.s, self.s, self._push_caps[:, row])
        return self.limits.rows(path).over(shares), self.limits.ceiling(path) * speed**2

    @cached_property
    def _full_ceiling(self) -> Floats:
        return self.limits.ceiling(self.derivatives)

    def ceiling(self) -> Floats:
        """Return the largest x (N + 1,) at each gridpoint that any path acceleration allows, m²/s²."""
        return self._full_ceiling * self.ease_speed**2

    def eased(self, acceleration: Floats, speed: Floats) -> PieceProfile | Failure:
        """Return the profile solved anew with further factors (N + 1,) on accelerations and speeds."""
        return self.with_(
            ease_acceleration=self.ease_acceleration * acceleration, ease_speed=self.ease_speed * speed
        ).solved()

    def with_(self, **changes: Any) -> PieceProfile:
        """Return a copy on the same grid, which keeps the path's derivatives."""
        copy = replace(self, **changes)
        for name in ("derivatives", "_full_ceiling"):
            if name in self.__dict__:
                copy.__dict__[name] = self.__dict__[name]
        return copy

    def refined(self, exceeding: Bools, switching: Bools, where: Floats) -> PieceProfile:
        """Return the problem on a finer grid.

        Exceeding stages (N,) get gridpoints where they were measured, switching ones are split at fractions `where`.
        """
        added = [self.s[:-1][switching] + (where * np.diff(self.s))[switching]]
        added += [(self.s[:-1] + between * np.diff(self.s))[exceeding] for between in _BETWEEN]
        s = np.unique(np.concatenate([self.s, *added]))
        x, acceleration, speed = (np.interp(s, self.s, y) for y in (self.x, self.ease_acceleration, self.ease_speed))
        return replace(self, s=s, x=x, ease_acceleration=acceleration, ease_speed=speed)

    def path_accelerations(self) -> Floats:
        """Return s̈ (N,) of each stage, m/s²."""
        return np.diff(self.x) / (2.0 * np.diff(self.s))

    def shares_between(self) -> tuple[Floats, Floats]:
        """Return the largest shares (N,) of velocities and feed, and of accelerations inside each stage."""
        found = [self._shares_between(part) for part in parts(len(self.s) - 1)]
        return np.concatenate([rates for rates, _ in found]), np.concatenate([pushes for _, pushes in found])

    def _shares_between(self, part: slice) -> tuple[Floats, Floats]:
        ds, dx = np.diff(self.s[part]), np.diff(self.x[part])
        s = (self.s[part][:-1, None] + _BETWEEN * ds[:, None]).ravel()
        x = (self.x[part][:-1, None] + _BETWEEN * dx[:, None]).ravel()
        path, motion = PathDerivatives(self.piece, s), Motion.of(x, np.repeat(dx / (2.0 * ds), len(_BETWEEN)))
        rates, pushes = (self.limits.largest(group, path, motion) for group in ("speed", "acceleration"))
        return rates.reshape(len(ds), -1).max(axis=1), pushes.reshape(len(ds), -1).max(axis=1)

    def switching(self) -> tuple[Bools, Floats]:
        """Return the stages (N,) within which the law should switch, and at which fraction (N,).

        In a stage of an optimal law either an acceleration is at its limit or the speed is at its ceiling at both ends.
        Where neither is, time is lost: at most what running at the faster end's speed would save. None are returned
        where that adds up to little. A stage that ends at the ceiling and uses the share r of the acceleration limit
        could get there within about the fraction r of its length.
        """
        u, ds = self.path_accelerations(), np.diff(self.s)
        rows = self.rows()
        offset = np.broadcast_to(rows.offset, rows.first.shape)
        ends = [
            share_of_room(rows.first[k] * u[:, None] + rows.second[k] * self.x[k][:, None], offset[k])
            for k in (slice(0, -1), slice(1, None))
        ]
        capped = self.x > 0.99 * self.ceiling()
        share = np.maximum(*ends).max(axis=1)
        idle = (share < 0.98) & ~(capped[:-1] & capped[1:])
        speed = np.sqrt(self.x)
        taken = 2.0 * ds / (speed[:-1] + speed[1:])
        loss = np.where(idle, taken - ds / np.maximum(speed[:-1], speed[1:]), 0.0)
        worth = loss > 0.1 * _SWITCHING_LOSS * taken.sum()
        # On a long grid solving again costs more than it finds: the ends are then a small part.
        if loss.sum() <= _SWITCHING_LOSS * taken.sum() * min(max(len(self.x) / 4000.0, 1.0), 6.0):
            worth[:] = False
        near = (capped[:-1] | capped[1:]) & (share > 1e-3) & (share < 0.6)
        where = np.where(near, np.where(u > 0.0, share, 1.0 - share), 0.5)
        return worth, where

    def active(self, law: MotionLaw | None = None) -> tuple[Ints, Floats]:
        """Return the constraint (N + 1,) that holds each gridpoint back most, and its share of the limit.

        law: the law limited in jerk below this profile, where there is one; what holds it back is then told.
        """
        if law is not None:
            return self._active_in(law)
        u = self.path_accelerations()
        before, after = (
            self.limits.shares(self.derivatives, Motion.of(self.x, pushes))
            for pushes in (np.append(u[0], u), np.append(u, u[-1]))
        )
        shares = np.maximum(before, after)
        return shares.argmax(axis=1), shares.max(axis=1)

    def _active_in(self, law: MotionLaw) -> tuple[Ints, Floats]:
        """Return the constraint (N + 1,) of which a law limited in jerk uses most, and its share."""
        t = np.interp(self.s, law.stations, law.times)
        j = law.jerks[np.clip(np.searchsorted(law.times, t, "right") - 1, 0, len(law.jerks) - 1)]
        v, a = law(t, 1), law(t, 2)
        shares = self.limits.shares(PathDerivatives(self.piece, self.s, 3), Motion(v**2, v, a, j))
        return shares.argmax(axis=1), shares.max(axis=1)


def time_piece(
    piece: PieceLike,
    limits: Limits,
    velocity_slack: float,
    acceleration_slack: float,
    engine: Engine = "core",
    speeds: tuple[float, float] = (0.0, 0.0),
    jerk_options: JerkOptions = USUAL,
) -> PieceProfile | Failure:
    """Return the fastest profile of a piece that keeps the limits between gridpoints as well.

    The slacks are the shares above 1 that are let pass, part of the margins. Stages that exceed them are
    halved, those that still do are eased; what is left after that is run slower as a whole. speeds: m/s, at the start
    and at the end.
    """
    s = first_grid(piece, limits)
    zero, one, ends = np.zeros_like(s), np.ones_like(s), (speeds[0] ** 2, speeds[1] ** 2)
    problem = PieceProfile(piece, limits, s, zero, one, one, engine, *ends, jerk_options)
    profile = problem.solved()
    for attempt in range(_REFINEMENTS + _EASINGS):
        if isinstance(profile, Failure):
            return profile
        rates, accelerations = profile.shares_between()
        fast, hard = rates > 1.0 + velocity_slack, accelerations > 1.0 + acceleration_slack
        if attempt < _REFINEMENTS:
            switching, where = profile.switching()
            if not (fast | hard | switching).any():
                return profile
            profile = profile.refined(fast | hard, switching & ~(fast | hard), where).solved()
        elif not (fast | hard).any():
            return profile
        else:
            profile = profile.eased(_at_ends(accelerations, hard), _at_ends(rates, fast))
    return profile if isinstance(profile, Failure) else _slowed(profile)


def _overlapping(parts: tuple[Floats, ...]) -> Floats:
    """Return the rows of parts of which each ends with the row with which the next begins; one row for all stays."""
    return parts[0] if len(parts[0]) == 1 else np.concatenate([*(part[:-1] for part in parts), parts[-1][-1:]])


def _at_ends(shares: Floats, bad: Bools) -> Floats:
    """Return factors (N + 1,) for the gridpoints of the bad stages (N,)."""
    factor = np.where(bad, 0.998 / shares, 1.0)
    return np.minimum(np.append(factor, 1.0), np.append(1.0, factor))


def _slowed(profile: PieceProfile) -> PieceProfile | Failure:
    rates, accelerations = profile.shares_between()
    slower = max(1.0, float(rates.max()) ** 2, float(accelerations.max()))
    if slower > 1.0 and profile.moving:
        return Failure(-1, "the limits do not hold between the gridpoints with the speeds that are given at the ends")
    return profile.with_(x=profile.x / slower)
