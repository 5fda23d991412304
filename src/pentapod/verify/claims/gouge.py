"""Claims that the cutter does not gouge the finished part: proven for all times, from the replayed poses."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from pentapod.base.arrays import Bools
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.solids import Solid
from pentapod.mesh.query.distance import MeshDistance
from pentapod.numerics.blocks import blocks
from pentapod.toolpath.toolpath import SegmentKind
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.gouge_bounds import GougeBound, gouge_bound
from pentapod.verify.replay.replay import Replay
from pentapod.verify.replay.row_forces import ROWS_AT_ONCE

THICKNESS_SHARE = 0.9
"""Share of the cutter's thickness: deeper gouges are judged on the cutter raised along its axis."""


def gouge(replay: Replay, *, rapid: bool) -> Finding | Idle:
    """Judge the depth of the cutter in the part: on rapids, or on cuts and links."""
    cutting = replay.specification.cutting
    if cutting is None:
        return Idle("the mesh of the part is not given", unknown=True)
    if not cutting.cutter:
        return Idle("the tool has no cutting part")
    chords = rapid_chords(replay) if rapid else ~rapid_chords(replay)
    if not chords.any():
        return Idle("the program has no rapid" if rapid else "the program has no cut and no link")
    allowed = 0.0 if rapid else cutting.depth
    bound = allowed + replay.path_tolerance
    thickness = max(solid.thickness for solid in cutting.cutter)
    # No mesh point is deeper in a cutter than the cutter is thick. So where more is allowed the cutter is raised along
    # its axis, until less is left to be judged: its true position can be deeper by no more than the rise.
    rise = max(bound - THICKNESS_SHARE * thickness, 0.0)
    cutter = tuple(replace(solid, low=solid.low + rise, high=solid.high + rise) for solid in cutting.cutter)
    found = gouge_bound(replay, cutting.surface, cutter, chords, bound=bound - rise)
    most, inside = found.depth + rise, begins_inside(replay, cutting.surface, cutter)
    passed = most <= bound
    if passed and inside:
        return Finding(False, None, MM * bound, "mm", replay.place(0), "the cutter is inside the part at the start")
    method = _method(found, rise) + f"; allowed: {MM * replay.path_tolerance:g} mm of path tolerance"
    if not rapid:
        method += f" and {MM * cutting.depth:g} mm of engraving depth or gouge tolerance"
    return Finding(passed, MM * most, MM * bound, "mm", replay.place(found.sample), method)


def _method(found: GougeBound, rise: float) -> str:
    raised = f" ({MM * rise:g} mm plus the depth of the cutter raised by as much along its axis)" if rise else ""
    if found.attained:
        return f"depth of the cutter in the part at this moment{raised}; it may be deeper elsewhere"
    if not np.isfinite(found.depth):
        return "not proven: the tool turns too far within half a period"
    deep = rise > 0.0 or found.depth > 0.0
    what = "depth of the deepest mesh point inside the cutter" if deep else "smallest gap of the cutter (negative)"
    return (
        f"proven bound for all times on the {what}{raised}: exact sweep along straight stretches of the replayed "
        "motion, plus the deviation of the motion from them"
    )


def rapid_chords(replay: Replay) -> Bools:
    """Return which chords (M − 1,) are rapids, and not within the path tolerance of a cut or a link."""
    toolpath, arcs = replay.toolpath, replay.match.arcs
    ends = arc_length(toolpath.tilt_centres)[toolpath.starts]
    other = np.array([segment.kind is not SegmentKind.RAPID for segment in toolpath.segments])
    before = np.concatenate([[0], np.cumsum(other)])
    found = np.empty(len(arcs) - 1, dtype=np.bool_)
    for part in blocks(len(found), ROWS_AT_ONCE):
        first = np.searchsorted(ends[1:], arcs[part] - replay.match_radius, side="left")
        last = arcs[part.start + 1 : part.stop + 1] + replay.match_radius
        behind = np.minimum(np.searchsorted(ends, last, side="right"), len(other))
        found[part] = before[behind] == before[first]
    return found


def begins_inside(replay: Replay, surface: MeshDistance, cutter: tuple[Solid, ...]) -> bool:
    """Return whether the cutter is inside at the start: what never meets the surface stays on its side of it."""
    top = max(solid.top for solid in cutter) - replay.toolpath.tilt_centre
    return bool(surface.contains(replay.tilt_centres[:1] + top * replay.axes[:1]).any())


CLAIMS = (
    Claim("gouge on cuts and links", partial(gouge, rapid=False), needs_proof=True),
    Claim("gouge on rapids", partial(gouge, rapid=True), needs_proof=True),
)
