"""What a job leaves on its region, estimated at points before there is a program; toolpaths that leave too much."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats
from pentapod.base.refusal import Refusal
from pentapod.base.units import to_si
from pentapod.geometry.directions import angle_between, normalised
from pentapod.geometry.polyline import spaced
from pentapod.job.build.region import rolls
from pentapod.job.build.toolpath import Reports
from pentapod.job.schema.job import Job
from pentapod.numerics.threads import nearest_points
from pentapod.toolpath.gouge.report import GougeReport
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify import Cutting
from pentapod.verify.surface.reachable import nearest_centres

FORBIDDEN = "toolpath"
"""The stage of the refusal of a toolpath."""


@dataclass(frozen=True)
class LeftOptions:
    """How what is left is estimated.

    points: of a region, evenly by area. near: steps along the path, in radii of the ball. touches: metres by which the
    nearest place of the ball may be off a point that it touches.
    """

    points: int = 40_000
    near: float = 0.05
    touches: float = 1e-6


def uncovered(points: Floats, path: Floats, radius: float, near: float) -> Bools:
    """Return above which points (N, 3) the centre of a ball never is within its radius, on its way along a path (M, 3).

    near: steps along the path, radii.
    """
    return np.asarray(nearest_points(KDTree(spaced(path, near * radius)), points)[0]) > radius


def missed_by_drops(
    cutting: Cutting, toolpath: Toolpath, dropped: Floats, options: LeftOptions = LeftOptions()
) -> float:
    """Return about the share of a ball's region that its toolpath misses since motions (n, 2, 3) were dropped.

    That is where a verdict finds that the ball could have been: it touches the part there, and can be retracted.
    """
    coverage, radius = cutting.coverage, cutting.cutter[0].rounding
    if coverage is None or coverage.region is None or not len(coverage.region.faces) or not len(dropped):
        return 0.0
    points, normals = coverage.region.spread(options.points)
    above = points + coverage.left * normals
    motions = np.concatenate([spaced(motion, options.near * radius) for motion in dropped])
    left = np.flatnonzero(np.asarray(nearest_points(KDTree(motions), above)[0]) <= radius)
    left = left[uncovered(above[left], toolpath.tilt_centres, radius, options.near)]
    if not len(left):
        return 0.0
    at = points[left]
    first = np.array([0.0, coverage.left])
    centres = nearest_centres(cutting.surface, at, normals[left], radius, coverage.up, first)
    touching = np.linalg.norm(centres - at, axis=1) <= radius + options.touches  # NaN: no place was found
    return float(touching.sum()) / len(points)


@dataclass(frozen=True)
class ForesightOptions:
    """When a toolpath is refused, or not planned, since its program would fail its verdict.

    walls_deg: slope from which surface is an upright wall: passes of a raster leave those that are parallel to them.
    certain: share of the length of cuts that is dropped from which the verdict would find the region missed; missed:
    estimated share of the region that is missed from which it would; leaves: share that a cutter leaves that keeps
    exactly to the toolpath. As multiples of the share of it that may be left.
    askew_deg: angle between a fixed axis and the direction that the region faces from which it is told.
    """

    walls_deg: float = 80.0
    certain: float = 50.0
    missed: float = 2.0
    leaves: float = 1.5
    askew_deg: float = 30.0


FORESIGHT = ForesightOptions()


def foreseen(
    job: Job,
    reports: Reports,
    toolpath: Toolpath,
    cutting: Cutting | None,
    options: ForesightOptions = FORESIGHT,
    *,
    upright: bool = False,
) -> Refusal | None:
    """Return the refusal of a toolpath that leaves out much of what its ball reaches, as shank or holder would gouge.

    The ball's own places count as reached, so the verdict would find them missed; other cutters may not reach them.
    upright: whether the job is one of a bull or flat end that may stand upright instead; that is tried before it is
    planned with axes along the normals that leave out much.
    """
    for report in reports.parts:
        if not isinstance(report, GougeReport) or not (rolls(job) or upright):
            continue
        most, share = job.tolerance.left_share, 100.0 * report.dropped_share
        what = "the tool" if upright else "shank or holder"
        cause = f"with these tool axes {what} would cut into the part on {share:.3g} % of the cuts, which are left out"
        cause += _askew(job, options)
        allowed = f"{100.0 * most:.2g} % of the region may be left"
        if report.dropped_share > options.certain * most:
            return Refusal(FORBIDDEN, f"{cause}; {allowed}")
        if upright or not report.dropped or cutting is None or not _is_ball(cutting):
            continue
        missed = missed_by_drops(cutting, toolpath, report.dropped_centres)
        if missed > options.missed * most:
            return Refusal(FORBIDDEN, f"{cause}: about {100.0 * missed:.2g} % of the region; {allowed}")
    return None


def may_leave_walls(job: Job, cutting: Cutting | None, options: ForesightOptions = FORESIGHT) -> bool:
    """Return whether the passes of a job may leave upright walls, since they are not machined in waterlines."""
    if cutting is None or cutting.coverage is None or getattr(job.toolpath, "steep_deg", 0.0) is not None:
        return False
    region, coverage = cutting.coverage.region, cutting.coverage
    if region is None or not len(region.faces):
        return False
    return region.share_steeper(coverage.up, to_si(options.walls_deg, "deg")) > coverage.share


def _askew(job: Job, options: ForesightOptions) -> str:
    """Return words about a fixed axis that comes from another side than the region faces; empty where it does not."""
    axis = job.axis.si
    if axis.mode != "fixed":
        return ""
    facing = normalised(np.array(job.part.si.region_direction))
    angle = np.degrees(angle_between(normalised(np.array(axis.direction)), facing))
    return "" if angle < options.askew_deg else f" (axis.direction is {angle:.0f} deg from part.region_direction)"


def _is_ball(cutting: Cutting) -> bool:
    return bool(cutting.cutter) and cutting.cutter[0].is_ball
