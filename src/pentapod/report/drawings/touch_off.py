"""Touch-off points: places on the part at which an operator checks, with the machine, that it stands right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.units import from_si
from pentapod.mesh.query.tree import FacetTree
from pentapod.report.drawings.planned_run import PlannedRun
from pentapod.toolpath.toolpath import SegmentKind

COUNT = 3
"""Points that hold a plane."""

SAME = 1e-6
"""Metres by which points may differ that count as equal."""

INNER = 0.1
"""Share of the waypoints at each end of x, y and z, mesh frame, that are no touch-off points: there a part may end."""


@dataclass(frozen=True, eq=False)
class TouchOff:
    """A point of the part and the tool on it, metres. waypoint: of the toolpath.

    on_part, in_machine (3,): the point, mesh frame and machine frame; tip, axis (3,): of the tool, machine frame;
    legs (n_legs,) as drives count.
    """

    waypoint: int
    on_part: Floats
    in_machine: Floats
    tip: Floats
    axis: Floats
    legs: Floats


def touch_off_points(run: PlannedRun) -> list[TouchOff]:
    """Return points of the cuts that are far from each other, with the tool as the program has it there."""
    rows = _spread(run, COUNT)
    if not len(rows):
        return []
    tips, axes = run.tips[rows], run.axes[rows]
    centres = run.placement.inverse().apply(tips + run.toolpath.tilt_centre * axes)
    feet = centres - FacetTree.of(run.mesh).closest(centres)[1]
    legs = run.counted(tips, axes)
    there = run.placement.apply(feet)
    return [
        TouchOff(int(row), *values) for row, *values in zip(rows.tolist(), feet, there, tips, axes, legs, strict=True)
    ]


def touch_off_table(points: list[TouchOff]) -> str:
    """Return the points as an HTML table with a sentence; empty where there are none."""
    if not points:
        return ""
    rows = "".join(_row(number, point) for number, point in enumerate(points, start=1))
    return (
        '<h3>Touch-off</h3><p class="hint">With the tool of the job at these legs, it just touches the part at these '
        "points, in mm. Stop short of a point, and come down to it along the tool axis.</p>"
        '<div class="scroll"><table class="touch-off"><thead><tr><th>point</th><th>on the mesh</th>'
        "<th>in the machine</th><th>tip of the tool</th><th>tool axis</th><th>legs</th></tr></thead>"
        f"<tbody>{rows}</tbody></table></div>"
    )


def touch_off_text(points: list[TouchOff]) -> str:
    """Return the points as a CSV file, mm: one line each, leg 1 first."""
    legs = len(points[0].legs) if points else 0
    names = [f"{what}_{axis}" for what in ("mesh", "machine", "tip", "axis") for axis in "xyz"]
    lines = [",".join(["point", "waypoint", *names, *(f"leg_{leg + 1}" for leg in range(legs))])]
    for number, point in enumerate(points, start=1):
        places = [from_si(value, "mm") for value in (point.on_part, point.in_machine, point.tip)]
        values = np.concatenate([*places, point.axis, from_si(point.legs, "mm")])
        lines.append(
            ",".join([f"{number}", f"{point.waypoint}", *(f"{round(v, 6) + 0.0:.6f}" for v in values.tolist())])
        )
    return "\n".join(lines) + "\n"


def _row(number: int, point: TouchOff) -> str:
    cells = [
        str(number), *(_numbers(from_si(value, "mm"), 2) for value in (point.on_part, point.in_machine, point.tip)),
        _numbers(point.axis, 4), _numbers(from_si(point.legs, "mm"), 3),
    ]  # fmt: skip
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def _numbers(values: Floats, digits: int) -> str:
    return ", ".join(f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−") for value in values.tolist())


def _spread(run: PlannedRun, count: int) -> Ints:
    """Return waypoints (k,) on cuts that are far from each other, but not at the end of what is machined.

    The first is far from the middle.
    """
    toolpath = run.toolpath
    kinds = np.array([toolpath.segments[k].kind is SegmentKind.CUT for k in toolpath.segment_of_interval])
    rows = np.flatnonzero(kinds)
    if len(rows) < count:
        return rows[:0]
    # Rounded, so that a run read back from its folder, in millimetres, has the same points.
    points = np.round(toolpath.tilt_centres[rows], 7)
    low, high = np.quantile(points, (INNER, 1.0 - INNER), axis=0)
    inner = ((points >= low - SAME) & (points <= high + SAME)).all(axis=1)
    if inner.sum() >= count:
        rows, points = rows[inner], points[inner]
    chosen: list[int] = []
    nearest = np.round(np.linalg.norm(points - points.mean(axis=0), axis=1), 7)
    while len(chosen) < count:
        chosen.append(int(nearest.argmax()))
        off = np.round(np.linalg.norm(points - points[chosen[-1]], axis=1), 7)
        nearest = off if len(chosen) == 1 else np.minimum(nearest, off)
    return rows[chosen]
