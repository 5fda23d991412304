"""Suggestions for a part that does not fit, found by trying: another place, a wider tilt cone, a smaller region."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pentapod.planning.placement.sampling import first_candidate
from pentapod.planning.problem.constraints import FREE
from pentapod.planning.problem.problem import Candidate, PlacementProblem

Raise = Callable[[PlacementProblem, Candidate], Candidate]
"""Improves a candidate of a problem, its placement free, until it fits."""


@dataclass(frozen=True)
class SuggestionOptions:
    """What is tried.

    wider_deg: by how much the cone is widened, up to widest_deg. halvings: steps of the bisection for the largest
    region; smallest_share: of the path's extents, below which none is suggested.
    """

    wider_deg: tuple[float, ...] = (5.0, 10.0, 20.0)
    widest_deg: float = 45.0
    halvings: int = 4
    smallest_share: float = 0.25


_OPTIONS = SuggestionOptions()


def suggestions(problem: PlacementProblem, best: Candidate, improve: Raise, needed: float) -> tuple[str, ...]:
    """Return what was tried near the best candidate and would do, each a phrase for "Try to …"; maybe nothing."""
    phrases = [_move(problem, best, improve, needed)] if problem.constraints is not FREE else []
    if problem.constraints.moves:
        phrases += [_cone(problem, best, improve, needed), _region(problem, best, improve, needed)]
    return tuple(phrase for phrase in phrases if phrase)


def _move(problem: PlacementProblem, best: Candidate, improve: Raise, needed: float) -> str:
    moved = improve(replace(problem, constraints=FREE), best)
    if moved.smallest < needed:
        return ""
    shift = (moved.transform.translation - best.transform.translation) * 1e3
    cosine = 0.5 * (np.trace(best.transform.rotation.T @ moved.transform.rotation) - 1.0)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    x, y, z = shift
    return f'move the part by ({x:.0f}, {y:.0f}, {z:.0f}) mm and turn it by {angle:.0f}° (mode = "free" finds where)'


def _cone(problem: PlacementProblem, best: Candidate, improve: Raise, needed: float) -> str:
    """Return the least of a few wider cones that was found to do; the widest is tried first: it may not do either."""
    samples = problem.samples
    wider = [
        float(tilt) for tilt in samples.tilt + np.radians(_OPTIONS.wider_deg) if tilt <= np.radians(_OPTIONS.widest_deg)
    ]

    def fits(tilt: float) -> bool:
        there = problem.along(replace(samples, tilt=tilt))
        return improve(there, first_candidate(there, best.margins, best.transform)).smallest >= needed

    enough = 0.0
    for tilt in reversed(wider):
        if not fits(tilt):
            break
        enough = tilt
    if enough == 0.0:
        return ""
    return f"allow a tilt of {np.degrees(enough):.0f}°, which is enough"


def _region(problem: PlacementProblem, best: Candidate, improve: Raise, needed: float) -> str:
    """Return the largest box about the path's middle, in proportion to its extents, that was found to fit."""
    low, high = problem.samples.tilt_centres.min(axis=0), problem.samples.tilt_centres.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    fits, too_large, start = 0.0, 1.0, best
    share = 0.6
    for _ in range(_OPTIONS.halvings):
        inside = np.flatnonzero((np.abs(problem.samples.tilt_centres - middle) <= share * half + 1e-9).all(axis=1))
        found = None
        if len(inside) > 0:
            part = problem.along(problem.samples.at(inside))
            found = improve(part, first_candidate(part, start.margins, start.transform))
        if found is not None and found.smallest >= needed:
            fits, start = share, found
        else:
            too_large = share
        share = 0.5 * (fits + too_large) if fits > 0.0 else 0.5 * share
        if share < _OPTIONS.smallest_share:
            break
    if fits == 0.0:
        return ""
    size, centre = 2e3 * fits * half, 1e3 * middle
    return "machine a smaller region: one of {:.0f} × {:.0f} × {:.0f} mm about ({:.0f}, {:.0f}, {:.0f}) mm fits".format(
        *size, *centre
    )
