"""Claim on the material that is left on the region, from the swept volume of the replayed cutter.

The region is subdivided into cells until each is proven covered: at the height that may be left, above every point of
the cell, one convex piece of the swept volume has been. Cells for which this cannot be proven are halved until they are
small; then their middle decides. The message gives the area of those cells. Of many cells a sample stands for all.

Where the cutter touches the part, such a cell is missed. Where its shape must leave material (a fillet narrower than
the ball, the foot of a wall), what counts is what is left beyond that: the cell is missed if more than the job allows
is left above the limit surface (`limit_surface.py`), along the normal of that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.units import from_si
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.solids import Solid
from pentapod.mesh.patch import Patch
from pentapod.numerics.blocks import blocks
from pentapod.toolpath.toolpath import SegmentKind
from pentapod.verify.replay.along_toolpath import Motion
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay
from pentapod.verify.surface.limit_surface import LimitSurface, is_ball_end, under_overhangs
from pentapod.verify.surface.reachable import open_to_leans
from pentapod.verify.surface.swept_cutter import SweptSolid
from pentapod.verify.verdict.coverage import Coverage
from pentapod.verify.verdict.cutting import Cutting


@dataclass(frozen=True)
class SurfaceOptions:
    """Options of the subdivision and of the search for what is left.

    coarse: size of the first cells as a share of what one position of the cutter covers; finest: ratio to the smallest
    ones; cells: no cell is smaller than the region divided by so many. near_m, near_share: deviation of the motion from
    a straight stretch, in metres or as a share of what may be left. balls, bodies: at most so many cells that are left
    are compared with the limit surface, for a ball and for other cutters, each for its share of the area. again: so
    often this is repeated with `more` times as many cells, as long as the share that is found is within
    `near_deviations` standard deviations of its bound. far: radii of the cutter along the normal up to which material
    is measured.
    """

    coarse: float = 0.25
    finest: float = 8.0
    cells: float = 4e5
    near_m: float = 1e-6
    near_share: float = 0.01
    balls: int = 2048
    bodies: int = 256
    more: int = 4
    again: int = 2
    near_deviations: float = 2.0
    far: float = 4.0


OPTIONS = SurfaceOptions()

SURFACE_LEFT = "surface left on the region"
"""Name of the claim."""


@dataclass(frozen=True, eq=False)
class _Left:
    """What is left on a region.

    Areas, square metres: missed, where the tool could have been; beyond, where no room for it is found, or only
    where an overhang hides the surface from the view; shaped, where
    its shape must leave material, and only what is left beyond that was judged; between, where only the middles of
    cells show that no more is left. shape: the largest height that the shape leaves there. cell: largest width of those
    cells, metres. deepest: largest height along the normal that is left where the tool could have been, metres,
    measured up to `far`; place (3,): where. gap: largest distance of the cutter from where it could have been, 0 where
    nothing is missed. leant: area of `beyond` that a tool that leans might reach. sampled, cells: so many of so many
    cells were compared with the limit surface.
    """

    missed: float
    beyond: float
    shaped: float
    shape: float
    between: float
    cell: float
    deepest: float
    place: Floats
    gap: float
    far: float
    leant: float
    sampled: int
    cells: int


def surface_left(replay: Replay) -> Finding | Idle:
    """Judge the share of the region on which more is left than the job allows, although the tool could reach it."""
    cutting = replay.specification.cutting
    coverage = None if cutting is None else cutting.coverage
    if cutting is None or coverage is None:
        return Idle("the surface to be machined is not given", unknown=True)
    piece = replay.program.provenance.piece
    if piece is not None:
        coverage = coverage.of_piece(piece)
    if coverage.region is None:
        return Idle(coverage.why)
    area = float(coverage.region.areas.sum())
    if not area > 0.0:
        return Idle("the region has no surface")
    found = left_on(replay, coverage, coverage.region, cutting, OPTIONS.again)
    share, bound = 100.0 * found.missed / area, 100.0 * coverage.share
    place = replay.place(_nearest_sample(replay, found.place))
    beam = not cutting.cutter
    return Finding(share <= bound, share, bound, "%", place, _method(found, coverage, area, beam=beam))


def left_on(motion: Motion, coverage: Coverage, region: Patch, cutting: Cutting, again: int) -> _Left:
    """Return what a motion leaves on a region. again: as of the options."""
    solids, height = cutting.cutter, coverage.left
    chords = np.ones(len(motion.tilt_centres) - 1, dtype=np.bool_)
    reach = max((solid.largest_radius for solid in solids), default=height)
    # At that height over a plane a ball covers a disc of this radius.
    disc = float(np.sqrt(height * max(2.0 * reach - height, height)))
    least = float(np.sqrt(region.areas.sum() / OPTIONS.cells))
    coarse, fine = max(OPTIONS.coarse * disc, least), max(OPTIONS.coarse * disc / OPTIONS.finest, least)
    if not solids:
        # A beam or spray finishes what is within a ball about its spot, on cuts.
        spot = motion.toolpath.tilt_centre
        solids, chords, height = (Solid("cutter", spot, spot, 0.0, 0.0, coverage.left),), _on_cuts(motion), 0.0
    corners, normals = np.ascontiguousarray(region.vertices[region.faces]), np.ascontiguousarray(region.facet_normals)
    highest, swept = np.array([0.0, *corners[0].mean(axis=0)]), list[SweptSolid]()
    for solid in solids:
        one = SweptSolid.of(motion, solid, chords, max(OPTIONS.near_m, OPTIONS.near_share * coverage.left))
        if one is not None:
            swept.append(one)
            motion.kept.setdefault(SweptSolid, []).append(one)
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
    by_ball = all(is_ball_end(motion, solid) for solid in solids[:1])
    cells = _Cells(middles[~met], normals[~met], areas[~met], height, reach, (float(highest[0]), highest[1:]), by_ball)
    allowed, count = coverage.share * float(region.areas.sum()), OPTIONS.balls if by_ball else OPTIONS.bodies
    found = _sampled(motion, coverage, cutting, cells, swept, count)
    for _ in range(again):
        if not (len(cells.areas) > count and _undecided(found.missed, allowed, float(cells.areas.sum()) / count)):
            break
        count *= OPTIONS.more
        found = _sampled(motion, coverage, cutting, cells, swept, count)
    return replace(found, between=between, cell=2.0 * fine)


@dataclass(frozen=True, eq=False)
class _Cells:
    """Small cells of which none is proven covered, nor its middle found to be.

    middles, normals (C, 3), areas (C,). height: metres that may be left. reach: radius of the cutter. highest: of what
    is left over the covered cells, metres, and where. by_ball: the cutter ends in a ball.
    """

    middles: Floats
    normals: Floats
    areas: Floats
    height: float
    reach: float
    highest: tuple[float, Floats]
    by_ball: bool


def _undecided(missed: float, allowed: float, each: float) -> bool:
    """Return whether samples of area `each` cannot tell a missed area from the allowed one."""
    return missed > 0.0 and abs(missed - allowed) <= OPTIONS.near_deviations * np.sqrt(max(missed, allowed) * each)


def _sampled(
    motion: Motion, coverage: Coverage, cutting: Cutting, cells: _Cells, swept: list[SweptSolid], count: int
) -> _Left:
    """Return what is left on cells, of which at most `count` are compared with the limit surface."""
    height, reach = cells.height, cells.reach
    chosen, weights = _chosen(cells.areas, count)
    middles, normals = cells.middles[chosen], cells.normals[chosen]
    limit = LimitSurface.above(motion, coverage, cutting, middles, normals)
    known = np.isfinite(limit.heights)
    everywhere, excused = (middles, normals, weights), ~known
    above, middles, weights, unknown = limit.where(known), middles[known], weights[known], float(weights[~known].sum())
    heights, gaps = np.full(len(middles), OPTIONS.far * reach), np.full(len(middles), np.inf)
    for one in swept:
        one.entries(above.points, above.normals, heights)
        one.distances(above.points, gaps)
    own, shaped = (above.heights == 0.0) | (heights > height), above.heights > 0.0
    kept_off = np.flatnonzero(own & shaped) if cells.by_ball else np.zeros(0, dtype=np.intp)
    if len(kept_off):
        at, its_normals, limit = middles[kept_off], normals[known][kept_off], above.where(own & shaped)
        kept_off = kept_off[under_overhangs(cutting, coverage, at, its_normals, limit)]
        own[kept_off] = shaped[kept_off] = False
        excused[np.flatnonzero(known)[kept_off]] = True
        unknown += float(weights[kept_off].sum())
    own = np.flatnonzero(own)
    (deepest, place), gap = cells.highest, 0.0
    if len(own):
        worst = own[np.lexsort((gaps[own], heights[own] if cutting.cutter else gaps[own]))[-1]]
        gap = max(float(gaps[own].max()), 0.0)
        if heights[worst] > deepest:
            deepest, place = float(heights[worst]), middles[worst]
    return _Left(
        float(weights[own].sum()),
        unknown,
        float(weights[shaped].sum()),
        float(above.heights[shaped].max(initial=0.0)),
        0.0,
        0.0,
        deepest,
        place,
        gap,
        OPTIONS.far * reach,
        _leant(coverage, cutting, *(each[excused] for each in everywhere)),
        len(chosen),
        len(cells.areas),
    )


def _leant(coverage: Coverage, cutting: Cutting, points: Floats, normals: Floats, areas: Floats) -> float:
    """Return of the areas (N,) of points (N, 3) that the program may leave what a tool that leans might reach.

    Of a stem thinner than the cutter nothing is known: there all counts.
    """
    if not (coverage.leans > 0.0 and len(points)):
        return 0.0
    wide = max((solid.largest_radius for solid in cutting.cutter), default=0.0)
    if any(min(solid.low_radius, solid.high_radius) + solid.rounding < wide for solid in cutting.solids):
        return float(areas.sum())
    above = points + coverage.left * normals
    return float(areas[open_to_leans(cutting.surface.mesh, above, coverage.up, coverage.leans)].sum())


def _chosen(areas: Floats, most: int) -> tuple[Ints, Floats]:
    """Return a sample of the cells, evenly by area, and the area that each stands for; all where they are few."""
    if len(areas) <= most:
        return np.arange(len(areas)), areas
    edges = np.cumsum(areas)
    chosen, hits = np.unique(np.searchsorted(edges, (np.arange(most) + 0.5) * edges[-1] / most), return_counts=True)
    return chosen, hits * (edges[-1] / most)


def _on_cuts(motion: Motion) -> Bools:
    """Return which chords (M − 1,) belong to a cut with the beam on, by their middle."""
    toolpath, arcs = motion.toolpath, motion.arcs
    ends = arc_length(toolpath.tilt_centres)[toolpath.starts]
    segment = np.searchsorted(ends, 0.5 * (arcs[:-1] + arcs[1:]), side="right") - 1
    cutting = np.array([s.kind is SegmentKind.CUT and s.power > 0.0 for s in toolpath.segments])
    return np.asarray(cutting[np.clip(segment, 0, len(cutting) - 1)])


def _nearest_sample(replay: Replay, point: Floats) -> int:
    """Return the sample whose tilt centre is nearest to a point (3,)."""
    off = np.empty(len(replay.tilt_centres))
    for part in blocks(len(off)):
        off[part] = np.square(replay.tilt_centres[part] - point).sum(axis=1)
    return int(np.argmin(off))


def _method(found: _Left, coverage: Coverage, area: float, *, beam: bool) -> str:
    x, y, z = MM * found.place
    where, left = f"x {x:.2f}, y {y:.2f}, z {z:.2f} mm", f"{MM * coverage.left:.4g} mm"
    if beam:
        text = f"share of the region that is farther than {left} from the beam's line on cuts"
        text += f"; up to {MM * (found.gap + coverage.left):.3g} mm, at {where}" if found.missed > 0.0 else ""
        hidden = "is hidden from the view"
    else:
        text = f"share of the region on which the swept cutter leaves more than {left} along the normal"
        deepest = "more than " if found.deepest >= found.far else ""
        text += f"; deepest found {deepest}{MM * found.deepest:.3g} mm at {where}"
        text += f", where the cutter is up to {MM * found.gap:.3g} mm away" if found.gap > 0.0 else ""
        hidden = "is hidden by overhangs or out of reach for the cutter, as far as the search finds"
    cells = f"of cells of {MM * found.cell:.2g} mm"
    if found.between > 0.0:
        text += f"; {100.0 * found.between / area:.3g} % judged only at the middles {cells}"
    if found.shaped > 0.0:
        text += (
            f"; {100.0 * found.shaped / area:.3g} %, where the cutter's shape leaves up to {MM * found.shape:.3g} mm,"
        )
        text += f" judged by what is left beyond that, at the middles {cells}"
    sample = found.sampled < found.cells
    some = found.between > 0.0 or found.shaped > 0.0 or sample
    text += ", the rest proven at every point" if some else "; proven at every point"
    text += f"; {found.sampled:,} of the {found.cells:,} cells not proven stand for all of them" if sample else ""
    text += f"; {100.0 * found.beyond / area:.3g} % more {hidden}" if found.beyond > 0.0 else ""
    if coverage.leans > 0.0 and found.beyond > 0.0:
        text += (
            f", as the program's tool stays upright: a tool that leans by up to "
            f"{from_si(coverage.leans, 'deg'):.0f} deg might reach {100.0 * found.leant / area:.3g} % of the region "
            "there, and reaches the rest at no lean"
        )
    return text


CLAIMS = (Claim(SURFACE_LEFT, surface_left, needs_proof=True),)
