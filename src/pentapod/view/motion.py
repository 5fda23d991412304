"""Motion along a toolpath without a program, so that a refused job can be played, too."""

from __future__ import annotations

from typing import Any

import numpy as np

from pentapod.machine.machine import Machine
from pentapod.planning import PlacedPath
from pentapod.report.drawings.colours import OTHER_COLOUR, RAMP
from pentapod.report.pack import Packed
from pentapod.report.page.causes import OTHER
from pentapod.report.page.keys import MARGIN_SCALE, SEGMENT_KINDS, Moments, legs_beside

SHORTEST_S = 1e-6
"""Least seconds from a waypoint to the next."""

TIME_STEP_S = 1e-3


def toolpath_motion(packed: Packed, placed: PlacedPath, machine: Machine) -> dict[str, Any]:
    """Add the arrays of the motion along a path at its feeds, without acceleration limits, and return the rest."""
    toolpath, (beside, joints) = placed.toolpath, legs_beside(machine, placed.tips, placed.axes)
    way = np.linalg.norm(np.diff(toolpath.tips, axis=0), axis=1)
    feeds = np.array([min(segment.feed, machine.rapid_velocity) for segment in toolpath.segments])
    segments = toolpath.segment_of_interval
    times = np.concatenate([[0.0], np.cumsum(np.maximum(way / feeds[segments], SHORTEST_S))])
    margins, segments = placed.margins.min(axis=1), np.append(segments, segments[-1])
    kinds = np.array([SEGMENT_KINDS.index(segment.kind) for segment in toolpath.segments])
    Moments(
        times, placed.tips, placed.axes, beside, joints, margins, placed.margins.argmin(axis=1),
        np.zeros(len(times), dtype=np.intp), segments, kinds[segments],
    ).pack(packed, TIME_STEP_S)  # fmt: skip
    return {
        "start": float(times[int(margins.argmin())]),
        "ramp": RAMP,
        "causes": [{"name": "feed; there is no time law", "kind": 0}],
        "kinds": [{"name": OTHER, "colour": OTHER_COLOUR, "seconds": float(times[-1]), "told": ""}],
        "kind_names": [kind.value for kind in SEGMENT_KINDS],
        "margins": placed.margin_names,
        "scales": [MARGIN_SCALE],
    }
