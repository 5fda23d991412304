"""Claims about where the tool goes: deviation from the toolpath, both ways, and of the axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pentapod.verify.claim import ALLOWANCE, Claim, Finding
from pentapod.verify.replay import Replay, at_samples, excursion


def tip_deviation(replay: Replay) -> Finding:
    """Judge how far the program strays from the toolpath.

    The tool may tilt about the pivot, which stays on its own path then. So it is the pivot that is compared:
    its deviation is that of the tip once the tool is turned back to the nominal axis.
    """
    stray = at_samples(np.linalg.norm(excursion(replay.pivots), axis=1))
    deviation = replay.match.distances + stray
    worst = int(np.argmax(deviation))
    method = (
        "closed-form forward kinematics at the rows and halfway between, of the point "
        f"{1e3 * replay.toolpath.pivot:g} mm from the tip along the axis, about which the tool may tilt: the "
        "tip's deviation once the tool is turned back to the nominal axis; against the matched place of the "
        "toolpath, in order. For the time between samples a quarter of the second difference is added (here "
        f"{1e6 * stray[worst]:.2g} µm): estimated with a margin, not proven"
    )
    return _within(replay, float(deviation[worst]), worst, method)


def coverage(replay: Replay) -> Finding:
    """Judge that the program passes every waypoint, in the order of the toolpath."""
    match = replay.match
    stray = at_samples(np.linalg.norm(excursion(replay.pivots), axis=1))
    chord = np.minimum(match.times.astype(np.intp), len(stray) - 2)
    distance = match.waypoint_distances + np.maximum(stray[chord], stray[chord + 1])
    worst = int(np.argmax(distance))
    far = int((distance > replay.path_tolerance * (1.0 + ALLOWANCE)).sum())
    method = (
        f"distance of each of the {len(distance)} waypoints' pivots to the program at the time it is "
        f"visited, times in order; farthest: waypoint {worst}"
    )
    if far:
        method += f"; {far} waypoints are not reached"
    found = _within(replay, float(distance[worst]), float(match.times[worst]), method)
    segment = int(replay.toolpath.segment_of_interval[min(worst, len(distance) - 2)])
    return replace(found, where=replace(found.where, segment=segment))


def axis_deviation(replay: Replay) -> Finding:
    """Judge the angle between the tool and the nominal axis of the toolpath."""
    match = replay.match
    stray = at_samples(np.linalg.norm(excursion(replay.axes), axis=1))
    at_sample = match.angles + stray
    worst, worst_waypoint = int(np.argmax(at_sample)), int(np.argmax(match.waypoint_angles))
    value, sample = float(at_sample[worst]), float(worst)
    if match.waypoint_angles[worst_waypoint] > value:
        value, sample = float(match.waypoint_angles[worst_waypoint]), float(match.times[worst_waypoint])
    bound = replay.tilt + replay.axis_tolerance
    method = (
        "angle to the nominal axis at the matched place (along great circles between waypoints), at the "
        "rows, halfway between and at the waypoints; allowed: tilt cone "
        f"{np.degrees(replay.tilt):g} deg and tolerance {np.degrees(replay.axis_tolerance):g} deg"
    )
    passed = value <= bound + ALLOWANCE * replay.axis_tolerance
    return Finding(passed, np.degrees(value), np.degrees(bound), "deg", replay.place(sample), method)


def start(replay: Replay) -> Finding:
    """Judge that the program begins where the toolpath begins."""
    distance = float(np.linalg.norm(replay.pivots[0] - replay.toolpath.pivots[0]))
    return _within(replay, distance, 0, "pivot of the first row to that of the first waypoint")


def end(replay: Replay) -> Finding:
    """Judge that the program ends where the toolpath ends."""
    distance = float(np.linalg.norm(replay.pivots[-1] - replay.toolpath.pivots[-1]))
    return _within(replay, distance, len(replay.pivots) - 1, "pivot of the last row to that of the last waypoint")


def _within(replay: Replay, value: float, sample: float, method: str) -> Finding:
    bound = replay.path_tolerance
    passed = value <= bound * (1.0 + ALLOWANCE)
    return Finding(passed, 1e3 * value, 1e3 * bound, "mm", replay.place(sample), method)


CLAIMS = (
    Claim("tip deviation", tip_deviation),
    Claim("axis deviation", axis_deviation),
    Claim("toolpath covered", coverage),
    Claim("starts at the toolpath's start", start),
    Claim("ends at the toolpath's end", end),
)
