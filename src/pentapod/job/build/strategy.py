"""From a job's table [toolpath] to the options of its strategy, in SI units."""

from __future__ import annotations

from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.job.schema.job import Job
from pentapod.job.schema.strategies import (
    CoverTable,
    CrossHatchTable,
    DrawingTable,
    EdgesTable,
    FileTable,
    ImageTable,
    OffsetTable,
    PolylineTable,
    RasterTable,
    SpiralTable,
    StrategyTable,
    TextTable,
    WaterlineTable,
)
from pentapod.job.schema.table import Vector
from pentapod.toolpath import (
    CrossHatchOptions,
    CurveOptions,
    EdgeOptions,
    ImageOptions,
    OffsetOptions,
    PathOptions,
    PolylineOptions,
    RasterOptions,
    Region,
    SpiralOptions,
    WaterlineOptions,
    lettering,
    read_darkness,
    read_lines,
    read_points,
)

_MM = 1e-3
_MM_MIN = 1e-3 / 60.0


def job_options(job: Job) -> PathOptions:
    """Return the options of the job's strategy, its files read.

    Raises ToolpathError for a drawing, picture or list of points that cannot be used.
    """
    table = job.toolpath
    if isinstance(table, FileTable):
        raise TypeError("a toolpath file has no options")
    common = _common(job, table)
    if isinstance(table, CoverTable):
        return _covering(job, table, common)
    if isinstance(table, EdgesTable):
        return EdgeOptions(**common, which=table.which, sharpest=_rad(table.sharpest_deg))
    if isinstance(table, DrawingTable):
        lines = read_lines(job.file("file"), 0.25 * common["chordal"] / table.scale)
        lines = _centred(lines) if table.centred else lines
        return CurveOptions(**common, **_laid(table), lines=lines, scale=table.scale)
    if isinstance(table, TextTable):
        height, spacing = table.height_mm * _MM, table.letter_spacing
        lines = lettering(table.text, height, spacing=spacing, align=table.align)
        return CurveOptions(**common, **_laid(table), lines=lines)
    if isinstance(table, PolylineTable):
        lines = read_points(job.file("file"))
        return PolylineOptions(**common, lines=lines, towards=table.towards, depth=table.depth_mm * _MM)
    return ImageOptions(
        **common,
        **_laid(table),
        darkness=read_darkness(job.file("file")),
        width=table.width_mm * _MM,
        stepover=table.stepover_mm * _MM,
        effect=table.effect,
        levels=table.levels,
        threshold=table.threshold,
    )


def job_region(job: Job) -> Region:
    """Return which part of the surface a job machines."""
    part = job.part
    box = None if part.region_box_mm is None else np.array(part.region_box_mm) * _MM
    return Region(direction=part.region_direction, angle=_rad(part.region_angle_deg), box=box)


def _covering(job: Job, table: CoverTable, common: dict[str, Any]) -> PathOptions:
    """Return the options of a strategy that covers the surface."""
    common = {
        **common,
        "stepover": _length(table.stepover_mm),
        "scallop": _length(table.scallop_mm),
        "fill": table.fill,
    }
    if isinstance(table, CrossHatchTable):
        way: dict[str, Any] = {"direction": _rad(table.direction_deg), "pattern": table.pattern}
        return CrossHatchOptions(**common, **way, angle=_rad(table.angle_deg))
    if isinstance(table, RasterTable):
        return RasterOptions(**common, direction=_rad(table.direction_deg), pattern=table.pattern)
    if isinstance(table, WaterlineTable):
        return WaterlineOptions(**common, upright=table.upright, shallowest=_rad(table.shallowest_deg))
    if isinstance(table, OffsetTable):
        curve = None if table.curve is None else read_points(job.file("curve"))[0]
        return OffsetOptions(**common, curve=curve)
    if isinstance(table, SpiralTable):
        return SpiralOptions(**common, form=table.form, centre=_point(table.centre_mm))
    raise TypeError(f"no options for {type(table).__name__}")


def _common(job: Job, table: StrategyTable) -> dict[str, Any]:
    """Return what every strategy is told."""
    feed = job.feed
    link = feed.cut_mm_min if feed.link_mm_min is None else feed.link_mm_min
    return {
        "region": job_region(job),
        "chordal": job.tolerance.chordal_mm * _MM,
        "spacing": table.spacing_mm * _MM,
        "axis_step": _rad(table.axis_step_deg),
        "closest": table.closest_mm * _MM,
        "shortest": table.shortest_mm * _MM,
        "clearance": table.clearance_mm * _MM,
        "approach": table.approach_mm * _MM,
        "entry": table.entry,
        "stay": _length(table.stay_mm),
        "hop": table.hop_mm * _MM,
        "feed": feed.cut_mm_min * _MM_MIN,
        "link_feed": link * _MM_MIN,
    }


def _laid(table: DrawingTable | TextTable | ImageTable) -> dict[str, Any]:
    return {
        "laying": table.laying,
        "position": _point(table.position_mm),
        "rotation": _rad(table.rotation_deg),
        "depth": table.depth_mm * _MM,
    }


def _centred(lines: list[Floats]) -> list[Floats]:
    """Return lines (n, 2) with the middle of their bounds at the origin."""
    points = np.concatenate(lines)
    return [line - 0.5 * (points.min(axis=0) + points.max(axis=0)) for line in lines]


def _point(point: Vector | None) -> Floats | None:
    return None if point is None else np.array(point) * _MM


def _length(length_mm: float | None) -> float | None:
    return None if length_mm is None else length_mm * _MM


def _rad(degrees: float) -> float:
    return float(np.radians(degrees))
