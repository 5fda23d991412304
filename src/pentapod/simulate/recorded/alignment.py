"""Alignment of a recorded run with its program: which place of the program each row of the log belongs to.

A hold, a feed override or a late start move a run in time, not off its path. So the log is matched with the program's
path first: of all monotone ways through the program, which may begin and end anywhere in the log, the one with the
least sum of squared distances between measured and programmed legs, by dynamic programming over those places that are
near each other. Where the places found advance as the time does, the run is also compared in time.

Source: H. Sakoe and S. Chiba, Dynamic programming algorithm optimization for spoken word recognition, 1978.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import InputError
from pentapod.base.values import Value
from pentapod.program.program import Program
from pentapod.simulate.recorded.run_log import RunLog


@dataclass(frozen=True)
class AlignOptions:
    """Options of the alignment.

    step: seconds between the places that are matched first. radii: metres, distances of legs (root of the sum of
    squares) up to which places are near; the next one counts where it matches the whole program, or `more` times as
    much of the log: ways to and from the program come near it, too. fastest: most steps of the program in one of the
    log. even: metres, what a step more or less than one counts as. cells: of the search at most. least: seconds of a
    program that a log must have at least. share: of the log's rows or of the program, that must be matched. in_time:
    seconds by which a run may be early or late and still is compared in time. moving: share of the program's median
    speed from which it counts as moving. unit: ratio of lengths from which the unit of a log is wrong.
    """

    step: float = 8e-3
    radii: tuple[float, ...] = (1e-3, 4e-3, 12e-3)
    more: float = 2.0
    fastest: int = 2
    even: float = 2e-6
    cells: int = 40_000_000
    least: float = 0.2
    share: float = 0.1
    in_time: float = 0.03
    moving: float = 0.1
    unit: float = 3.0


DEFAULTS = AlignOptions()


@dataclass(frozen=True, eq=False)
class Alignment(Value):
    """Rows first to last − 1 of a log belong to the program. places (n,): the program's row for each, not whole.

    start: time of the program's first row in the log's time, seconds; None where the run was held or overridden, so
    that it cannot be compared in time. shift (n,): seconds by which each row is later than at the program's pace.
    moving (n,): where the program moves.
    """

    first: int
    last: int
    places: Floats
    start: float | None
    shift: Floats
    moving: Ints


def align(log: RunLog, program: Program, options: AlignOptions = DEFAULTS) -> Alignment:
    """Return how a log and its program belong together. legs of the log: as the program's, not commands of drives.

    Raises InputError: the log's lengths are in another unit, or it is not a run of this program.
    """
    _check_unit(log, program, options)
    followed: tuple[Ints, Floats] | None = None
    for radius in options.radii:
        found = _followed(log, program, radius, options)
        if found is not None and (
            followed is None or len(found[0]) > options.more * len(followed[0]) or _whole(found, program)
        ):
            followed = found
        if followed is not None and _whole(followed, program):
            break
    covered = 0.0 if followed is None else float(np.ptp(followed[1])) * program.period
    matched = 0.0 if followed is None else float(np.ptp(followed[0])) / len(log.times)
    by_chance = max(matched, covered / program.duration) < options.share  # paths of other programs come near it, too
    if followed is None or covered < min(options.least, 0.5 * program.duration) or by_chance:
        low, high = _ranges(log.legs), _ranges(program.legs)
        raise InputError(
            "not a run of this program: the legs are nowhere near its path for long", file=log.file,
            value=f"legs of {low}", expected=f"legs of {high}",
            remedy="give the program that was run, by --program, and say what the columns are, by --columns",
        )  # fmt: skip
    at, places = followed
    first, last = int(at[0]), int(at[-1]) + 1
    times = log.times[first:last]
    places = np.interp(times, log.times[at], places)
    k = np.minimum(places.astype(np.intp), len(program.legs) - 2)
    speeds = np.abs(np.diff(program.legs, axis=0)).max(axis=1)
    usual = float(np.median(speeds[speeds > 0.0]))
    moving = np.flatnonzero(speeds[k] > options.moving * usual)
    if not len(moving):
        moving = np.arange(len(places))
    shift = times - places * program.period
    start = float(np.median(shift[moving]))
    held = float(np.abs(shift[moving] - start).max()) > options.in_time
    return Alignment(first, last, places, None if held else start, shift - start, moving)


def _whole(followed: tuple[Ints, Floats], program: Program) -> bool:
    """Return whether a match holds the whole program."""
    return bool(np.ptp(followed[1]) > (1.0 - 1e-3) * (len(program.legs) - 1))


def _ranges(legs: Floats) -> str:
    return f"{1e3 * legs.min():.6g} to {1e3 * legs.max():.6g} mm"


def _check_unit(log: RunLog, program: Program, options: AlignOptions) -> None:
    ratio = float(np.median(log.legs) / np.median(program.legs))
    if not 1.0 / options.unit < ratio < options.unit:
        raise InputError(
            f"the legs are {ratio:.4g} times as long as the program's", file=log.file, line=log.lines[0],
            value=f"{1e3 * float(log.legs[0, 0]):.6g} mm", expected=f"{_ranges(program.legs)}, as the program has",
            remedy="name the columns with their unit by --columns, such as legs_m",
        )  # fmt: skip


def _followed(log: RunLog, program: Program, radius: float, options: AlignOptions) -> tuple[Ints, Floats] | None:
    """Return rows of the log, ascending, and their places, in rows of the program; None where nothing is near.

    Of the program's polyline with a corner each `step`, a place is a chord and a fraction of it.
    """
    from scipy.spatial import KDTree  # noqa: PLC0415  slow to load

    stride = max(1, round(options.step / program.period))
    corners = np.unique(np.append(np.arange(0, len(program.legs) - 1, stride), len(program.legs) - 1))
    base, chord = program.legs[corners[:-1]], np.diff(program.legs[corners], axis=0)
    square = np.einsum("ij,ij->i", chord, chord)
    wanted = np.arange(log.times[0], log.times[-1], options.step)
    rows = np.unique(np.append(np.searchsorted(log.times, wanted), len(log.times) - 1))
    legs = log.legs[rows]
    tree, reach = KDTree(base + 0.5 * chord), radius + 0.5 * float(np.sqrt(square.max()))
    if int(tree.query_ball_point(legs, reach, return_length=True).sum()) > options.cells:
        return None
    near = tree.query_ball_point(legs, reach, return_sorted=True)
    steps = np.ceil(options.fastest * np.diff(log.times[rows], prepend=log.times[0]) / options.step - 1e-6)
    steps = np.clip(steps, options.fastest, len(corners)).astype(np.intp)
    pad = int(steps.max())
    best = np.full(len(base) + pad, np.inf)  # of the step before, by chord, after `pad` that are never reached
    before, outside = np.empty(0, dtype=np.intp), radius * radius
    came: list[tuple[Ints, Ints]] = []
    ending, at = np.inf, (0, 0)
    for i, found in enumerate(near):
        k = np.array(found, dtype=np.intp)
        off = legs[i] - base[k]
        f = np.clip(np.einsum("ij,ij->i", off, chord[k]) / np.where(square[k] > 0.0, square[k], 1.0), 0.0, 1.0)
        away = np.square(off - f[:, None] * chord[k]).sum(axis=1)
        k, away = k[away < outside], away[away < outside]
        moves = np.concatenate([[1, 0], np.arange(2, steps[i] + 1)])
        uneven = (options.even * (moves - 1.0)) ** 2
        options_of = best[pad + k[None] - moves[:, None]] + uneven[:, None]
        chosen = options_of.argmin(axis=0)
        cost, move = options_of[chosen, np.arange(len(k))], moves[chosen]
        entered = i * outside + (k > 0) * outside
        move, cost = np.where(entered < cost, -1, move), np.minimum(entered, cost) + away
        best[pad + before] = np.inf
        best[pad + k], before = cost, k
        came.append((k, move))
        # What is left of the log is outside from here on.
        rest = cost + (len(near) - 1 - i) * outside
        if len(k) and rest.min() <= ending:
            ending, at = float(rest.min()), (i, int(rest.argmin()))
    if not np.isfinite(ending):
        return None
    return _traced(came, at, rows, corners, legs, (base, chord, square))


def _traced(
    came: list[tuple[Ints, Ints]], at: tuple[int, int], rows: Ints, corners: Ints, legs: Floats,
    path: tuple[Floats, Floats, Floats],
) -> tuple[Ints, Floats]:  # fmt: skip
    """Return rows and places of the way that ends at candidate at[1] of step at[0]."""
    base, chord, square = path
    i, c = at
    visited = list[int]()
    while True:
        k, move = came[i]
        visited.append(int(k[c]))
        if move[c] < 0:
            break
        i, c = i - 1, int(np.searchsorted(came[i - 1][0], k[c] - move[c]))
    k = np.array(visited[::-1])
    off = legs[i : at[0] + 1] - base[k]
    f = np.clip(np.einsum("ij,ij->i", off, chord[k]) / np.where(square[k] > 0.0, square[k], 1.0), 0.0, 1.0)
    f[square[k] == 0.0] = 0.0
    places = corners[k] + f * (corners[k + 1] - corners[k])
    return rows[i : at[0] + 1], np.maximum.accumulate(places)
