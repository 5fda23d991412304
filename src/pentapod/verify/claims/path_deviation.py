"""Claims on the deviation from the toolpath: of the tip, of the axis, and of the waypoints from the program.

Proven for all times. Between two neighbouring events (a sample, or the time of a waypoint) the chord between the
samples and the toolpath are both straight, so their distance is at most the larger of the distances at both events; and
the deviation of the motion from the chord has a proven bound (`pentapod.kinematics.proofs.chords`). The sum bounds the
deviation at every time in between.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.directions import angle_between
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.claim import ALLOWANCE, DEG, MM, Claim, Finding, with_allowance
from pentapod.verify.replay.constant_offset import constant_offset
from pentapod.verify.replay.replay import Replay

CHORDS_AT_ONCE = 1 << 15
"""Chords whose axes are judged together, so that a long program does not fill the memory."""


def tip_deviation(replay: Replay) -> Finding:
    """Judge the deviation of the program from the toolpath.

    The tilt centres are compared, because the tool may tilt about them: their deviation is that of the tip once the
    tool is turned back to the nominal axis.
    """
    between, offset = at_samples(replay.interval_bounds.deviations), None
    deviation = replay.match.distances + between
    if deviation.max() > with_allowance(replay.path_tolerance):
        offset = constant_offset(replay)
        if offset is not None and (offset.distances + between).max() < deviation.max():
            deviation = offset.distances + between
    worst = int(np.argmax(deviation))
    method = (
        f"proven bound for all times, of the tilt centre, {MM * replay.toolpath.tilt_centre:g} mm from the tip along "
        "the axis (the deviation of the tip once the tool is turned back to the nominal axis): forward kinematics "
        "at the rows and halfway between, compared with the matched place of the toolpath; plus the deviation of "
        f"the motion from the chord in between, by the Krawczyk operator (here {1e6 * between[worst]:.2g} µm); for "
        'corners of the toolpath see the claim "toolpath covered"'
    )
    if offset is not None:
        method = f"{offset.cause}: without this offset it is within the tolerance; {method}"
    return _within(replay, float(deviation[worst]), worst, method)


def coverage(replay: Replay) -> Finding:
    """Judge that the program passes every waypoint within the tolerance, in the order of the toolpath."""
    match, deviations = replay.match, replay.interval_bounds.deviations
    chord = np.minimum(match.times.astype(np.intp), len(deviations) - 1)
    distance = match.waypoint_distances + deviations[chord]
    worst = int(np.argmax(distance))
    missed = int((distance > with_allowance(replay.path_tolerance)).sum())
    method = (
        f"proven bound on the distance of the tilt centre of each of the {len(distance)} waypoints from the program at "
        f"the time when it is passed, in order; farthest: waypoint {worst}"
    )
    if missed:
        method += f"; {missed} waypoints are not reached"
    found = _within(replay, float(distance[worst]), float(match.times[worst]), method)
    segment = int(replay.toolpath.segment_of_interval[min(worst, len(distance) - 2)])
    return replace(found, where=replace(found.where, segment=segment))


def axis_deviation(replay: Replay) -> Finding:
    """Judge the angle between the tool and the nominal axis of the toolpath."""
    parts = blocks(len(replay.axes) - 1, CHORDS_AT_ONCE)
    found = np.array([_farthest_axis(replay, part.start, part.stop) for part in parts])
    value, sample = found[int(np.argmax(found[:, 0]))].tolist()
    tilt, tolerance = replay.specification.tilt, replay.specification.axis_tolerance
    method = (
        "proven bound for all times on the angle to the nominal axis at the matched place (on great circles between "
        "waypoints): at the rows, halfway between and at the waypoints, plus the rotation of both in between; allowed: "
        f"tilt cone {np.degrees(tilt):g} deg and tolerance {np.degrees(tolerance):g} deg"
    )
    bound = tilt + tolerance
    allowed = bound + ALLOWANCE * tolerance
    return Finding.at_most(value, bound, DEG, "deg", replay.place(sample), method, allowed)


def _farthest_axis(replay: Replay, first: int, last: int) -> tuple[float, float]:
    """Return a bound on the angle to the path's axis from sample `first` to `last`, and the sample of the largest."""
    match, chords, samples = replay.match, slice(first, last), slice(first, last + 1)
    # Events: samples, and waypoints at their times. Between two of them the path turns on one arc.
    waypoints = slice(int(np.searchsorted(match.times, first)), int(np.searchsorted(match.times, last, "right")))
    times = np.concatenate([np.arange(first, last + 1), match.times[waypoints]])
    turned = np.concatenate([match.turned[samples], match.waypoint_turned[waypoints]])
    order = np.lexsort((turned, times))
    if last < len(replay.axes) - 1:  # steps at the time of the last sample belong to the chord behind it
        order = order[: int(np.searchsorted(times[order], last)) + 1]
    times, path = times[order], np.diff(turned[order])
    angles = np.concatenate([match.angles[samples], match.waypoint_angles[waypoints]])[order]
    chord = np.minimum(times[:-1].astype(np.intp), last - 1) - first
    own = angle_between(replay.axes[samples][:-1], replay.axes[samples][1:])[chord]
    # Straight lines between vectors are farthest apart at an end. Their distance from the arc of unit vectors is at
    # most its height: an eighth of the angle squared. At the time of a waypoint the motion's vector is off the arc too.
    # Along the arc they lag behind by less than a fiftieth of the angle cubed (lemma 14 of docs/proofs.md).
    rise = 0.25 * own**2 + 0.125 * path**2 + path**3 / 50.0
    bounds = angle_bound(angles, at_samples(rise), at_samples(replay.interval_bounds.axis_deviations[chords][chord]))
    worst = int(np.argmax(bounds))
    return float(bounds[worst]), float(times[worst])


def start(replay: Replay) -> Finding:
    """Judge that the program begins where the toolpath begins."""
    distance = float(np.linalg.norm(replay.tilt_centres[0] - replay.toolpath.tilt_centres[0]))
    return _within(replay, distance, 0, "distance of the tilt centre of the first row from that of the first waypoint")


def end(replay: Replay) -> Finding:
    """Judge that the program ends where the toolpath ends."""
    distance = float(np.linalg.norm(replay.tilt_centres[-1] - replay.toolpath.tilt_centres[-1]))
    method = "distance of the tilt centre of the last row from that of the last waypoint"
    return _within(replay, distance, len(replay.tilt_centres) - 1, method)


def at_samples(chords: Floats) -> Floats:
    """Return for each sample (M,) the larger value of the chords (M − 1,) that meet there."""
    larger = np.append(chords, chords[-1])
    np.maximum(larger[1:], chords, out=larger[1:])
    return larger


def angle_bound(angles: Floats, rise: Floats, deviation: Floats) -> Floats:
    """Return upper bounds on the angles between two samples, radians, from the angles at both.

    rise: by how much the unit vectors may be farther apart in between than straight lines between them. deviation: of
    the motion's axis from its chord.
    """
    apart = 2.0 * np.sin(0.5 * angles) + rise
    return 2.0 * np.arcsin(np.minimum(0.5 * apart, 1.0)) + deviation


def _within(replay: Replay, value: float, sample: float, method: str) -> Finding:
    return Finding.at_most(value, replay.path_tolerance, MM, "mm", replay.place(sample), method)


CLAIMS = (
    Claim("tip deviation", tip_deviation, needs_proof=True),
    Claim("axis deviation", axis_deviation, needs_proof=True),
    Claim("toolpath covered", coverage, needs_proof=True),
    Claim("starts at the toolpath's start", start),
    Claim("ends at the toolpath's end", end),
)
