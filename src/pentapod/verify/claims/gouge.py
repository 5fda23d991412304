"""Claims that the cutter does not cut into the finished part: proven for all times, from the replayed poses."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from pentapod.base.arrays import Bools
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.solids import Solid
from pentapod.mesh.query.distance import MeshDistance
from pentapod.toolpath.toolpath import SegmentKind
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.gouge_bounds import Immersion, immersion
from pentapod.verify.replay.replay import Replay

_THICK = 0.9
"""Of the cutter's thickness: up to this depth a mesh point inside it is judged where the cutter is."""


def gouge(replay: Replay, *, rapid: bool) -> Finding | Idle:
    """Judge how deep the cutter is in the part: on rapids, or on cuts and links."""
    cutting = replay.specification.cutting
    if cutting is None:
        return Idle("no part's mesh to compare with", unknown=True)
    if not cutting.cutter:
        return Idle("the tool has no cutting part")
    chords = rapid_chords(replay) if rapid else ~rapid_chords(replay)
    if not chords.any():
        return Idle(f"no moment belongs to {'a rapid' if rapid else 'a cut or a link'}")
    allowed = 0.0 if rapid else cutting.depth
    bound = allowed + replay.path_tolerance
    thickness = max(solid.thickness for solid in cutting.cutter)
    # No mesh point is deeper in a cutter than it is thick. So it is raised along its axis until what is left to be
    # allowed is less: moved by so much, it can be deeper by no more than that.
    rise = max(bound - _THICK * thickness, 0.0)
    cutter = tuple(replace(solid, low=solid.low + rise, high=solid.high + rise) for solid in cutting.cutter)
    found = immersion(replay, cutting.surface, cutter, chords, bound=bound - rise)
    most, inside = found.most + rise, begins_inside(replay, cutting.surface, cutter)
    passed = most <= bound
    if passed and inside:
        return Finding(False, None, MM * bound, "mm", replay.place(0), "the cutter begins inside the part")
    method = _method(found, rise) + f"; allowed: {MM * replay.path_tolerance:g} mm off the toolpath"
    if not rapid:
        method += f", and {MM * cutting.depth:g} mm that count as none or are engraved"
    return Finding(passed, MM * most, MM * bound, "mm", replay.place(found.sample), method)


def _method(found: Immersion, rise: float) -> str:
    raised = f" ({MM * rise:g} mm, and what the cutter has when it is raised by them along its axis)" if rise else ""
    if found.met:
        return f"this deep is the cutter in the part at this moment{raised}; others may be worse"
    if not np.isfinite(found.most):
        return "not proven: the tool turns too far within half a period"
    deep = rise > 0.0 or found.most > 0.0
    what = "deepest mesh point inside the cutter" if deep else "smallest gap of the cutter (negative)"
    return (
        f"proven bound for all times of the {what}{raised}: swept exactly along straight stretches of the replayed "
        "motion, with what that strays from them"
    )


def rapid_chords(replay: Replay) -> Bools:
    """Return which chords (M − 1,) are rapids; within the path tolerance of a cut or a link they are not."""
    toolpath, arcs = replay.toolpath, replay.match.arcs
    ends = arc_length(toolpath.tilt_centres)[toolpath.starts]
    other = np.array([segment.kind is not SegmentKind.RAPID for segment in toolpath.segments])
    before = np.concatenate([[0], np.cumsum(other)])
    first = np.searchsorted(ends[1:], arcs[:-1] - replay.path_tolerance, side="left")
    behind = np.minimum(np.searchsorted(ends, arcs[1:] + replay.path_tolerance, side="right"), len(other))
    return np.asarray(before[behind] == before[first])


def begins_inside(replay: Replay, surface: MeshDistance, cutter: tuple[Solid, ...]) -> bool:
    """Return whether the cutter begins wholly inside: what never meets the surface stays on its side."""
    top = max(solid.top for solid in cutter) - replay.toolpath.tilt_centre
    return bool(surface.contains(replay.tilt_centres[:1] + top * replay.axes[:1]).any())


CLAIMS = (
    Claim("gouge on cuts and links", partial(gouge, rapid=False), needs_proof=True),
    Claim("gouge on rapids", partial(gouge, rapid=True), needs_proof=True),
)
