"""Grid refinement for TOPP-RA: gridpoints so dense that limits kept at them are kept between them."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.timing.limits.limits import Limits
from pentapod.timing.path.path import PathDerivatives, PieceLike

LEAST_STAGES = 24
"""Stages of a piece at least."""

STAGES_IN_CORNERS = 4
"""Stages of each interval between knots, where the path bends."""

_BENT = 0.1
"""Share of an acceleration limit that the bend of the path takes by itself in a corner."""

_TOLERANCE = 0.01
_DRIFT = 0.1
"""Share of an acceleration limit by which the speed gained in a stage may change what the curve itself takes."""
_ROUNDS = 7

_AT_ONCE = 1 << 16
"""Stages looked at at once."""


def first_grid(piece: PieceLike, limits: Limits) -> Floats:
    """Return gridpoints (N + 1,) from 0 to the piece's length.

    Holds the knots, the section ends and where their feeds begin to hold, and in corners four stages from knot to knot.
    Stages are halved until, at the largest speed and path acceleration that the limits leave there, the accelerations
    and rates in the middle of a stage exceed those at its ends by less than 1 %, and the square of the feed's rate is
    off by less; and until a stage gains so little speed that one path acceleration suits both of its ends.
    """
    s = _base_grid(piece, limits)
    for _ in range(_ROUNDS):
        rough = _rough(piece, limits, s)
        if not rough.any():
            break
        s = np.sort(np.concatenate([s, (s[:-1] + s[1:])[rough] / 2.0]))
    return s


def _base_grid(piece: PieceLike, limits: Limits) -> Floats:
    length = float(piece.length)
    begins, ends, _ = limits.feed.guarded_sections(piece)
    marks = np.concatenate([piece.knots, piece.section_ends, begins, ends, _ramps(piece, limits)])
    marks = np.unique(np.concatenate([[0.0], marks[(marks > 0.0) & (marks < length)], [length]]))
    # Marks that rounding holds apart would make stages of no length; the ends stay exact.
    keep = np.diff(marks) > 1e-9 * length
    marks = np.concatenate([marks[:-1][keep], [length]])
    marks[0] = 0.0
    steps = np.diff(marks)
    counts = np.ceil(steps / length * LEAST_STAGES - 1e-9).astype(np.intp)
    counts[_bent(piece, limits, (marks[:-1] + marks[1:]) / 2.0)] *= STAGES_IN_CORNERS
    stage = np.repeat(np.arange(len(steps)), counts)
    within = np.arange(len(stage)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.append(marks[stage] + steps[stage] * (within / counts[stage]), length)


def _bent(piece: PieceLike, limits: Limits, s: Floats) -> Bools:
    """Return at which stations (n,) the path's bend alone takes part of an acceleration limit at the largest speed."""
    path = PathDerivatives(piece, s)
    use = np.abs(limits.rows(path).second).max(axis=1) * limits.ceiling(path)
    return np.asarray(use > _BENT)


def _ramps(piece: PieceLike, limits: Limits) -> Floats:
    """Return where speeding up from each stop or slower section, or braking for it, should about be done.

    The law switches near there; a stage across that point would waste time.
    """
    begins, ends, speeds = limits.feed.guarded_sections(piece)
    before, after = np.append(0.0, speeds), np.append(speeds, 0.0)
    slope = limits.rows(PathDerivatives(piece, np.append(0.0, piece.section_ends))).first
    reach = 0.5 * np.abs(after**2 - before**2) * np.abs(slope).max(axis=1)
    up, down = np.append(0.0, ends) + reach, np.append(begins, piece.length) - reach
    return np.where(after > before, up, down)


def parts(stages: int) -> list[slice]:
    """Return the gridpoints of parts of so many stages, each with those at both of its ends.

    What is asked of every stage is asked of one part after the other, so that memory does not grow with it.
    """
    return [slice(low, min(low + _AT_ONCE, stages) + 1) for low in range(0, stages, _AT_ONCE)]


def _rough(piece: PieceLike, limits: Limits, s: Floats) -> Bools:
    """Return which stages (N,) are too long, by what the constraints' coefficients do at their middle."""
    return np.concatenate([_rough_part(piece, limits, s[part]) for part in parts(len(s) - 1)])


def _rough_part(piece: PieceLike, limits: Limits, s: Floats) -> Bools:
    points = np.empty(2 * len(s) - 1)
    points[0::2], points[1::2] = s, (s[:-1] + s[1:]) / 2.0
    path = PathDerivatives(piece, points)
    rows, ceiling = limits.rows(path), limits.ceiling(path)
    first, second, offset = rows.first, rows.second, rows.offset
    with np.errstate(divide="ignore"):
        pushes = ((1.0 + np.abs(second) * ceiling[:, None] + np.abs(offset)) / np.abs(first)).min(axis=1)
    a, m, b = slice(0, -1, 2), slice(1, None, 2), slice(2, None, 2)
    x = np.maximum(np.maximum(ceiling[a], ceiling[b]), ceiling[m])[:, None]
    # No stage can gain more than the whole of x over its length.
    u = np.minimum(np.maximum(np.maximum(pushes[a], pushes[b]), pushes[m]), x[:, 0] / (2.0 * np.diff(s)))[:, None]
    gain = np.minimum(2.0 * u * np.diff(s)[:, None], x)
    bulge = (
        np.abs(first[m] - (first[a] + first[b]) / 2.0) * u
        + np.abs(second[m] - (second[a] + second[b]) / 2.0) * x
        + np.abs(second[b] - second[a]) * gain / 4.0
    )
    if len(offset) > 1:
        bulge += np.abs(offset[m] - (offset[a] + offset[b]) / 2.0)
    # x is linear within the stage, its ceiling v²/q′² is not: the chord between two ceilings lies above.
    low, high = np.minimum(ceiling[a], ceiling[b]), np.maximum(ceiling[a], ceiling[b])
    fast = limits.slowness(path)[m] * np.sqrt(np.minimum(low + gain[:, 0], high) / 2.0 + low / 2.0)
    # What a feed allows is its square by that of the rate: 1 for cutters, curved for a spot on the surface.
    square = np.square(piece.feed_rate(points))
    bow = np.abs(square[m] - (square[a] + square[b]) / 2.0)
    return np.asarray(
        (bulge > _TOLERANCE).any(axis=1)
        | (np.abs(second[m]) * gain > _DRIFT).any(axis=1)
        | (fast > 1.0 + 0.1 * _TOLERANCE)
        | (bow > _TOLERANCE * np.maximum(square[a], square[b]))
    )
