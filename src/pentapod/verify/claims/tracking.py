"""Claims about where the tool goes: deviation from the toolpath, both ways, and of the axis. Proven for all times.

Between two neighbouring events (a sample, or a waypoint's visit) the chord between the samples and the toolpath are
both straight, so that their distance is at most the larger one of both events; and how far the motion strays from the
chord is proven (`pentapod.kinematics.proofs.chords`). The sum bounds the deviation at every time in between.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.directions import angle_between
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.claim import ALLOWANCE, MM, Claim, Finding, with_allowance
from pentapod.verify.replay.constant_offset import constant_offset
from pentapod.verify.replay.replay import Replay

_BLOCK = 1 << 15  # samples


def tip_deviation(replay: Replay) -> Finding:
    """Judge how far the program strays from the toolpath.

    The tool may tilt about the tilt centre, which stays on its own path then. So it is the tilt centre that is
    compared: its deviation is that of the tip once the tool is turned back to the nominal axis.
    """
    stray = at_samples(replay.interval_bounds.away)
    deviation, offset = replay.match.distances + stray, None
    if deviation.max() > with_allowance(replay.path_tolerance):
        offset = constant_offset(replay)
        if offset is not None and (offset.distances + stray).max() < deviation.max():
            deviation = offset.distances + stray
    worst = int(np.argmax(deviation))
    method = (
        "proven bound for all times, of the point "
        f"{MM * replay.toolpath.tilt_centre:g} mm from the tip along the axis, about which the tool may tilt: the "
        "tip's deviation once the tool is turned back to the nominal axis; closed-form forward kinematics at the rows "
        "and halfway between, against the matched place of the toolpath, in order; how far the motion strays from the "
        f"chord in between is proven by Krawczyk's operator (here {1e6 * stray[worst]:.2g} µm); at the toolpath's "
        'corners the claim "toolpath covered" says the rest'
    )
    if offset is not None:
        method = f"{offset.cause}: without that it is within the tolerance; {method}"
    return _within(replay, float(deviation[worst]), worst, method)


def coverage(replay: Replay) -> Finding:
    """Judge that the program passes every waypoint, in the order of the toolpath."""
    match, away = replay.match, replay.interval_bounds.away
    chord = np.minimum(match.times.astype(np.intp), len(away) - 1)
    distance = match.waypoint_distances + away[chord]
    worst = int(np.argmax(distance))
    far = int((distance > with_allowance(replay.path_tolerance)).sum())
    method = (
        f"proven bound of the distance of each of the {len(distance)} waypoints' tilt centres to the program at the "
        f"time it is visited, times in order; farthest: waypoint {worst}"
    )
    if far:
        method += f"; {far} waypoints are not reached"
    found = _within(replay, float(distance[worst]), float(match.times[worst]), method)
    segment = int(replay.toolpath.segment_of_interval[min(worst, len(distance) - 2)])
    return replace(found, where=replace(found.where, segment=segment))


def axis_deviation(replay: Replay) -> Finding:
    """Judge the angle between the tool and the nominal axis of the toolpath."""
    match, before, after = replay.match, replay.axes[:-1], replay.axes[1:]
    own = np.empty(len(before))
    for part in blocks(len(own), _BLOCK):
        own[part] = angle_between(before[part], after[part])
    # Vectors that go straight from end to end are farthest apart at an end, and as far off the arc of unit vectors as
    # it is high: an eighth of the angle squared. At a waypoint's visit the motion's own is off the arc already.
    # Along the arc they lag behind by less than a fiftieth of the angle cubed (lemma 14 of docs/proofs.md).
    rise = 0.25 * own**2 + 0.125 * replay.chord_arcs**2 + replay.chord_arcs**3 / 50.0
    stray = replay.interval_bounds.turned
    at_sample = angle_bound(match.angles, at_samples(rise), at_samples(stray))
    chord = np.minimum(match.times.astype(np.intp), len(stray) - 1)
    at_waypoint = angle_bound(match.waypoint_angles, rise[chord], stray[chord])
    worst, worst_waypoint = int(np.argmax(at_sample)), int(np.argmax(at_waypoint))
    value, sample = float(at_sample[worst]), float(worst)
    if at_waypoint[worst_waypoint] > value:
        value, sample = float(at_waypoint[worst_waypoint]), float(match.times[worst_waypoint])
    bound = replay.tilt + replay.axis_tolerance
    method = (
        "proven bound for all times of the angle to the nominal axis at the matched place (along great circles between "
        "waypoints): at the rows, halfway between and at the waypoints, with what both turn in between; allowed: tilt "
        f"cone {np.degrees(replay.tilt):g} deg and tolerance {np.degrees(replay.axis_tolerance):g} deg"
    )
    allowed = bound + ALLOWANCE * replay.axis_tolerance
    told = (np.degrees(value), np.degrees(bound), "deg", replay.place(sample), method, np.degrees(allowed))
    return Finding(value <= allowed, *told)


def start(replay: Replay) -> Finding:
    """Judge that the program begins where the toolpath begins."""
    distance = float(np.linalg.norm(replay.tilt_centres[0] - replay.toolpath.tilt_centres[0]))
    return _within(replay, distance, 0, "tilt centre of the first row to that of the first waypoint")


def end(replay: Replay) -> Finding:
    """Judge that the program ends where the toolpath ends."""
    distance = float(np.linalg.norm(replay.tilt_centres[-1] - replay.toolpath.tilt_centres[-1]))
    return _within(
        replay, distance, len(replay.tilt_centres) - 1, "tilt centre of the last row to that of the last waypoint"
    )


def at_samples(chords: Floats) -> Floats:
    """Return for each sample (M,) the larger value of the chords (M − 1,) that meet there."""
    return np.maximum(np.append(chords, chords[-1]), np.append(chords[0], chords))


def angle_bound(angles: Floats, rise: Floats, stray: Floats) -> Floats:
    """Return angles that bound those between two samples, radians, from the angles at both.

    rise: by how much the unit vectors may be farther apart in between than straight lines between them are; stray: by
    how much the motion's axis may turn off its chord.
    """
    apart = 2.0 * np.sin(0.5 * angles) + rise
    return 2.0 * np.arcsin(np.minimum(0.5 * apart, 1.0)) + stray


def _within(replay: Replay, value: float, sample: float, method: str) -> Finding:
    bound = replay.path_tolerance
    allowed = with_allowance(bound)
    return Finding(value <= allowed, MM * value, MM * bound, "mm", replay.place(sample), method, MM * allowed)


CLAIMS = (
    Claim("tip deviation", tip_deviation, needs_proof=True),
    Claim("axis deviation", axis_deviation, needs_proof=True),
    Claim("toolpath covered", coverage, needs_proof=True),
    Claim("starts at the toolpath's start", start),
    Claim("ends at the toolpath's end", end),
)
