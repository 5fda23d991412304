"""Suggestions for a part that does not fit: another placement, a wider tilt cone, a smaller region, each tried."""

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

    wider_deg: widenings of the cone, up to widest_deg. first_share: of the path's extents, the first region tried;
    halvings: steps of the bisection for the largest one; smallest_share: the smallest one suggested.
    """

    wider_deg: tuple[float, ...] = (5.0, 10.0, 20.0)
    widest_deg: float = 45.0
    first_share: float = 0.6
    halvings: int = 4
    smallest_share: float = 0.25


_OPTIONS = SuggestionOptions()


def suggestions(problem: PlacementProblem, best: Candidate, improve: Raise, needed: float) -> tuple[str, ...]:
    """Return the changes near the best candidate that make the part fit, as phrases for "Try to …"; maybe none."""
    phrases = [_move(problem, best, improve, needed)] if problem.constraints is not FREE else []
    if problem.constraints.moves:
        # Around a common axis the tool may lean as far as the cutter allows.
        wider = "" if problem.samples.common_axis is not None else _cone(problem, best, improve, needed)
        phrases += [wider, _region(problem, best, improve, needed)]
    return tuple(phrase for phrase in phrases if phrase)


def _move(problem: PlacementProblem, best: Candidate, improve: Raise, needed: float) -> str:
    """Suggest the move to a placement that fits, where the constraints exclude it."""
    moved = improve(replace(problem, constraints=FREE), best)
    if moved.smallest < needed:
        return ""
    shift = (moved.transform.translation - best.transform.translation) * 1e3
    cosine = 0.5 * (np.trace(best.transform.rotation.T @ moved.transform.rotation) - 1.0)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    x, y, z = shift
    return f'move the part by ({x:.0f}, {y:.0f}, {z:.0f}) mm and turn it by {angle:.0f}° (mode = "free" finds where)'


def _cone(problem: PlacementProblem, best: Candidate, improve: Raise, needed: float) -> str:
    """Suggest the narrowest of a few wider cones with which the part fits; the widest is tried first."""
    enough, wider = 0.0, problem.samples.tilt + np.radians(_OPTIONS.wider_deg)
    for tilt in wider[wider <= np.radians(_OPTIONS.widest_deg)].tolist()[::-1]:
        there = problem.along(replace(problem.samples, tilt=tilt))
        if improve(there, first_candidate(there, best.margins, best.transform)).smallest < needed:
            break
        enough = tilt
    return f"allow a tilt of {np.degrees(enough):.0f}°, which is enough" if enough else ""


def _region(problem: PlacementProblem, best: Candidate, improve: Raise, needed: float) -> str:
    """Suggest the largest box about the path's middle, in proportion to its extents, that was found to fit."""
    low, high = problem.samples.tilt_centres.min(axis=0), problem.samples.tilt_centres.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    fits, too_large, start = 0.0, 1.0, best
    share = _OPTIONS.first_share
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
