"""Claims that the program is not slower than necessary: a lowest feed, and no stop without a reason."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.base.arrays import Bools, Floats, Ints, row_maxima
from pentapod.geometry.directions import angle_between
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.runs import marked_runs
from pentapod.numerics.blocks import blocks
from pentapod.toolpath.toolpath import SegmentKind
from pentapod.verify.claims.speed import STEPS_AT_ONCE, row_speeds
from pentapod.verify.claims.stops_and_dwells import STILL_M, required_stops
from pentapod.verify.replay.claim import Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay

LOWEST_SHARE = 0.9
"""Lowest share of the feed where the job has none; cuts and links may be slower where a limit is used."""

LOWEST_SHARE_STANDOFF = 0.95
"""The same for a laser or a spray, whose effect depends on the feed."""


@dataclass(frozen=True)
class SlownessOptions:
    """What explains a slow motion, and what counts as a stop.

    used: a limit of which this share is used explains it, within around_s seconds, or around_rows rows if that is
    longer. corner: radians; where the toolpath turns by more within the path tolerance, the motion nearly stops however
    the corner is blended, and may be at rest for up to spare_s seconds. A job's angle for exact stops may be less. A
    dwell may be longer by spare_s too. creep: share of the slowest feed; a robot whose legs are all slower is at rest.
    """

    used: float = 0.5
    around_s: float = 0.02
    around_rows: int = 5
    corner: float = math.radians(20.0)
    spare_s: float = 0.05
    creep: float = 0.01


OPTIONS = SlownessOptions()


def lowest_feed(replay: Replay) -> Finding | Idle:
    """Judge that cuts and links reach the lowest share of the feed where no limit is used."""
    standoff, bound = replay.toolpath.tilt_centre < 0.0, replay.specification.lowest_share
    if bound is None:
        bound = LOWEST_SHARE_STANDOFF if standoff else LOWEST_SHARE
    if bound == 0.0:
        return Idle("the job has no lowest feed")
    feeds = _feeds(replay)
    judged = np.isfinite(feeds)
    if not judged.any():
        return Idle("the program has no cut and no link longer than twice the path tolerance")
    period = replay.program.period
    tip = row_speeds(replay, 0.0)
    share = (row_speeds(replay, replay.toolpath.tilt_centre) if standoff else tip) / feeds
    used = np.maximum(_used(replay), tip / replay.machine.rapid_velocity if standoff else 0.0)
    around = max(math.ceil(OPTIONS.around_s / period), OPTIONS.around_rows)
    judged &= maximum_filter1d(used, 2 * around + 1) < OPTIONS.used
    row = int(np.argmin(np.where(judged, share, np.inf)))
    value = min(float(share[row]), 1.0) if judged[row] else 1.0
    slow = judged & (share < bound)
    whose = "the spot on the surface" if standoff else "the tip"
    method = (
        f"smallest ratio of the speed of {whose} from row to row to the feed, on cuts and links farther than the path "
        f"tolerance from their ends, where within {1e3 * around * period:g} ms no limit of legs or tool (velocity, "
        f"acceleration, jerk) is used by more than {OPTIONS.used:.0%}, so that none explains a slower motion"
    )
    if slow.any():
        method += f"; slower than the bound for {np.count_nonzero(slow) * period:.3g} s in all"
    return Finding(value >= bound, 100.0 * value, 100.0 * bound, "%", replay.place(2 * row), method, at_least=True)


def unasked_stop(replay: Replay) -> Finding:
    """Judge that the robot stops only where the toolpath gives a reason, and no longer than it asks for."""
    period, legs = replay.program.period, replay.machine.legs
    feeds = [min(segment.feed, replay.machine.rapid_velocity) for segment in replay.toolpath.segments]
    # The row nearest to a stop is within half a period of it: by then a leg has gained at most this.
    rest = np.minimum(legs.max_jerk * period**2, OPTIONS.creep * min(feeds))
    rows, still = replay.program.legs, np.empty(len(replay.program.legs) - 1, dtype=np.bool_)
    for part in blocks(len(still), STEPS_AT_ONCE):
        steps = np.abs(np.diff(rows[part.start : part.stop + 1], axis=0))
        still[part] = (steps <= np.maximum(rest * period, STILL_M)).all(axis=1)
    runs = marked_runs(still)
    corner = min(OPTIONS.corner, replay.specification.stop_angle or OPTIONS.corner)
    reasons, dwell = _reasons(replay, runs, corner)
    seconds = (runs[:, 1] - runs[:, 0]) * period
    beyond = np.where(reasons, np.maximum(seconds - dwell - OPTIONS.spare_s, 0.0), seconds)
    worst = int(np.argmax(beyond)) if len(beyond) else 0
    value = float(beyond[worst]) if len(beyond) else 0.0
    row = int(runs[worst, 0]) if value > 0.0 else 0
    method = (
        f"longest time at rest without a reason; within the path tolerance of dwells, ends of segments and corners of "
        f"more than {math.degrees(corner):g} deg, of the path or of tool and legs, only the time beyond the dwell and "
        f"{OPTIONS.spare_s:g} s counts; the "
        "robot is at rest when no leg is faster than its jerk limit allows within a period, or than "
        f"{OPTIONS.creep:.0%} of the slowest feed"
    )
    if value > 0.0:
        method += f"; {np.count_nonzero(beyond)} such stops"
    return Finding(value <= 0.0, value, 0.0, "s", replay.place(2 * row), method)


def _feeds(replay: Replay) -> Floats:
    """Return the feed (N − 1,) from row to row, m/s; infinite where more than one cut or link is near, or a rapid."""
    toolpath, arcs = replay.toolpath, replay.match.arcs[::2]
    ends, rapid = arc_length(toolpath.tilt_centres)[toolpath.starts], replay.machine.rapid_velocity
    first = np.searchsorted(ends, arcs[:-1] - replay.match_radius, side="right")
    behind = np.searchsorted(ends, arcs[1:] + replay.match_radius, side="left")
    feeds = [np.inf if s.kind is SegmentKind.RAPID else min(s.feed, rapid) for s in toolpath.segments]
    # No feed before the first end and behind the last one: there a program may be at rest.
    of_gap = np.array([np.inf, *feeds, np.inf])
    return np.where(first == behind, of_gap[first], np.inf)


def _used(replay: Replay) -> Floats:
    """Return the largest share (N − 1,) of any limit of legs and tool that is used from row to row."""
    count = len(replay.program.legs)
    used = np.empty(count - 1)
    for part in blocks(count - 1, STEPS_AT_ONCE):
        # A third difference reaches from the row before a step to the row behind it.
        first = max(part.start - 1, 0)
        among = _used_among(replay, slice(first, min(part.stop + 2, count)))
        used[part] = among[part.start - first : part.stop - first]
    return used


def _used_among(replay: Replay, rows: slice) -> Floats:
    """Return the same from row to row of some rows, as if there were no others."""
    machine, period = replay.machine, replay.program.period
    legs, tool, lengths = machine.legs, machine.tool_limits, replay.program.legs[rows]
    used = row_maxima(np.abs(np.diff(lengths, axis=0)) / (period * legs.max_velocity))
    _raise(used, _differences(lengths, 2, period) / legs.max_acceleration)
    _raise(used, _differences(lengths, 3, period) / legs.max_jerk)
    if machine.drive_forces.limited:
        _raise(used, replay.forces.motion_shares[rows][1:-1])
    if tool.given():
        position, axes = (pose[::2][rows] for pose in replay.pose)
        tips = position + machine.tool_length * axes
        for points, order, limit in (
            (tips, 2, tool.max_tip_acceleration),
            (tips, 3, tool.max_tip_jerk),
            (axes, 1, tool.max_axis_velocity),
            (axes, 2, tool.max_axis_acceleration),
        ):
            _raise(used, np.linalg.norm(_differences(points, order, period), axis=1, keepdims=True) / limit)
    return used


def _differences(points: Floats, order: int, period: float) -> Floats:
    """Return absolute differences (N − order, K) of rows (N, K) over the period: the derivative of that order."""
    return np.abs(np.diff(points, order, axis=0)) / period**order


def _raise(used: Floats, shares: Floats) -> None:
    """Raise `used` (N − 1,) to shares (N − order, K) of differences, each at the step in its middle."""
    first = (len(used) - len(shares)) // 2
    part = used[first : first + len(shares)]
    np.maximum(part, row_maxima(shares), out=part)


def _reasons(replay: Replay, runs: Ints, least: float) -> tuple[Bools, Floats]:
    """Return for each run of steps whether there is a reason to be at rest, and the required dwell, seconds.

    least: corners of more radians are a reason. Where the tool turns, the legs may have a corner though the path of the
    tilt centre has none: it counts where the toolpath turns by as much as a motion of two points of the tool, and the
    program's legs leave the rest in another direction than they came.
    """
    path, match = replay.toolpath, replay.match
    arc = arc_length(path.tilt_centres)
    arcs, within = match.arcs[::2], replay.match_radius
    low, high = arcs[runs[:, 0]] - within, arcs[np.minimum(runs[:, 1], len(arcs) - 1)] + within
    ends = arc[path.starts]
    reasons = np.searchsorted(ends, high, "right") > np.searchsorted(ends, low, "left")
    behind = np.searchsorted(arc, high, "right")
    first = np.minimum(np.searchsorted(arc, low, "left"), behind)
    # Turning of the path, of its direction and its axis, summed up to each waypoint.
    turned = _turning(path.tilt_centres) + np.append(
        np.zeros(2), np.cumsum(angle_between(path.axes[:-1], path.axes[1:]))
    )
    reasons |= turned[behind] - turned[first] > least
    above = path.tilt_centres + (replay.machine.tool_length - path.tilt_centre) * path.axes
    turned = _turning(np.concatenate([path.tilt_centres, above], axis=1))
    reasons |= (turned[behind] - turned[first] > least) & (_turns_at_rest(replay, runs) > least)
    dwell = np.zeros(len(runs))
    for begin, end, seconds in required_stops(replay):
        dwell += np.where((runs[:, 0] < end) & (runs[:, 1] > begin), seconds, 0.0)
    return np.asarray(reasons), dwell


def _turning(points: Floats) -> Floats:
    """Return the angles by which a polyline through points (N, K) turns, summed before each, and over all (N + 1,)."""
    step = np.diff(points, axis=0)
    at = np.flatnonzero(np.linalg.norm(step, axis=1) > 0.0)
    directions = step[at] / np.linalg.norm(step[at], axis=1, keepdims=True)
    corner = np.zeros(len(points))
    corner[at[1:]] = _angles(directions[:-1], directions[1:])
    return np.append(0.0, np.cumsum(corner))


def _turns_at_rest(replay: Replay, runs: Ints) -> Floats:
    """Return for each run of steps the angle between the ways in which the legs come to rest there and go on, radians.

    Ways are chords of the path tolerance or a little more in the space of leg lengths; 0 where the program has none.
    """
    legs, turns = replay.program.legs, np.zeros(len(runs))
    for k, (begin, end) in enumerate(runs.tolist()):
        came, goes = _way(legs[begin::-1], replay.path_tolerance), _way(legs[end:], replay.path_tolerance)
        if came is not None and goes is not None:
            turns[k] = _angles(-came[None], goes[None])[0]
    return turns


def _way(legs: Floats, length: float) -> Floats | None:
    """Return the direction (K,) from the first of rows (N, K) to the next that is so far from it; None without one."""
    for part in blocks(len(legs), 64):
        chords = legs[part] - legs[0]
        far = np.linalg.norm(chords, axis=1)
        if (far >= length).any():
            row = int(np.argmax(far >= length))
            return chords[row] / far[row]
    return None


def _angles(a: Floats, b: Floats) -> Floats:
    """Return the angles between unit vectors (N, K), radians, accurate at 0 and at π."""
    return 2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))


CLAIMS = (
    Claim("lowest feed", lowest_feed),
    Claim("no unasked stop", unasked_stop),
)
