"""Claim that nothing is left on the region: from where the cutter of the replayed program has been.

The region is cut into cells until each is proven covered: at the height that may be left, above every point of the
cell, one and the same piece of the sweep has been, which is convex. Cells for which that cannot be shown are halved
until they are small; then their middle decides. How much that is, is told.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.solids import Solid
from pentapod.mesh.patch import Patch
from pentapod.toolpath.toolpath import SegmentKind
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay
from pentapod.verify.surface.reachable import ball_reaches, body_reaches
from pentapod.verify.surface.swept_cutter import SweptSolid
from pentapod.verify.verdict.coverage import Coverage
from pentapod.verify.verdict.cutting import Cutting

_COARSE, _HALVINGS = 0.25, 8.0
"""Size of the first cells as a share of what one place of the cutter covers, and how much smaller the last may be."""
_MOST_CELLS = 4e5
"""No cell is asked to be smaller than so many of them would be."""
_NEAR_M, _NEAR = 1e-6, 0.01
"""A stretch counts as straight where the motion is this near, or within this share of what may be left."""
_LOOKED_AT, _LOOKED_AT_BODIES = 2048, 256
"""So many cells that are left are asked whether the cutter could reach them, each for its share of the area."""
_FAR = 4.0
"""Radii of the cutter along a normal after which nothing is looked for any more."""
_ABOVE_M = 1e-5


@dataclass(frozen=True, eq=False)
class _Left:
    """What is left on a region.

    Areas, square metres: missed, where the tool could have been; beyond, where it could not; between, where it is shown
    at the middles of cells alone that no more is left. cell: how wide those are at most, metres.
    deepest: metres that are left at most along the normal, where the tool could have been, looked for up to `far`;
    place (3,): where. gap: how far the cutter stays at most from where it could have been, 0 where nothing is missed.
    """

    missed: float
    beyond: float
    between: float
    cell: float
    deepest: float
    place: Floats
    gap: float
    far: float


def surface_left(replay: Replay) -> Finding | Idle:
    """Judge on how much of the region more is left than the job allows, although the tool could have been there."""
    cutting = replay.specification.cutting
    coverage = None if cutting is None else cutting.coverage
    if cutting is None or coverage is None:
        return Idle("nobody says which surface is to be machined", unknown=True)
    piece = replay.program.provenance.piece
    if piece is not None:
        coverage = coverage.of_piece(piece)
    if coverage.region is None:
        return Idle(coverage.why)
    area = float(coverage.region.areas.sum())
    if not area > 0.0:
        return Idle("the region holds no surface")
    found = _left_on(replay, coverage, coverage.region, cutting)
    share, bound = 100.0 * found.missed / area, 100.0 * coverage.share
    place = replay.place(int(_nearest_samples(replay, found.place[None])[0]))
    beam = not cutting.cutter
    return Finding(share <= bound, share, bound, "%", place, _method(found, coverage, area, beam=beam))


def _left_on(replay: Replay, coverage: Coverage, region: Patch, cutting: Cutting) -> _Left:
    solids, height = cutting.cutter, coverage.left
    chords = np.ones(len(replay.tilt_centres) - 1, dtype=np.bool_)
    reach = max((_width(solid) for solid in solids), default=height)
    # A ball holds a disc of this radius at that height over a plane.
    disc = float(np.sqrt(height * max(2.0 * reach - height, height)))
    least = float(np.sqrt(region.areas.sum() / _MOST_CELLS))
    coarse, fine = max(_COARSE * disc, least), max(_COARSE * disc / _HALVINGS, least)
    if not solids:
        # What is within a ball about the spot, on cuts, is done.
        spot = replay.toolpath.tilt_centre
        solids, chords, height = (Solid("cutter", spot, spot, 0.0, 0.0, coverage.left),), _on_cuts(replay), 0.0
    corners, normals = np.ascontiguousarray(region.vertices[region.faces]), np.ascontiguousarray(region.facet_normals)
    highest, swept = np.array([0.0, *corners[0].mean(axis=0)]), list[SweptSolid]()
    for solid in solids:
        one = SweptSolid.of(replay, solid, chords, max(_NEAR_M, _NEAR * coverage.left))
        if one is not None:
            swept.append(one)
            cells, at = one.uncovered(corners, normals, height, coarse, fine)
            highest = at if at[0] > highest[0] else highest
            corners, normals = cells[:, :9].reshape(-1, 3, 3), np.ascontiguousarray(cells[:, 9:])
    middles = np.ascontiguousarray(corners.mean(axis=1))
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    most = np.full(len(middles), np.nextafter(height, np.inf))
    for one in swept:
        one.entries(middles, normals, most)
    met = most <= height
    between = float(areas[met].sum())
    middles, normals, areas = middles[~met], normals[~met], areas[~met]
    chosen = _chosen(areas, _LOOKED_AT if all(_is_end(replay, solid) for solid in solids[:1]) else _LOOKED_AT_BODIES)
    middles, normals, weights = middles[chosen], normals[chosen], areas[chosen]
    could = _could(replay, coverage, cutting, middles + height * normals, normals)
    weights = weights * (areas.sum() / max(weights.sum(), 1e-300))
    missed = float(weights[could].sum())
    heights, gaps = np.full(len(middles), _FAR * reach), np.full(len(middles), np.inf)
    for one in swept:
        one.entries(middles, normals, heights)
        one.distances(middles, gaps)
    deepest, place, gap = float(highest[0]), highest[1:], 0.0
    if could.any():
        own = np.flatnonzero(could)
        worst = own[np.lexsort((gaps[own], heights[own] if cutting.cutter else gaps[own]))[-1]]
        gap = max(float(gaps[own].max()), 0.0)
        if heights[worst] > deepest:
            deepest, place = float(heights[worst]), middles[worst]
    return _Left(missed, float(weights.sum()) - missed, between, 2.0 * fine, deepest, place, gap, _FAR * reach)


def _chosen(areas: Floats, most: int) -> Ints:
    """Return which cells stand for all, evenly by area; all where they are few."""
    if len(areas) <= most:
        return np.arange(len(areas))
    edges = np.cumsum(areas)
    return np.unique(np.searchsorted(edges, (np.arange(most) + 0.5) * edges[-1] / most))


def _could(replay: Replay, coverage: Coverage, cutting: Cutting, points: Floats, normals: Floats) -> Bools:
    """Return at which points (N, 3), above the surface with these normals, the tool could have been."""
    surface = cutting.surface
    if not len(points):
        return np.zeros(0, dtype=np.bool_)
    if not cutting.cutter:
        # What the view does not see no beam along it can meet.
        size = float(np.linalg.norm(np.ptp(surface.bounds, axis=0)))
        start = points + _ABOVE_M * normals
        return np.asarray(surface.segments(start, start + 2.0 * size * coverage.up, within=_ABOVE_M).distance > 0.0)
    for solid in cutting.cutter:
        if _is_end(replay, solid):
            return ball_reaches(surface, points, normals, solid.rounding, coverage.up)
    axes = replay.axes[_nearest_samples(replay, points)]
    reached = body_reaches(surface, cutting.cutter, points, axes, normals)
    rest = np.flatnonzero(~reached)
    if len(rest):
        reached[rest] = body_reaches(surface, cutting.cutter, points[rest], normals[rest], normals[rest])
    return reached


def _is_end(replay: Replay, solid: Solid) -> bool:
    """Return whether a solid is the ball about the tilt_centre."""
    return solid.is_ball and solid.low == replay.toolpath.tilt_centre


def _width(solid: Solid) -> float:
    return max(solid.low_radius, solid.high_radius) + solid.rounding


def _on_cuts(replay: Replay) -> Bools:
    """Return which chords (M − 1,) belong to a cut with its beam on, by their middle."""
    toolpath, arcs = replay.toolpath, replay.match.arcs
    ends = arc_length(toolpath.tilt_centres)[toolpath.starts]
    segment = np.searchsorted(ends, 0.5 * (arcs[:-1] + arcs[1:]), side="right") - 1
    cutting = np.array([s.kind is SegmentKind.CUT and s.power > 0.0 for s in toolpath.segments])
    return np.asarray(cutting[np.clip(segment, 0, len(cutting) - 1)])


def _nearest_samples(replay: Replay, points: Floats) -> Ints:
    """Return the samples (N,) whose tilt_centres are nearest to points (N, 3)."""
    return np.asarray(KDTree(replay.tilt_centres).query(points)[1], dtype=np.intp)


def _method(found: _Left, coverage: Coverage, area: float, *, beam: bool) -> str:
    x, y, z = MM * found.place
    where, left = f"x {x:.2f}, y {y:.2f}, z {z:.2f} mm", f"{MM * coverage.left:.4g} mm"
    if beam:
        text = f"area of the region that is farther than {left} from the beam's line on cuts"
        text += f"; up to {MM * (found.gap + coverage.left):.3g} mm, at {where}" if found.missed > 0.0 else ""
        hidden = "is hidden from the view"
    else:
        text = f"area of the region on which the swept cutter leaves more than {left} along the normal"
        deepest = "more than " if found.deepest >= found.far else ""
        text += f"; deepest found {deepest}{MM * found.deepest:.3g} mm at {where}"
        text += f", the cutter stays up to {MM * found.gap:.3g} mm off" if found.gap > 0.0 else ""
        hidden = "is out of reach for the cutter's shape, as far as a search finds"
    if found.between > 0.0:
        text += f"; {100.0 * found.between / area:.3g} % judged at the middles of cells of {MM * found.cell:.2g} mm"
    text += ", the rest proven at every point" if found.between > 0.0 else "; proven at every point"
    return text + (f"; {100.0 * found.beyond / area:.3g} % more {hidden}" if found.beyond > 0.0 else "")


CLAIMS = (Claim("surface left on the region", surface_left, needs_proof=True),)
