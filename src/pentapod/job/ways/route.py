"""Routes: straight stretches of tool poses between the machine's park pose and a row of a program, clear of all limits.

A route leaves the row along the tool axis, rises away from the work, crosses while the axis turns, and comes down to
the park pose. Many are looked at, the simplest first; the first with all margins and no touch is taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.refusal import Refusal, Shortfall
from pentapod.base.units import from_si, to_si
from pentapod.geometry.directions import fastest_turn, turned
from pentapod.job.build.placed_check import meetings
from pentapod.machine.clearance.collision_world import NOTHING, CollisionWorld
from pentapod.planning import PlacedPath, Placement
from pentapod.planning.diagnosis import diagnose
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.limits.margins import Margins
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.program import Program
from pentapod.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify import Specification

Pose = tuple[Floats, Floats]
"""A tool tip (3,), metres, and a unit axis (3,), tip → spindle, machine frame."""

UPWARDS = np.array([0.0, 0.0, -1.0])
"""From the work to the base."""

LEAST_HEIGHT = 1e-6
"""Metres."""

NOT_CLEAR = "no clear way was found"
"""Begins the cause of a refusal after the way's name."""


@dataclass(frozen=True)
class RouteOptions:
    """Which routes are looked at, and how closely.

    retracts: metres along the tool axis from the row. heights: metres by which the crossing is above the higher of the
    row's retracted pose and the park pose. step, turn: largest distance between waypoints, metres, and turn, radians.
    """

    retracts: tuple[float, ...] = (0.0, 0.005, 0.015, 0.04)
    heights: tuple[float, ...] = (0.0, 0.01, 0.03, 0.08)
    step: float = 2e-3
    turn: float = float(to_si(1.0, "deg"))


OPTIONS = RouteOptions()


def with_cutter(specification: Specification) -> CollisionWorld:
    """Return the obstacles of a way: on it the cutter must not touch them either."""
    world, cutting = specification.collision_world or NOTHING, specification.cutting
    if cutting is None:
        return world
    # The clearance of legs and tool divides by the height of a solid; that of a ball has none.
    cutter = tuple(replace(solid, high=max(solid.high, solid.low + LEAST_HEIGHT)) for solid in cutting.cutter)
    return replace(world, tool=(*cutter, *world.tool))


def route(
    name: str,
    row: Pose,
    park: Pose,
    program: Program,
    specification: Specification,
    limits: tuple[LimitKind, ...] = (),
    options: RouteOptions = OPTIONS,
) -> PlacedPath | Refusal:
    """Return a route from a row of the program to the park pose, machine frame, as a placed path of rapids.

    It stops at its corners. name: "way in" or "way out", for the refusal, which tells the nearest trouble: that of the
    park pose itself, or that of the route with the largest smallest margin. limits: kinds besides pentapod's own.
    """
    margins = Margins.of(specification.machine, program.component, with_cutter(specification), limits)
    there = margins(park[0][None], park[1][None], program.placement)
    if not there.min() >= 0.0:
        return _refused(
            name,
            f"the park pose is not within the limits of the machine in the program's component {program.component}",
            there,
            margins,
            "Choose another park.tip_mm in the machine file, or placement.component in the job",
        )
    best: tuple[float, Floats, PlacedPath] | None = None
    least = min(NEEDED_MARGIN, 0.5 * float(there.min()))
    for corners in _candidates(row, park, options):
        placed, values = _placed(corners, program, margins, options)
        smallest = float(values[1:].min())
        cutting, clear = specification.cutting, smallest >= least
        if clear and (cutting is None or not meetings(placed, cutting, specification.path_tolerance)):
            return placed
        if best is None or smallest > best[0]:
            best = smallest, values, placed
    if best is None or best[0] >= least:
        cause = f"{NOT_CLEAR}: on every one the tool touches the part"
        return Refusal(name, cause, remedy=_remedy(park))
    worst = int(best[1].min(axis=1).argmin())
    x, y, z = from_si(best[2].tips[worst], "mm")
    cause = f"{NOT_CLEAR}; on the nearest to one the least room is at x {x:.1f}, y {y:.1f}, z {z:.1f} mm of the tip"
    return _refused(name, cause, best[1], margins, _remedy(park), least)


def _remedy(park: Pose) -> str:
    x, y, z = from_si(park[0], "mm")
    where = f"now {x:.6g}, {y:.6g}, {z:.6g}"
    return f"Choose a park.tip_mm ({where}) that the tool reaches more freely, or move the part or its fixture"


def _refused(name: str, cause: str, values: Floats, margins: Margins, remedy: str, needed: float = 0.0) -> Refusal:
    short = diagnose(np.where(np.isfinite(values), values, -1.0), margins, needed)
    return Refusal(name, cause, tuple(replace(each, waypoints=_ends(each)) for each in short[:3]), remedy)


def _ends(short: Shortfall) -> tuple[tuple[int, int], ...]:
    return ((short.waypoints[0][0], short.waypoints[-1][1]),)


def _candidates(row: Pose, park: Pose, options: RouteOptions) -> Iterator[list[Pose]]:
    """Yield the corners of routes from a row to the park pose, the simplest first."""
    (tip, axis), (end, end_axis) = row, park
    for retract in options.retracts:
        yield [row, (tip + retract * axis, axis), park]
    for height, retract in product(options.heights, options.retracts):
        out = tip + retract * axis
        level = max(float(out @ UPWARDS), float(end @ UPWARDS)) + height
        lifted, over = (point + (level - float(point @ UPWARDS)) * UPWARDS for point in (out, end))
        yield [row, (out, axis), (lifted, axis), (over, end_axis), park]


def _placed(
    corners: list[Pose], program: Program, margins: Margins, options: RouteOptions
) -> tuple[PlacedPath, Floats]:
    """Return a route as a placed path, and its margins (N, M)."""
    back, segments = program.placement.inverse(), list[Segment]()
    for (a, start), (b, end) in pairwise(corners):
        length, turn = float(np.linalg.norm(b - a)), fastest_turn(start, end)
        if length < 1e-9 and turn < 1e-9:
            continue
        count = max(int(np.ceil(length / options.step)), int(np.ceil(turn / options.turn)), 1)
        share = np.linspace(0.0, 1.0, count + 1)
        tips, axes = a + share[:, None] * (b - a), turned(start, end, share, UPWARDS)
        axes[0], axes[-1] = start, end
        segments.append(Segment(SegmentKind.RAPID, back.apply(tips), back.rotate(axes), np.inf, dwell=0.0))
    if not segments:  # the row is the park pose: there and back again, by a hair
        away = np.stack([corners[0][0], corners[0][0] + options.step * UPWARDS, corners[0][0]])
        axes = np.tile(back.rotate(corners[0][1]), (3, 1))
        segments = [Segment(SegmentKind.RAPID, back.apply(away), axes, np.inf, dwell=0.0)]
    return placed_on(Toolpath(tuple(segments)), program, margins)


def placed_on(
    toolpath: Toolpath, program: Program, margins: Margins, planned: Floats | None = None
) -> tuple[PlacedPath, Floats]:
    """Return a toolpath where the program's part is, and its margins (N, M).

    planned (N, 3): axes about the toolpath's tilt centres, workpiece frame; the toolpath's own where there are none.
    """
    own = toolpath.axes if planned is None else planned
    tips = program.placement.apply(toolpath.tilt_centres - toolpath.tilt_centre * own)
    axes = program.placement.rotate(own)
    values = margins(tips, axes, program.placement)
    values = np.where(np.isfinite(values), values, -1.0)
    placement = Placement(program.placement, "that of the program", program.rail_positions)
    return PlacedPath(toolpath, placement, program.component, tips, axes, values, margins.limits), values
