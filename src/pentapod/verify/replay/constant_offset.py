"""A likely cause of a deviation from the toolpath: the same offset everywhere, of the tool's length or of the part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.verify.replay.claim import MM, with_allowance
from pentapod.verify.replay.free_space import PosedPolyline
from pentapod.verify.replay.path_matching import PathMatch, match
from pentapod.verify.replay.replay import Replay

_LEAST = 0.1
"""Of the path tolerance: an offset that is smaller explains nothing."""


@dataclass(frozen=True, eq=False)
class Offset:
    """cause: in words. distances (M,): of the samples' tilt centres from their places on the toolpath, metres."""

    cause: str
    distances: Floats


def constant_offset(replay: Replay) -> Offset | None:
    """Return the offset without which a program is within the tolerance; None where there is no such offset.

    Along the tool, or of the part. It is taken from the first row, where every program should be on the toolpath.
    """
    first = replay.tilt_centres[0] - replay.toolpath.tilt_centres[0]
    if np.linalg.norm(first) < _LEAST * replay.path_tolerance:
        return None
    along = float(first @ replay.axes[0])
    if (found := _without(replay, along * replay.axes)) is not None:
        which = "longer" if along > 0.0 else "shorter"
        cause = f"as if the program were made for a tool {MM * abs(along):.3f} mm {which} than the job's"
        return Offset(cause, _distances(replay, found))
    if (found := _without(replay, first)) is not None:
        x, y, z = np.round(MM * replay.program.placement.rotate(first), 3) + 0.0  # no −0
        cause = f"as if the part stood [{x:.3f}, {y:.3f}, {z:.3f}] mm elsewhere in the machine frame"
        return Offset(cause, _distances(replay, found))
    return None


def _without(replay: Replay, offset: Floats) -> PathMatch | None:
    """Return the matching of the tilt centres without an offset, (3,) or (M, 3) metres; None where it is not within."""
    toolpath, away = replay.toolpath, replay.interval_bounds.away
    tilt_centres, allowed = replay.tilt_centres - offset, with_allowance(replay.path_tolerance)
    if np.linalg.norm(tilt_centres[-1] - toolpath.tilt_centres[-1]) > allowed:
        return None  # the long work is spared
    program = PosedPolyline(tilt_centres, replay.axes)
    path = PosedPolyline(toolpath.tilt_centres, toolpath.axes)
    bound = replay.tilt + replay.axis_tolerance
    found = match(program, path, replay.path_tolerance, axis_bound=bound, away=away)
    within = found.distances.max() <= allowed and found.waypoint_distances.max() <= allowed
    return found if within else None


def _distances(replay: Replay, found: PathMatch) -> Floats:
    """Return how far (M,) the tilt centres are from their places by a matching, metres."""
    points = replay.toolpath.tilt_centres
    k = np.minimum(found.places.astype(np.intp), len(points) - 2)
    share = (found.places - k)[:, None]
    return np.linalg.norm(replay.tilt_centres - ((1.0 - share) * points[k] + share * points[k + 1]), axis=1)
