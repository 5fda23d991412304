"""Claims on the speed of the tool: feed on cuts and links, rapid rate, rest at both ends."""

from __future__ import annotations

from functools import partial

import numpy as np

from pentapod.base.arrays import Floats, Ints, row_lengths
from pentapod.geometry.polyline import arc_length
from pentapod.numerics.blocks import blocks
from pentapod.toolpath.toolpath import SegmentKind
from pentapod.verify.replay.claim import MM, TOLERATED, Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay

MM_MIN = 60e3  # in a metre per second

STEPS_AT_ONCE = 1 << 15
"""Steps from row to row that are judged in one block."""


def feed(replay: Replay, kind: SegmentKind) -> Finding | Idle:
    """Judge the speed on the segments of one kind; idle where the program has no such motion.

    A cutter's feed is the speed of its tip. A stand-off tool works at the tilt centre, on the surface: its feed is the
    speed of that spot, and its tip must not exceed the rapid rate anywhere.
    """
    limit, governing = speed_limits(replay)
    standoff, rapid = replay.toolpath.tilt_centre < 0.0, kind == SegmentKind.RAPID
    kinds = np.array([segment.kind == kind for segment in replay.toolpath.segments])
    chords = np.flatnonzero(kinds[governing])
    if standoff and rapid:
        chords, limit = np.arange(len(governing)), np.full(len(governing), replay.machine.rapid_velocity)
    if not len(chords):
        return Idle(f"the program has no {kind}")
    spot = standoff and not rapid
    linear = replay.program.interpolation == "linear"
    height = replay.toolpath.tilt_centre if spot else 0.0
    bounds = replay.interval_bounds.speeds[:, 1 if spot else 0]
    speed = (np.repeat(row_speeds(replay, height), 2) if linear else bounds)[chords]
    worst = int(np.argmax(speed / limit[chords]))
    value, bound = float(speed[worst]), float(limit[chords[worst]])
    whose = "the spot on the surface" if spot else "the tip"
    which = "on every segment" if standoff and rapid else f"where the matched place of the toolpath is on a {kind}"
    method = (
        f"speed of {whose}, {'mean from row to row' if linear else 'proven bound for all times'}, {which}; within the "
        f"path tolerance of the end of a segment the faster feed of both applies; {TOLERATED}"
    )
    return Finding.at_most(value, bound, MM_MIN, "mm/min", replay.place(int(chords[worst])), method)


def row_speeds(replay: Replay, height: float) -> Floats:
    """Return the mean speed (N − 1,) from row to row of the point at a height above the tip along the axis, m/s.

    With linear interpolation the leg speeds jump at each row, and the speed of the tip varies about its mean within
    each period: an effect of the interpolation, not of the feed.
    """
    (position, direction), along = (pose[::2] for pose in replay.pose), replay.machine.tool_length - height
    made = np.empty(len(position) - 1)
    for part in blocks(len(made), STEPS_AT_ONCE):
        rows = slice(part.start, part.stop + 1)
        made[part] = row_lengths(np.diff(position[rows] + along * direction[rows], axis=0))
    return made / replay.program.period


def speed_limits(replay: Replay) -> tuple[Floats, Ints]:
    """Return the speed limit (M − 1,) in m/s between consecutive samples, and the segment that sets it.

    A chord within the path tolerance of another segment, along the path, may have the faster limit: at a blended corner
    the boundary between two segments is not defined more precisely than that.
    """
    segments, arcs = replay.toolpath.segments, replay.match.arcs
    rapid = replay.machine.rapid_velocity
    limits = np.array([rapid if s.kind == SegmentKind.RAPID else min(s.feed, rapid) for s in segments])
    bounds = arc_length(replay.toolpath.tilt_centres)[replay.toolpath.starts]
    governing = np.empty(len(arcs) - 1, dtype=np.intp)
    for part in blocks(len(governing), STEPS_AT_ONCE):
        low = np.searchsorted(bounds[1:], arcs[part] - replay.match_radius, side="left")
        ends = arcs[part.start + 1 : part.stop + 1]
        high = np.searchsorted(bounds[1:-1], ends + replay.match_radius, side="right")
        fastest = low.copy()
        for step in range(int((high - low).max()) + 1):
            other = np.minimum(low + step, high)
            fastest = np.where(limits[other] > limits[fastest], other, fastest)
        governing[part] = fastest
    return limits[governing], governing


def rest(replay: Replay, *, at_end: bool) -> Finding:
    """Judge that the robot is at rest at one end of the program."""
    rows = replay.program.legs
    step = rows[-1] - rows[-2] if at_end else rows[1] - rows[0]
    period, limit = replay.program.period, replay.machine.legs.max_acceleration
    speed = np.abs(step) / period
    leg = int(np.argmax(speed / limit))
    value, bound = float(speed[leg]), float(limit[leg]) * period
    method = (
        f"speed of leg {leg + 1} over the {'last' if at_end else 'first'} period; the bound is the change of speed at "
        f"its largest acceleration in one period; {TOLERATED}"
    )
    return Finding.at_most(value, bound, MM, "mm/s", replay.place(2 * len(rows) - 2 if at_end else 0), method)


CLAIMS = (
    *(
        Claim(name, partial(feed, kind=kind), needs_proof=True)
        for name, kind in (
            ("feed on cuts", SegmentKind.CUT),
            ("feed on links", SegmentKind.LINK),
            ("rapid rate", SegmentKind.RAPID),
        )
    ),
    Claim("starts at rest", partial(rest, at_end=False), needs_pose=False),
    Claim("ends at rest", partial(rest, at_end=True), needs_pose=False),
)
