"""Grid refinement for TOPP-RA: gridpoints so dense that limits kept at them are kept between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, row_maxima
from pentapod.numerics.blocks import blocks
from pentapod.timing.limits.limits import Limits
from pentapod.timing.path.path import PathDerivatives, PieceLike

STAGES_AT_ONCE = 1 << 16
"""Stages evaluated together, so that memory does not grow with their number."""


@dataclass(frozen=True)
class GridOptions:
    """First grid of a piece."""

    least_stages: int = 24  # smallest number of stages of a piece
    stages_in_corners: int = 4  # stages of each interval between knots where the path bends
    bend_share: float = 0.1  # share of an acceleration limit that the path's curvature takes by itself where it bends
    tolerance: float = 0.01  # share of a limit by which the middle of a stage may exceed its ends
    drift: float = 0.1  # share of an acceleration limit by which what the curvature takes may change within a stage
    halvings: int = 7  # how often stages are halved at most


DEFAULTS = GridOptions()


def first_grid(piece: PieceLike, limits: Limits, options: GridOptions = DEFAULTS) -> Floats:
    """Return gridpoints (N + 1,) from 0 to the piece's length.

    They include the knots, the section ends, where their feeds begin to hold, and points between knots in corners.
    Stages are halved until, at the largest speed and path acceleration that the limits leave there, accelerations,
    rates and the square of the feed's rate in the middle of a stage exceed those at its ends by less than the
    tolerance, and until a stage gains so little speed that one path acceleration suits both of its ends.
    """
    s = _base_grid(piece, limits, options)
    coarse = np.ones(len(s) - 1, dtype=bool)
    for _ in range(options.halvings):
        new = np.flatnonzero(coarse)  # the others have been looked at
        stages = [new[part] for part in blocks(len(new), STAGES_AT_ONCE)]
        coarse[new] = np.concatenate([_coarse(piece, limits, s[part], s[part + 1], options) for part in stages])
        if not coarse.any():
            break
        s = np.sort(np.concatenate([s, (s[:-1] + s[1:])[coarse] / 2.0]))
        coarse = np.repeat(coarse, 1 + coarse)
    return s


def subdivided(s: Floats, counts: Ints) -> Floats:
    """Return gridpoints that divide the stages between s (N + 1,) into equal ones, `counts` (N,) of them each."""
    stage = np.repeat(np.arange(len(counts)), counts)
    within = np.arange(len(stage)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.append(s[stage] + np.diff(s)[stage] * (within / counts[stage]), s[-1])


def parts(stages: int) -> list[slice]:
    """Return the gridpoints of parts of so many stages, each with those at both of its ends."""
    return [slice(block.start, block.stop + 1) for block in blocks(stages, STAGES_AT_ONCE)]


def _base_grid(piece: PieceLike, limits: Limits, options: GridOptions) -> Floats:
    length = float(piece.length)
    begins, ends, _ = limits.feed.guarded_sections(piece)
    marks = np.concatenate([piece.knots, piece.section_ends, begins, ends, _ramp_ends(piece, limits)])
    marks = np.unique(np.concatenate([[0.0], marks[(marks > 0.0) & (marks < length)], [length]]))
    # Marks that differ by rounding alone would make stages of no length; the ends stay exact.
    keep = np.diff(marks) > 1e-9 * length
    marks = np.concatenate([marks[:-1][keep], [length]])
    marks[0] = 0.0
    counts = np.ceil(np.diff(marks) / length * options.least_stages - 1e-9).astype(np.intp)
    path = PathDerivatives(piece, (marks[:-1] + marks[1:]) / 2.0)
    curvature_share = row_maxima(np.abs(limits.rows(path).second)) * limits.ceiling(path)
    counts[curvature_share > options.bend_share] *= options.stages_in_corners
    return subdivided(marks, counts)


def _ramp_ends(piece: PieceLike, limits: Limits) -> Floats:
    """Return where accelerating from each stop or slower section, or braking for it, should about be done.

    The law switches near there; a stage across that point would waste time.
    """
    begins, ends, speeds = limits.feed.guarded_sections(piece)
    before, after = np.append(0.0, speeds), np.append(speeds, 0.0)
    slope = limits.rows(PathDerivatives(piece, np.append(0.0, piece.section_ends))).first
    reach = 0.5 * np.abs(after**2 - before**2) * np.abs(slope).max(axis=1)
    up, down = np.append(0.0, ends) + reach, np.append(begins, piece.length) - reach
    return np.where(after > before, up, down)


def _coarse(piece: PieceLike, limits: Limits, begin: Floats, end: Floats, options: GridOptions) -> Bools:
    """Return which stages (N,), in their order, are too long, by what the constraints do at their middle."""
    points = np.column_stack([begin, (begin + end) / 2.0, end]).ravel()
    path = PathDerivatives(piece, points)
    rows, ceiling = limits.rows(path), limits.ceiling(path)
    first, second, offset = rows.first, rows.second, rows.offset
    with np.errstate(divide="ignore"):
        pushes = ((1.0 + np.abs(second) * ceiling[:, None] + np.abs(offset)) / np.abs(first)).min(axis=1)
    a, m, b = slice(0, None, 3), slice(1, None, 3), slice(2, None, 3)
    x = np.maximum(np.maximum(ceiling[a], ceiling[b]), ceiling[m])[:, None]
    # No stage can gain more than the whole of x over its length.
    u = np.minimum(np.maximum(np.maximum(pushes[a], pushes[b]), pushes[m]), x[:, 0] / (2.0 * (end - begin)))[:, None]
    gain = np.minimum(2.0 * u * (end - begin)[:, None], x)
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
    # A feed bounds x by its square over that of the rate: 1 for cutters, curved for a spot on the surface.
    square = np.square(piece.feed_rate(points))
    bow = np.abs(square[m] - (square[a] + square[b]) / 2.0)
    return np.asarray(
        (bulge > options.tolerance).any(axis=1)
        | (np.abs(second[m]) * gain > options.drift).any(axis=1)
        | (fast > 1.0 + 0.1 * options.tolerance)
        | (bow > options.tolerance * np.maximum(square[a], square[b]))
    )
