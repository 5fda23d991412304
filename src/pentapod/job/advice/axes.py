"""Other tool axes for a job: what to write into [axis], and what the axes are then at the points of a sketch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.units import to_si
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import angle_between, normalised
from pentapod.job.advice.options import AdviceOptions
from pentapod.job.advice.sketch import Sketch
from pentapod.job.schema.axis import AxisKeys
from pentapod.job.schema.job import Job
from pentapod.job.schema.strategies import FILE
from pentapod.planning.estimate import leaning
from pentapod.planning.placement.common_axes import directions
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.samples import ToolpathSamples

Changes = dict[str, dict[str, Any]]
Kinds = Callable[[Sketch], list[ToolpathSamples]]

OF_MODES = ("direction", "point_mm", "line", "places_mm", "directions")
"""The keys of one mode only."""

_FROM_AXES = ("lead_deg", "side_deg")

CHOSEN, WATERLINES = "the planner chooses the tool axis", "waterlines on what is steep"
"""What is said of these changes."""


@dataclass(frozen=True, eq=False)
class AxisChoice:
    """Tool axes to try. words: what they are, empty for the job's own; kinds: samples of a sketch, to choose from.

    narrow: whether another choice holds these axes, so that they are tried with the job's own placement only.
    """

    words: str
    changes: Changes
    kinds: Kinds
    narrow: bool = False


def taken_out(job: Job, table: str, keys: tuple[str, ...]) -> dict[str, Any]:
    """Return the changes that take keys out of a table, of those that the job gives."""
    given = getattr(job.tables, table).model_fields_set
    return {key: None for key in keys if key in given}


def chosen_axis(job: Job) -> Changes:
    """Return the changes by which the planner chooses the tool axis."""
    return {"axis": {"mode": "auto", **taken_out(job, "axis", (*OF_MODES, *_FROM_AXES, "tilt_deg"))}}


def axis_choices(
    job: Job, tool: Tool, sketch: Sketch, constraints: PlacementConstraints, options: AdviceOptions
) -> list[AxisChoice]:
    """Return the job's own axes, and others that its tool and strategy allow, the cheapest to plan first."""
    axis, lean = job.axis, float(getattr(tool, "largest_lean", 0.0))
    own = job.axis.si.tilt
    if axis.mode == "auto":
        found = [AxisChoice("", {}, lambda s: leaning(s.samples(s.normals, 0.0), own, constraints))]
        if own < lean:
            further: Changes = {"axis": {"tilt_deg": None}}
            words = "the tool may lean as far as its type allows"
            found.append(AxisChoice(words, further, lambda s: leaning(s.samples(s.normals, 0.0), lean, constraints)))
    else:
        found = [AxisChoice("", {}, lambda s: [s.samples(s.axes, own)])]
        if own > 0.0:
            # Beside a wall the stem is clear of it only upright.
            upright = AxisChoice(
                "the tool does not lean", {"axis": {"tilt_deg": 0.0}}, lambda s: [s.samples(s.axes, 0.0)], narrow=True
            )
            found.append(_with_waterlines(upright, job, sketch, options))
    if job.toolpath.strategy != FILE:
        usual = AxisKeys().tilt if tool.can_tilt else 0.0
        # A cone that is given may be too narrow, or too wide for a tool that cannot tilt.
        cone = {} if own == usual else taken_out(job, "axis", ("tilt_deg",))
        for direction in _directions(job, sketch, constraints):
            same = axis.mode == "fixed" and np.allclose(normalised(axis.direction), direction, atol=0.001)
            # A beam that leans far from the normal burns another spot. A ball may have any direction, also where the
            # part has overhangs.
            suits = not 0.0 < lean < min(float(angle_between(sketch.normals, direction).max()), 0.5 * np.pi)
            if suits and not (same and not cone):
                narrow = any(choice.changes.get("axis", {}).get("mode") == "fixed" for choice in found)
                found.append(_fixed(job, direction, usual, cone, narrow=narrow))
        if lean > usual and axis.mode != "auto":
            chosen = AxisChoice(
                CHOSEN, chosen_axis(job), lambda s: leaning(s.samples(s.normals, 0.0), lean, constraints)
            )
            found.append(_with_waterlines(chosen, job, sketch, options))
    if tool.can_tilt and axis.mode != "auto":
        wider = [deg for deg in options.cones_deg if deg > axis.tilt_deg]
        widest = None if any(choice.changes.get("axis", {}).get("mode") == "auto" for choice in found) else wider[-1:]
        found += [_wider(deg, narrow=widest != [deg]) for deg in wider]
    return found


def _with_waterlines(choice: AxisChoice, job: Job, sketch: Sketch, options: AdviceOptions) -> AxisChoice:
    """Return a choice with waterlines on walls, all of which the passes of a raster do not cover."""
    slopes = angle_between(sketch.normals, normalised(job.part.si.region_direction))
    steep, table = options.steep_deg, job.toolpath
    if getattr(table, "steep_deg", steep) is not None or not (slopes > to_si(steep, "deg")).any():
        return choice
    changes = {**choice.changes, "toolpath": {"steep_deg": steep}}
    return replace(choice, words=f"{choice.words}, {WATERLINES}", changes=changes)


def _fixed(job: Job, direction: Floats, cone: float, others: dict[str, Any], *, narrow: bool) -> AxisChoice:
    """Return the choice of one direction for the whole path."""
    rounded = [round(float(v), 4) + 0.0 for v in direction]
    keys = {**taken_out(job, "axis", (*OF_MODES, *_FROM_AXES)), **others, "direction": rounded}
    upward = normalised(np.array(rounded))
    return AxisChoice(
        "one direction of the tool for the whole path", {"axis": {"mode": "fixed", **keys}},
        lambda s: [s.samples(upward, cone)], narrow,
    )  # fmt: skip


def _directions(job: Job, sketch: Sketch, constraints: PlacementConstraints) -> list[Floats]:
    """Return directions for a fixed axis: that of the region, and those about which the normals lie."""
    view = normalised(job.part.si.region_direction)
    others = directions(sketch.normals, constraints)
    return [view, *(d for d in others if float(d @ view) < np.cos(to_si(5.0, "deg")) and float(d @ view) > 0.0)]


def _wider(degrees: float, *, narrow: bool) -> AxisChoice:
    """Return the choice of a wider cone around the job's own axes."""
    words = f"the tool may lean by up to {degrees:g} deg"
    changes: Changes = {"axis": {"tilt_deg": degrees}}
    return AxisChoice(words, changes, lambda s: [s.samples(s.axes, to_si(degrees, "deg"))], narrow)
