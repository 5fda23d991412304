"""Diagnosis of a deviation from the toolpath: a constant offset, of the tool length or of the part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, row_lengths
from pentapod.verify.replay.claim import MM, with_allowance
from pentapod.verify.replay.path_matching import points_at
from pentapod.verify.replay.replay import Replay

SMALLEST_SHARE = 0.1
"""Share of the path tolerance: an offset that is smaller explains nothing."""


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
    if np.linalg.norm(first) < SMALLEST_SHARE * replay.path_tolerance:
        return None
    along = float(first @ replay.axes[0])
    if (distances := _distances_without(replay, along * replay.axes[:])) is not None:
        which = "longer" if along > 0.0 else "shorter"
        length = f"a tool that is {MM * abs(along):.3f} mm {which} than the job's"
        return Offset(f"the program seems to be made for {length}", distances)
    if (distances := _distances_without(replay, first)) is not None:
        x, y, z = np.round(MM * replay.program.placement.rotate(first), 3) + 0.0  # no −0
        offset = f"a part that is [{x:.3f}, {y:.3f}, {z:.3f}] mm elsewhere in the machine frame"
        return Offset(f"the program seems to be made for {offset}", distances)
    return None


def _distances_without(replay: Replay, offset: Floats) -> Floats | None:
    """Return the distances (M,) of the tilt centres from the places that are matched without an offset, metres.

    offset (3,) or (M, 3): metres. None where the program is beyond the tolerance without it as well.
    """
    points, allowed = replay.toolpath.tilt_centres, with_allowance(replay.path_tolerance)
    tilt_centres = replay.tilt_centres[:] - offset
    if np.linalg.norm(tilt_centres[-1] - points[-1]) > allowed:
        return None  # before the long computation
    found = replay.matched(tilt_centres)
    if found.distances.max() > allowed or found.waypoint_distances.max() > allowed:
        return None
    return row_lengths(replay.tilt_centres[:] - points_at(points, found.places))
