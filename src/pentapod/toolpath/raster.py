"""Raster: parallel plane slices of a surface, in order, linked into one toolpath."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import cast

import numpy as np

from pentapod.arrays import Floats
from pentapod.errors import ToolpathError
from pentapod.geometry.directions import normalised, tangent_frame
from pentapod.toolpath import links
from pentapod.toolpath.heightfield import HeightField
from pentapod.toolpath.mesh import Mesh
from pentapod.toolpath.options import Pattern, RasterOptions
from pentapod.toolpath.ordering import Turn, one_way, zigzag
from pentapod.toolpath.passes import Passes
from pentapod.toolpath.resampling import resample
from pentapod.toolpath.slicing import Planes, crossings, slice_mesh
from pentapod.toolpath.staydown import surface_links
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.toolpath.tools import BallCutter, Tool

MOST_CROSSINGS = 30_000_000
_REACH_STEPOVERS = 3.0
_STEEPEST_SCALLOP = np.radians(85.0)
_HIDDEN_SLACK_M = 1e-6


@dataclass(frozen=True)
class RasterReport:
    """What a raster came to. Lengths in metres.

    stepover: between the planes, after fitting a whole number into the region. stay_downs: links on the
    surface; retracts: passes reached by a rapid, the first too. dropped: passes shorter than asked for,
    dropped_length their sum. hidden: waypoints left out because the part itself lies above them. tight:
    waypoints where the surface is hollow along the pass with a radius below the ball's or the stand-off:
    a ball gouges there, a beam's tip turns back.
    """

    passes: int
    waypoints: int
    stepover: float
    cut_length: float
    stay_downs: int
    retracts: int
    dropped: int
    dropped_length: float
    hidden: int
    tight: int

    def __str__(self) -> str:
        text = (
            f"{self.passes:,} passes {1e3 * self.stepover:.4g} mm apart, {self.cut_length:.4g} m of cut, "
            f"{self.waypoints:,} waypoints; {self.stay_downs:,} links on the surface, {self.retracts:,} by rapid"
        )
        if self.dropped:
            text += f"\n  note: {self.dropped:,} short passes dropped, {1e3 * self.dropped_length:.3g} mm in all"
        if self.hidden:
            text += f"\n  note: {self.hidden:,} waypoints left out, the part lies above them"
        if self.tight:
            text += f"\n  problem: at {self.tight:,} waypoints the surface is hollower than the ball or the stand-off"
        return text


def raster(mesh: Mesh, tool: Tool, options: RasterOptions) -> Toolpath:
    """Return the toolpath of `raster_with_report`."""
    return raster_with_report(mesh, tool, options)[0]


def raster_with_report(mesh: Mesh, tool: Tool, options: RasterOptions) -> tuple[Toolpath, RasterReport]:
    """Return a toolpath that covers the region of a mesh by parallel passes, and what it came to.

    Nominal axes are the surface's smooth normals. The motion begins and ends at the clearance level. The
    first and last pass lie half a stepover inside the region. Raises ToolpathError where nothing is left to
    machine, the scallop does not suit the tool, or the passes are so dense that there would be no end to
    it.
    """
    view = cast(Floats, options.view)
    x, y = tangent_frame(view)
    along = math.cos(options.direction) * x + math.sin(options.direction) * y
    across = np.cross(view, along)
    planes = _planes(mesh, tool, options, along, across)
    field = HeightField(mesh, view)
    passes = resample(
        slice_mesh(mesh, planes, options.region),
        chordal=options.chordal,
        spacing=options.spacing,
        axis_step=options.axis_step,
        closest=min(options.closest, options.chordal),
    )
    hidden = field.hides(passes.points, _HIDDEN_SLACK_M)
    if hidden.any():
        passes = passes.split(~hidden)
    long = passes.lengths >= options.shortest
    dropped, dropped_length = int((~long).sum()), float(passes.lengths[~long].sum())
    passes = passes.where(long)
    if not len(passes):
        raise _nothing_left(mesh, options, dropped)
    passes = Passes(passes.points, normalised(passes.normals), passes.starts, passes.planes)
    if options.pattern is Pattern.ONE_WAY:
        turns = one_way(passes, along)
    else:
        turns = zigzag(passes, _REACH_STEPOVERS * planes.step)
    toolpath, stay_downs = _joined(mesh, tool, options, passes=passes, turns=turns, field=field, stepover=planes.step)
    report = RasterReport(
        passes=len(passes),
        waypoints=len(toolpath),
        stepover=planes.step,
        cut_length=float(passes.lengths.sum()),
        stay_downs=stay_downs,
        retracts=len(passes) - stay_downs,
        dropped=dropped,
        dropped_length=dropped_length,
        hidden=int(hidden.sum()),
        tight=_tight(passes, tool),
    )
    return toolpath, report


def stepover_for(scallop: float, radius: float, slope: float) -> float:
    """Return the plane distance, metres, at which a ball of `radius` leaves ridges no higher than `scallop`.

    On a plane inclined by `slope` (radians) across the passes: 2 √(2 r h − h²) along the surface, times
    cos(slope). Curvature is not taken into account: on a dome of radius R ridges are higher by about (1 + r
    / R).
    """
    return 2.0 * float(np.sqrt(scallop * (2.0 * radius - scallop)) * np.cos(min(slope, _STEEPEST_SCALLOP)))


def _planes(mesh: Mesh, tool: Tool, options: RasterOptions, along: Floats, across: Floats) -> Planes:
    """Return the slicing planes: evenly spread over the region, half a step inside its edges."""
    chosen = options.region.facets(mesh)
    if not chosen.any():
        raise _nothing_left(mesh, options, 0)
    corners = mesh.vertices[mesh.faces[chosen]].reshape(-1, 3)
    low, high = options.region.bounds
    if options.region.box is not None:
        corners = np.clip(corners, low, high)
    span = corners @ across
    lowest, highest = float(span.min()), float(span.max())
    width = _stepover(mesh, tool, options, across)
    count = max(1, int(np.ceil((highest - lowest) / width * (1.0 - 1e-9))))
    step = (highest - lowest) / count
    planes = Planes(across, lowest + 0.5 * step, step, count)
    if count > MOST_CROSSINGS or crossings(mesh, planes) > MOST_CROSSINGS:
        raise ToolpathError(
            "the passes are too dense for this mesh",
            key="stepover" if options.scallop is None else "scallop",
            value=options.stepover if options.scallop is None else options.scallop,
            expected=f"at most {MOST_CROSSINGS:,} crossings of passes with facets",
            remedy="check the unit of the mesh and the stepover",
        )
    return planes


def _stepover(mesh: Mesh, tool: Tool, options: RasterOptions, across: Floats) -> float:
    if options.stepover is not None:
        return options.stepover
    scallop = cast(float, options.scallop)
    if not isinstance(tool, BallCutter):
        raise ToolpathError("only a ball leaves a scallop", key="scallop", value=scallop, remedy="give the stepover")
    if scallop >= tool.radius:
        raise ToolpathError(
            "the scallop must be lower than the ball's radius",
            key="scallop",
            value=scallop,
            expected=f"< {tool.radius}",
        )
    normals = mesh.corner_normals[options.region.facets(mesh)].reshape(-1, 3)
    normals = normals[options.region.faces(normals) >= 0.0]
    slope = np.arctan2(np.abs(normals @ across), normals @ cast(Floats, options.view))
    return stepover_for(scallop, tool.radius, float(slope.max()))


def _joined(
    mesh: Mesh,
    tool: Tool,
    options: RasterOptions,
    *,
    passes: Passes,
    turns: list[Turn],
    field: HeightField,
    stepover: float,
) -> tuple[Toolpath, int]:
    """Return the passes in the order of `turns` with the links between them, and how many stay down."""
    contacts: list[Floats] = []
    normals: list[Floats] = []
    for turn in turns:
        rows = slice(int(passes.starts[turn.index]), int(passes.starts[turn.index + 1]))
        order = slice(None, None, -1 if turn.backwards else 1)
        contacts.append(passes.points[rows][order])
        normals.append(passes.normals[rows][order])
    tips = [tool.tips(c, n, n) for c, n in zip(contacts, normals, strict=True)]
    near = [k for k, turn in enumerate(turns) if turn.near]
    down = dict(
        zip(
            near,
            surface_links(
                field,
                options,
                stepover,
                [(contacts[k - 1], normals[k - 1], contacts[k], normals[k]) for k in near],
            ),
            strict=True,
        )
    )
    view = cast(Floats, options.view)
    highest_tip = max(float((t @ view).max()) for t in tips)
    top = max(float((mesh.vertices @ view).max()) + max(-tool.pivot, 0.0), highest_tip)
    # A rapid's knee is two approaches off the surface; no knee may reach above the level.
    level = top + max(options.clearance, 2.0 * options.approach)
    style = links.LinkStyle(view, level, options.approach, options.spacing, options.link_feed)

    def off(k: int, end: int) -> tuple[Floats, Floats]:
        return tips[k][end] + options.approach * normals[k][end], normals[k][end]

    segments: list[Segment] = []
    for k in range(len(turns)):
        link = down.get(k)
        if link is not None:
            between = tool.tips(link[0], link[1], link[1])
            segments.append(Segment(SegmentKind.LINK, between, link[1], options.link_feed))
        else:
            if k == 0:
                segments.append(links.entry(*off(0, 0), style))
            else:
                segments.append(links.retract(tips[k - 1][-1], normals[k - 1][-1], style))
                segments.append(links.rapid(*off(k - 1, -1), *off(k, 0), style))
            segments.append(links.approach(tips[k][0], normals[k][0], style))
        segments.append(Segment(SegmentKind.CUT, tips[k], normals[k], options.feed))
    segments.append(links.retract(tips[-1][-1], normals[-1][-1], style))
    segments.append(links.leave(*off(-1, -1), style))
    return Toolpath(tuple(segments), tool.pivot), sum(link is not None for link in down.values())


def _tight(passes: Passes, tool: Tool) -> int:
    """Return how many steps of the passes run through a hollow narrower than the ball or the stand-off."""
    closing = -(np.diff(passes.points, axis=0) * np.diff(passes.normals, axis=0)).sum(axis=1)
    return int((passes.within & (closing * abs(tool.pivot) > passes.steps**2)).sum())


def _nothing_left(mesh: Mesh, options: RasterOptions, dropped: int) -> ToolpathError:
    """Return the error that says why no pass is left, as far as it can be told."""
    away = float(mesh.facet_areas[mesh.facet_normals @ options.region.direction < 0.0].sum() / mesh.facet_areas.sum())
    if dropped:
        short = 1e3 * options.shortest
        remedy = f"all {dropped} passes are shorter than {short:.3g} mm; check the unit of the mesh"
    elif options.region.box is not None:
        low, high = 1e3 * mesh.bounds
        extent = " x ".join(f"{a:.4g}..{b:.4g}" for a, b in zip(low, high, strict=True))
        remedy = f"check the box against the part, which spans {extent} mm"
    else:
        remedy = (
            f"{100.0 * away:.0f} % of the surface faces away from the direction; "
            "turn the direction, or repair the winding"
        )
    return ToolpathError("the region holds nothing to machine", key="region", remedy=remedy)
