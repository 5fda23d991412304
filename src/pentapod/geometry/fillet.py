"""Corner blending: a C3 spline along a polyline, within a proven tolerance.

The curve is Schoenberg's variation-diminishing spline of degree 4: its control points are the polyline's points at the
averages of the knots. It reproduces straight parts exactly, never overshoots, and approaches the polyline as the knots
get denser; so spans are halved wherever it is too far away. Every corner of the polyline is a knot, so that on each
span curve minus polyline is one polynomial, which its Bernstein coefficients enclose.

Sources: I. J. Schoenberg, "On spline functions", 1967; R. T. Farouki, CAGD 29 (2012), section 5 (convex hull).
"""

from __future__ import annotations

from collections.abc import Callable
from math import factorial
from typing import TypeAlias

import numpy as np
from scipy.interpolate import BSpline
from scipy.ndimage import binary_dilation

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.errors import ArrayError
from pentapod.numerics.bernstein import from_power, split

DEGREE = 4

HALVINGS = 40
"""Rounds of halving after which the spacing of numbers is reached."""

BULGE = 7.0 / 24.0
"""Distance of the curve from a corner, over the knots' distance and the change of direction."""

APART = 0.9
"""Share of the way to where two corners' knots would meet that they may use."""

PARTS = 8
"""Parts of a span that are tested where its own coefficients are not within the tolerance."""

TooFar: TypeAlias = Callable[[Floats, Floats], Bools]
"""too_far(differences (K, D, 5), chords (K, D, 2)): on which of K spans the curve may exceed its tolerance.

differences: Bernstein coefficients of curve minus polyline; chords: the polyline's points at both ends.
"""


def blended(parameter: Floats, points: Floats, too_far: TooFar, between: Floats | None = None) -> BSpline:
    """Return a clamped C3 spline of degree 4 near the polyline of points (N, D) at parameters (N,), with exact ends.

    between: knots to begin with beside the parameters, from `knots_between`.
    Raises ArrayError where the parameters do not increase strictly, and where `HALVINGS` rounds do not suffice.
    """
    if len(parameter) < 2 or not (np.diff(parameter) > 0.0).all():
        raise ArrayError("parameters must increase strictly", key="parameter", expected="two or more")
    knots = parameter if between is None else np.union1d(parameter, between)
    changed = np.ones(len(knots) - 1, dtype=np.bool_)
    for _ in range(HALVINGS):
        curve = schoenberg(knots, parameter, points)
        rows = np.flatnonzero(changed)
        far = np.zeros(len(changed), dtype=np.bool_)
        far[rows] = _far(*_spans(curve, knots, rows, parameter, points), too_far)
        if not far.any():
            return curve
        # A new knot changes the curve on DEGREE spans to either side only.
        changed = np.repeat(binary_dilation(far, iterations=DEGREE), 1 + far)
        knots = np.sort(np.concatenate([knots, 0.5 * (knots[:-1] + knots[1:])[far]]))
    raise ArrayError("the tolerance is too small for the spacing of numbers", value=float(np.diff(knots).min()))


def knots_between(parameter: Floats, reach: Floats) -> Floats:
    """Return knots (K,) between parameters (N,) with which the curve cuts each corner about as widely as it may.

    reach (N,): distances of evenly spaced knots with which it does; its distance from the corner is then `BULGE` times
    that, times the turn. Two knots on either side of a corner determine the curve there. Where neighbours reach too far
    they share one.
    """
    gap, left, right = np.diff(parameter), reach[:-1], reach[1:]
    asks, asked = left < gap, right < gap
    own, other = np.where(asks, left, 0.0), np.where(asked, right, 0.0)
    middle = gap * own / np.maximum(own + other, np.finfo(float).tiny)  # how far knots of the left corner may lie
    crowded = asks & asked & (left + right > APART * gap)
    found = [(parameter[:-1] + middle)[crowded]]
    for step in (1.0, 2.0):
        fits = asks & ~crowded & (step * left <= APART * middle)
        found.append((parameter[:-1] + step * left)[fits])
        fits = asked & ~crowded & (step * right <= APART * (gap - middle))
        found.append((parameter[1:] - step * right)[fits])
    return np.concatenate(found)


def schoenberg(knots: Floats, parameter: Floats, points: Floats) -> BSpline:
    """Return Schoenberg's spline of the polyline (parameter, points) on clamped simple knots (K,)."""
    t = np.concatenate([np.full(DEGREE, knots[0]), knots, np.full(DEGREE, knots[-1])])
    averages = sum(t[1 + k : len(t) - DEGREE + k] for k in range(DEGREE)) / DEGREE
    # Rounding must not move the outermost averages beyond the polyline.
    return BSpline(t, interpolated(np.clip(averages, knots[0], knots[-1]), parameter, points), DEGREE)


def interpolated(u: Floats, parameter: Floats, points: Floats) -> Floats:
    """Return the polyline (K, D) at parameters u (K,)."""
    k = np.clip(np.searchsorted(parameter, u, side="right") - 1, 0, len(parameter) - 2)
    share = ((u - parameter[k]) / (parameter[k + 1] - parameter[k]))[:, None]
    return points[k] + share * (points[k + 1] - points[k])


def _spans(curve: BSpline, knots: Floats, rows: Ints, parameter: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Return differences (K, D, 5) and chords (K, D, 2), as `TooFar` takes them, of the spans `rows` (K,)."""
    width = np.diff(knots)[rows][:, None]
    powers = [curve(knots[rows], k) * width**k / factorial(k) for k in range(DEGREE + 1)]
    chords = np.stack([interpolated(knots[k], parameter, points) for k in (rows, rows + 1)], axis=-1)
    return from_power(np.stack(powers, axis=-1)) - _along(chords, DEGREE), chords


def _far(differences: Floats, chords: Floats, too_far: TooFar) -> Bools:
    """Return on which spans (K,) the curve, tested in parts where necessary, may be too far."""
    far = too_far(differences, chords)
    doubtful = np.flatnonzero(far)
    if not len(doubtful):
        return far
    parts = [differences[doubtful]]
    while len(parts) < PARTS:
        parts = [half for part in parts for half in split(part)]
    ends = _along(chords[doubtful], PARTS)
    far[doubtful] = np.any([too_far(part, ends[..., k : k + 2]) for k, part in enumerate(parts)], axis=0)
    return far


def _along(chords: Floats, count: int) -> Floats:
    """Return points (K, D, count + 1) evenly along chords (K, D, 2)."""
    share = np.arange(count + 1) / count
    return chords[..., :1] * (1.0 - share) + chords[..., 1:] * share
