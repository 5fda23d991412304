"""Assembly of a toolpath from contact lines: waypoints, order, links, tips; the last step of every strategy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import normalised, tangent_frame
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.passes import Passes
from pentapod.mesh.query.heightfield import HeightField
from pentapod.toolpath.drawing import Drawing, Order
from pentapod.toolpath.linking import ordering
from pentapod.toolpath.linking.link_passes import Run, linked
from pentapod.toolpath.linking.resampling import resample
from pentapod.toolpath.linking.tour import travel, travel_bound
from pentapod.toolpath.nothing_left import nothing_left
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.path_report import PathReport
from pentapod.toolpath.toolpath import Toolpath

REACH_STEPOVERS = 3.0
_HIDDEN_SLACK_M = 1e-6
_STEEPEST = 0.05


def assembled(
    strategy: str, mesh: Mesh, tool: Tool, options: PathOptions, drawing: Drawing
) -> tuple[Toolpath, PathReport]:
    """Return the toolpath along a drawing, and what it came to.

    Nominal axes are the surface's smooth normals. The motion begins and ends at the clearance level. Raises
    ToolpathError where no pass is left.
    """
    field = HeightField(mesh, options.up)
    laid = _laid(drawing, field, options)
    long = laid.passes.lengths >= options.shortest
    dropped, dropped_length = int((~long).sum()), float(laid.passes.lengths[~long].sum())
    passes, power = laid.passes.where(long), laid.power[long]
    if not len(passes):
        raise nothing_left(mesh, options, dropped)
    passes = Passes(passes.points, normalised(passes.normals), passes.starts, passes.levels)
    reach = REACH_STEPOVERS * drawing.stepover if options.stay is None else options.stay
    turns = _turns(passes, drawing, reach)
    runs: list[Run] = []
    for turn in turns:
        rows = np.arange(len(passes.points))[passes.rows(turn.index)]
        points = passes.points[rows]
        if passes.closed[turn.index] and drawing.order is not Order.GIVEN:
            begin = ordering.rotated_to_meet(points, runs[-1].contacts[-1] if runs else None, closed=True)
            rows = np.concatenate([rows[begin:-1], rows[: begin + 1]])
        rows = rows[::-1] if turn.backwards else rows
        stay = 0.0 if drawing.sink > 0.0 or not turn.near else reach
        runs.append(Run(passes.points[rows], passes.normals[rows], float(power[turn.index]), stay))
    toolpath, counts = linked(mesh, tool, options, runs=runs, field=field, stepover=drawing.stepover or options.spacing)
    firsts, lasts = np.stack([r.contacts[0] for r in runs]), np.stack([r.contacts[-1] for r in runs])
    report = PathReport(
        strategy=strategy,
        passes=len(passes),
        waypoints=len(toolpath),
        stepover=drawing.stepover,
        cut_length=float(passes.lengths.sum()),
        stay_downs=counts.stay_downs,
        hops=counts.hops,
        retracts=len(passes) - counts.stay_downs - counts.hops,
        travel=travel(firsts, lasts),
        travel_bound=travel_bound(firsts, lasts),
        dropped=dropped,
        dropped_length=dropped_length,
        hidden=laid.hidden,
        tight=_tight(passes, tool),
        unproven=counts.unproven,
        notes=drawing.notes,
    )
    return toolpath, report


@dataclass(frozen=True, eq=False)
class _Laid:
    """Waypoints of passes, the power (P,) of each pass, and how many points were hidden."""

    passes: Passes
    power: Floats
    hidden: int


def _laid(drawing: Drawing, field: HeightField, options: PathOptions) -> _Laid:
    """Return the waypoints along a drawing, without what the part itself hides."""
    passes, hidden = drawing.passes, 0
    if drawing.order is Order.ZIGZAG:
        passes = ordering.aligned(passes, tangent_frame(options.up)[0])
    number = np.arange(len(passes))
    # Passes keep their numbers through the resampling as levels.
    levels = passes.levels
    passes = resample(
        Passes(passes.points, passes.normals, passes.starts, np.arange(len(passes))),
        chordal=options.chordal,
        spacing=options.spacing,
        axis_step=options.axis_step,
        closest=min(options.closest, options.chordal),
    )
    number, levels = number[passes.levels], levels[passes.levels]
    passes = Passes(passes.points, passes.normals, passes.starts, levels)
    if not drawing.visible:
        # A line below the surface is hidden by it; what hides more than that counts.
        slack = _HIDDEN_SLACK_M + drawing.sink / max(np.cos(options.region.angle), _STEEPEST)
        keep = ~field.hides(passes.points, slack)
        hidden = int((~keep).sum())
        number = _owners(passes, keep, number) if hidden else number
        passes = passes.split(keep) if hidden else passes
    power = np.ones(len(passes)) if drawing.power is None else drawing.power[number]
    return _Laid(passes, power, hidden)


def _owners(passes: Passes, keep: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Return the number (P,) of the pass that each run of `Passes.split` comes from."""
    tagged = Passes(passes.points, passes.normals, passes.starts, number).split(keep)
    return tagged.levels


def _turns(passes: Passes, drawing: Drawing, reach: float) -> list[ordering.Turn]:
    if drawing.order is Order.ZIGZAG:
        return ordering.zigzag(passes, reach)
    if drawing.order is Order.BY_LEVEL:
        return ordering.by_level(passes)
    if drawing.order is Order.GIVEN:
        return ordering.given(passes)
    return ordering.shortest(passes, drawing.both_ways)


def _tight(passes: Passes, tool: Tool) -> int:
    """Return how many steps of the passes run through a hollow narrower than the ball or the stand-off."""
    closing = -(np.diff(passes.points, axis=0) * np.diff(passes.normals, axis=0)).sum(axis=1)
    return int((passes.within & (closing * abs(tool.tilt_centre) > passes.steps**2)).sum())
