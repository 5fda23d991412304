"""Forward kinematics of constrained platforms: Newton's method on the wrenches of legs and passive joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.forces import held_wrenches
from pentapod.numerics.blocks import blocks


@dataclass(frozen=True)
class NewtonOptions:
    """steps: at most. settled: metres, largest error of a leg that ends it. shift, turn: longest step, m and rad.

    apart: rows between those that are solved from home; the others begin between their neighbours. starts: random poses
    from which all modes are looked for; spread: of these, metres and of directions; same: difference of poses
    that count as one, metres.
    """

    steps: int = 40
    settled: float = 2e-13
    shift: float = 0.1
    turn: float = 0.3
    apart: int = 64
    starts: int = 400
    same: float = 1e-6
    spread: tuple[float, float] = (0.6, 1.5)


OPTIONS = NewtonOptions()


def continued_poses(robot: Any, legs: Floats, signs: Floats) -> tuple[Floats, Floats]:
    """Return positions and directions (N, 3) of legs (N, 5) in branches (N, 2); NaN where there are none.

    Poses are those to which Newton's method leads from home, or from between the poses of rows before and after, which
    are those of a motion. In branches other than that of home there are none; `all_poses` looks for them.
    """
    up = np.array([0.0, 0.0, 1.0])
    home = robot.branch(robot.home, up)
    p, i = np.full((2, len(legs), 3), np.nan)
    usual = np.isfinite(legs).all(axis=1) & (signs == home).all(axis=1)
    rows = np.flatnonzero(usual)
    if len(rows):
        p[rows], i[rows] = _along(robot, legs[rows], up)
    with np.errstate(invalid="ignore"):
        wrong = ~(robot.branch(p, i) == signs).all(axis=1)
    p[wrong] = i[wrong] = np.nan
    return p, i


def all_poses(robot: Any, legs: Floats, seed: int = 0) -> tuple[Floats, Floats]:
    """Return the different poses (K, 3) of legs (5,) that Newton's method finds from home and from random starts.

    The one that continues home is first, where there is one. That these are all is not proven.
    """
    rng, (far, lean), count, up = np.random.default_rng(seed), OPTIONS.spread, OPTIONS.starts, np.array([0.0, 0.0, 1.0])
    p = robot.home * rng.choice([-1.0, 1.0], (count, 1)) ** [0, 0, 1] + far * rng.uniform(-1.0, 1.0, (count, 3))
    i = _unit(rng.choice([-1.0, 1.0], (count, 1)) * up + lean * rng.normal(size=(count, 3)))
    own = continued_poses(robot, legs[None], robot.branch(robot.home, up)[None])
    p, i, settled = refined(robot, np.broadcast_to(legs, (count, 5)), p, i)
    known = bool(np.isfinite(own[0]).all())
    p, i = np.concatenate([own[0][:known], p[settled]]), np.concatenate([own[1][:known], i[settled]])
    poses = np.column_stack([p, i])
    same = np.abs(poses[:, None] - poses).max(axis=2) < OPTIONS.same
    first = ~np.tril(same, -1).any(axis=1)
    return p[first], i[first]


def _along(robot: Any, legs: Floats, up: Floats) -> tuple[Floats, Floats]:
    """Return the poses (N, 3) of rows (N, 5) of a motion, or of any legs; NaN where none is found."""
    count = len(legs)
    nodes = np.unique(np.append(np.arange(0, count, OPTIONS.apart), count - 1))
    p, i = np.empty((2, count, 3))
    at_p, at_i, known = _from_home(robot, legs[nodes], up)
    if len(nodes) == count:
        return np.where(known[:, None], at_p, np.nan), np.where(known[:, None], at_i, np.nan)
    places = np.arange(count)
    for k in range(3):
        p[:, k], i[:, k] = np.interp(places, nodes, at_p[:, k]), np.interp(places, nodes, at_i[:, k])
    p, i, settled = refined(robot, legs, p, _unit(i))
    lost = np.flatnonzero(~settled)
    if len(lost):
        p[lost], i[lost], settled[lost] = _from_home(robot, legs[lost], up)
    return np.where(settled[:, None], p, np.nan), np.where(settled[:, None], i, np.nan)


def _from_home(robot: Any, legs: Floats, up: Floats) -> tuple[Floats, Floats, Bools]:
    return refined(robot, legs, np.tile(robot.home, (len(legs), 1)), np.tile(up, (len(legs), 1)))


def refined(robot: Any, legs: Floats, position: Floats, direction: Floats) -> tuple[Floats, Floats, Bools]:
    """Return poses (N, 3) of legs (N, 5) from nearby ones by Newton's method, and where it has settled (N,)."""
    p, i, settled = position.copy(), direction.copy(), np.zeros(len(legs), dtype=np.bool_)
    for block in blocks(len(legs), 4096):
        rows = np.arange(block.start, block.stop)
        with np.errstate(all="ignore"):
            for _ in range(OPTIONS.steps):
                error = legs[rows] - robot.leg_lengths(p[rows], i[rows])
                worst = np.abs(error).max(axis=1)
                done = worst < OPTIONS.settled * np.maximum(1.0, np.abs(legs[rows]).max(axis=1))
                settled[rows[done]] = True
                rows, error = rows[~done & np.isfinite(worst)], error[~done & np.isfinite(worst)]
                if not len(rows):
                    break
                step = _steps(held_wrenches(robot, p[rows], i[rows]), error)
                shift, turn = step[:, :3], step[:, 3:]
                longest = np.maximum(
                    np.linalg.norm(shift, axis=1) / OPTIONS.shift, np.linalg.norm(turn, axis=1) / OPTIONS.turn
                )
                share = (1.0 / np.maximum(longest, 1.0))[:, None]
                p[rows] += share * shift
                i[rows] = _unit(i[rows] + share * np.cross(turn, i[rows]))
    return p, i, settled


def _steps(wrenches: Floats, error: Floats) -> Floats:
    """Return shifts and turns (N, 6) that change the legs by error (N, 5) and keep the passive joints."""
    regular = np.isfinite(wrenches).all(axis=(1, 2)) & (np.abs(np.linalg.det(wrenches)) > 0.0)
    safe = np.where(regular[:, None, None], wrenches, np.eye(6))
    wanted = np.concatenate([error, np.zeros((len(error), 1))], axis=1)
    found = cast("Floats", np.linalg.solve(safe, wanted[..., None])[..., 0])
    return np.where(regular[:, None], found, np.nan)


def _unit(vectors: Floats) -> Floats:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
