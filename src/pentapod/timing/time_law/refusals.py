"""Refusals of the time law: the place, the limits in conflict, and the tangent of the path there."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.refusal import Refusal, Shortfall
from pentapod.timing.path.path import LegPathLike, PieceLike
from pentapod.timing.topp.stages import Failure

STILL_M = 1e-12
"""A piece shorter than this, in metres, does not move."""

LARGEST_JUMP_M = 1e-9
"""Largest difference of leg lengths, in metres, between the end of a piece and the start of the next."""


def unfit(path: LegPathLike) -> Refusal | None:
    """Return why a path cannot be timed: nothing moves, legs jump between pieces, or legs are not finite."""
    previous = None
    for k, piece in enumerate(path.pieces):
        if not math.isfinite(piece.length) or piece.length < 0.0:
            return Refusal("timing", f"piece {k} of the leg path has no length: {piece.length}")
        s = np.unique(np.concatenate([[0.0], piece.knots, [piece.length]]))
        values = [piece(s, order) for order in range(3)]
        bad = ~np.isfinite(np.concatenate(values, axis=1)).all(axis=1)
        if bad.any():
            return refusal(path, k, Failure(-1, "the leg path or a derivative is not finite", station=float(s[bad][0])))
        ends = values[0][[0, -1]]
        if previous is not None and np.abs(ends[0] - previous).max() > LARGEST_JUMP_M:
            jump = np.abs(ends[0] - previous)
            leg, most = int(jump.argmax()), 1e3 * float(jump.max())
            reason = Failure(-1, f"the legs jump by {most:.3g} mm at an exact stop", station=0.0)
            return refusal(path, k, reason, (f"leg {leg + 1} jumps", most, "mm"))
        if piece.length <= STILL_M and np.abs(ends[1] - ends[0]).max() > LARGEST_JUMP_M:
            return refusal(path, k, Failure(-1, "the tool turns while its tip stands still", station=0.0))
        previous = ends[1]
    if not any(piece.length > STILL_M for piece in path.pieces):
        return Refusal("timing", "nothing moves: every piece of the leg path has no length")
    return None


def refusal(path: LegPathLike, k: int, failure: Failure, short: tuple[str, float, str] | None = None) -> Refusal:
    """Return the refusal of piece k: place, conflicting limits, tangent, and the waypoints there.

    short: the shortfall where it is known: (constraint, amount, unit).
    """
    piece, s = path.pieces[k], failure.station
    where = f"piece {k}" if failure.gridpoint < 0 else f"piece {k}, gridpoint {failure.gridpoint}"
    cause = f"{failure.reason}; {where}"
    if s is None:
        return Refusal("timing", cause)
    cause += f", {1e3 * (float(path.starts[k]) + s):.6g} mm along the path, segment {segment_at(piece, s)}"
    if failure.limits:
        cause += f"; in conflict: {' and '.join(failure.limits)}"
    tangent = piece(np.array([s]), 1)[0]
    if np.isfinite(tangent).all():
        cause += f"; legs move by ({', '.join(f'{rate:.3g}' for rate in tangent)}) m for each metre there"
    limits = [short] if short else [(name, 0.0, "") for name in failure.limits or ["time law"]]
    waypoints = (waypoints_at(piece, s),)
    return Refusal("timing", cause, tuple(Shortfall(name, waypoints, amount, unit) for name, amount, unit in limits))


def segment_at(piece: PieceLike, s: float) -> int:
    """Return the toolpath's segment at a station of a piece."""
    section = min(int(np.searchsorted(piece.section_ends, s, side="left")), len(piece.section_segments) - 1)
    return int(piece.section_segments[section])


def waypoints_at(piece: PieceLike, s: float) -> tuple[int, int]:
    """Return the toolpath's waypoints on both sides of a station; twice the same where it is at one."""
    stations, waypoints = np.asarray(piece.waypoint_stations), np.asarray(piece.waypoints)
    last = len(stations) - 1
    before = min(max(int(np.searchsorted(stations, s + 1e-12, side="right")) - 1, 0), last)
    after = max(min(int(np.searchsorted(stations, s - 1e-12, side="left")), last), before)
    return int(waypoints[before]), int(waypoints[after])
