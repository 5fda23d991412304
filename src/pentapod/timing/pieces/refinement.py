"""Refinement of a piece's speed profile until limits hold between gridpoints too and little time is lost there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Bools, Floats, row_maxima
from pentapod.timing.limits.limit import AccelerationRows, share_of_room
from pentapod.timing.limits.limits import Limits
from pentapod.timing.path.path import PieceLike
from pentapod.timing.pieces.grid import first_grid
from pentapod.timing.pieces.piece import INSIDE_STAGES, PieceProfile
from pentapod.timing.topp.engine import Engine
from pentapod.timing.topp.stages import Failure


@dataclass(frozen=True)
class RefinementOptions:
    """Refinement of a speed profile."""

    refinements: int = 4  # how often the grid is refined where limits are exceeded or the law should switch
    rescalings: int = 3  # how often limits are lowered after that, where they are still exceeded
    room: float = 0.998  # share of a limit that is aimed at there
    switching_loss: float = 3e-4  # share of the duration that may be lost in stages within which the law should switch
    stage_loss: float = 2e-3  # seconds above which a single stage is divided however little that is of the duration
    long_grid: float = 4000.0  # gridpoints above which more may be lost: solving again costs more than it finds
    most_loss: float = 6.0  # largest factor on that share


DEFAULTS = RefinementOptions()


def time_piece(
    piece: PieceLike,
    limits: Limits,
    velocity_slack: float,
    acceleration_slack: float,
    engine: Engine = "core",
    speeds: tuple[float, float] = (0.0, 0.0),
    options: RefinementOptions = DEFAULTS,
) -> PieceProfile | Failure:
    """Return the fastest profile of a piece that keeps the limits between gridpoints as well.

    The slacks are the shares above 1 that are accepted, part of the margins. Stages that exceed them are divided; where
    they still do, limits are lowered; what is left after that is run slower as a whole. speeds: m/s, at the start and
    at the end.
    """
    s = first_grid(piece, limits)
    zero, one, ends = np.zeros_like(s), np.ones_like(s), (speeds[0] ** 2, speeds[1] ** 2)
    profile = PieceProfile(piece, limits, s, zero, one, one, engine, *ends).solved()
    for attempt in range(options.refinements + options.rescalings):
        if isinstance(profile, Failure):
            return profile
        rates, accelerations = profile.shares_inside()
        fast, hard = rates > 1.0 + velocity_slack, accelerations > 1.0 + acceleration_slack
        if attempt < options.refinements:
            switching, where = _switching(profile, options)
            if not (fast | hard | switching).any():
                return profile
            profile = _refined(profile, fast | hard, switching & ~(fast | hard), where).solved()
        elif not (fast | hard).any():
            return profile
        else:
            profile = profile.rescaled(_at_ends(accelerations, hard, options.room), _at_ends(rates, fast, options.room))
    return profile if isinstance(profile, Failure) else _slowed(profile)


def _refined(profile: PieceProfile, exceeding: Bools, switching: Bools, where: Floats) -> PieceProfile:
    """Return the problem with exceeding stages (N,) divided where checked, switching ones at fractions `where`."""
    steps = np.diff(profile.s)
    added = [profile.s[:-1][switching] + (where * steps)[switching]]
    added += [(profile.s[:-1] + fraction * steps)[exceeding] for fraction in INSIDE_STAGES]
    s = np.unique(np.concatenate([profile.s, *added]))
    columns = profile.x, profile.acceleration_scale, profile.speed_scale
    x, acceleration, speed = (np.interp(s, profile.s, column) for column in columns)
    return replace(profile, s=s, x=x, acceleration_scale=acceleration, speed_scale=speed)


def _switching(profile: PieceProfile, options: RefinementOptions) -> tuple[Bools, Floats]:
    """Return the stages (N,) within which the law should switch, and at which fraction (N,).

    In a stage of an optimal law either an acceleration is at its limit or the speed is at its ceiling. Where neither
    is, time is lost: at most what running as fast as the ceiling, or a push up and one down, allow would save. None are
    returned where that adds up to little, but those that lose as long as a slower feed is seen. A stage that ends at
    the ceiling and uses the share r of the acceleration limit could get there within about the fraction r of its
    length.
    """
    u, ds, x, rows = profile.path_accelerations(), np.diff(profile.s), profile.x, profile.rows()
    offset = np.broadcast_to(rows.offset, rows.first.shape)
    ends = [
        share_of_room(rows.first[k] * u[:, None] + rows.second[k] * x[k][:, None], offset[k])
        for k in (slice(0, -1), slice(1, None))
    ]
    capped = x > 0.99 * profile.ceiling()
    share = row_maxima(np.maximum(*ends))
    idle = share < 0.98
    top = np.maximum(x[:-1], x[1:])
    top[idle] = np.maximum(top[idle], np.minimum(profile.ceiling_inside(idle), _peak(profile, rows, idle)))
    speed = np.sqrt(x)
    seconds = 2.0 * ds / (speed[:-1] + speed[1:])
    loss = np.where(idle, seconds - ds / np.sqrt(top), 0.0)
    allowed = options.switching_loss * seconds.sum()
    worth = loss > 0.1 * options.switching_loss * seconds.sum()
    if loss.sum() <= allowed * min(max(len(x) / options.long_grid, 1.0), options.most_loss):
        worth = loss > options.stage_loss
    near = (capped[:-1] ^ capped[1:]) & (share > 1e-3) & (share < 0.6)
    return worth, np.where(near, np.where(u > 0.0, share, 1.0 - share), 0.5)


def _peak(profile: PieceProfile, rows: AccelerationRows, which: Bools) -> Floats:
    """Return the largest x in stages, by a push from their start on and one back to their end."""
    x, k = profile.x, np.flatnonzero(which)
    room = 1.0 - np.abs(rows.second[k] * x[k][:, None] + (rows.offset if len(rows.offset) == 1 else rows.offset[k]))
    with np.errstate(divide="ignore", invalid="ignore"):
        push = np.nan_to_num(np.maximum(room, 0.0) / np.abs(rows.first[k]), nan=np.inf, posinf=np.inf).min(axis=1)
    return (x[k] + x[k + 1]) / 2.0 + push * (profile.s[k + 1] - profile.s[k])


def _at_ends(shares: Floats, bad: Bools, room: float) -> Floats:
    """Return factors (N + 1,) for the gridpoints at the ends of bad stages (N,)."""
    factor = np.where(bad, room / shares, 1.0)
    return np.minimum(np.append(factor, 1.0), np.append(1.0, factor))


def _slowed(profile: PieceProfile) -> PieceProfile | Failure:
    """Return the profile run slower as a whole, so that it keeps the limits."""
    rates, accelerations = profile.shares_inside()
    slower = max(1.0, float(rates.max()) ** 2, float(accelerations.max()))
    if slower > 1.0 and profile.moving:
        return Failure(-1, "the limits do not hold between the gridpoints with the speeds that are given at the ends")
    return profile.with_(x=profile.x / slower)
