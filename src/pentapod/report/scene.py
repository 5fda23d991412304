"""The part, the path and the machine in 3D, machine frame, millimetres; the base hangs above the work."""

from __future__ import annotations

from typing import Any

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.geometry.rigid import RigidTransform
from pentapod.machine.machine import Machine
from pentapod.refusal import Refusal
from pentapod.report.decimate import keep_extremes, thinned_mesh
from pentapod.report.figure import LEG_COLOURS, LIMIT_COLOUR, QUIET_COLOUR, Figure, packed
from pentapod.toolpath.faults import faults
from pentapod.toolpath.mesh import Mesh

MACHINE_TRACES = 8
"""Traces that move with the pose: five legs, the platform line, the tool, the tip. They come last."""

_MOST_FACETS = 60_000
_MOST_EDGES = 5_000
_BUCKETS = 4_000
_LIFT_M = 0.5e-3  # along the tool axis: a ball's tip runs on and below the surface, which would hide its path
_MARGIN_COLOURS = [[0.0, "#c8322b"], [0.15, "#ee8f3c"], [0.4, "#e9d35b"], [1.0, "#2f9e6e"]]


def part_trace(mesh: Mesh, placement: RigidTransform, *, down: bool) -> dict[str, Any]:
    """Return the part's surface, thinned for display, lit from above. down: as in `scene_figure`."""
    vertices, faces = thinned_mesh(mesh.vertices, mesh.faces, _MOST_FACETS)
    x, y, z = 1e3 * placement.apply(vertices).T
    i, j, k = faces.T
    return {
        "type": "mesh3d",
        "x": packed(x), "y": packed(y), "z": packed(z),
        "i": packed(i, "i4"), "j": packed(j, "i4"), "k": packed(k, "i4"),
        "color": "#c3ced9", "opacity": 1.0, "hoverinfo": "skip", "name": "part", "showlegend": True,
        "lighting": {"ambient": 0.8, "diffuse": 0.35, "specular": 0.05, "roughness": 0.9, "fresnel": 0.1},
        "lightposition": {"x": 30_000, "y": -60_000, "z": -40_000 if down else 40_000},
    }  # fmt: skip


def fault_traces(mesh: Mesh, placement: RigidTransform) -> list[dict[str, Any]]:
    """Return the edges of each fault that the mesh has, thinned for display."""
    traces: list[dict[str, Any]] = []
    for k, (name, edges) in enumerate(faults(mesh).items()):
        shown = placement.apply(edges[:: max(1, len(edges) // _MOST_EDGES)])
        lines = np.concatenate([shown, np.full((len(shown), 1, 3), np.nan)], axis=1).reshape(-1, 3)
        trace = _line3d(1e3 * lines, f"mesh: {name} ({len(edges):,})", LEG_COLOURS[k % len(LEG_COLOURS)], 4.0)
        # An open sheet's border is as it should be: there to look at, not to alarm.
        traces.append(trace | ({"visible": "legendonly"} if name == "border" else {}))
    return traces


def path_traces(tips: Floats, axes: Floats, cutting: Ints, margins: Floats) -> list[dict[str, Any]]:
    """Return the cuts coloured by margin, and the other motion in grey.

    tips, axes (N, 3), cutting, margins (N,).
    """
    tips = 1e3 * (tips + _LIFT_M * axes)
    keep = keep_extremes(margins, _BUCKETS)
    cuts = np.where(cutting[:, None] != 0, tips, np.nan)[keep]
    other = _with_gaps(tips, cutting == 0)
    coloured = _line3d(cuts, "cuts, by smallest margin", "", 5)
    coloured["line"] = {
        "width": 5, "color": packed(margins[keep]), "colorscale": _MARGIN_COLOURS, "cmin": 0.0, "cmax": 0.5,
        "showscale": True,
        "colorbar": {
            "title": {"text": "cuts:<br>smallest<br>margin"}, "thickness": 12, "len": 0.5, "x": 0.98, "y": 0.4,
        },
    }  # fmt: skip
    coloured["showlegend"] = False
    coloured["text"] = [f"margin {value:.3f}" for value in margins[keep]]
    coloured["hovertemplate"] = "%{text}<br>%{x:.1f}, %{y:.1f}, %{z:.1f} mm<extra></extra>"
    return [coloured, _line3d(other, "links and rapids", QUIET_COLOUR, 1.5, visible="legendonly")]


def blamed_traces(tips: Floats, axes: Floats, refusal: Refusal) -> list[dict[str, Any]]:
    """Return the path in grey, and for each blame the waypoints that it names, as points. tips, axes (N, 3)."""
    tips = 1e3 * (tips + _LIFT_M * axes)
    path = _line3d(tips[keep_extremes(tips[:, 2], _BUCKETS)], "toolpath", QUIET_COLOUR, 1.5)
    traces = [path]
    colours = (LIMIT_COLOUR, *LEG_COLOURS)
    for k, blame in enumerate(refusal.blames):
        chosen = np.concatenate([np.arange(a, b + 1) for a, b in blame.waypoints] or [np.zeros(0, dtype=np.intp)])
        chosen = chosen[: len(tips)][:: max(1, len(chosen) // 3000)]
        points = _line3d(tips[np.minimum(chosen, len(tips) - 1)], blame.constraint, colours[k % len(colours)], 1.0)
        points |= {"mode": "markers", "marker": {"size": 3, "color": colours[k % len(colours)]}}
        traces.append(points)
    return traces


def machine_traces(machine: Machine, tip: Floats, axis: Floats) -> list[dict[str, Any]]:
    """Return the base, and then the traces that move: legs, platform line, tool and tip, at one pose."""
    base = np.column_stack([machine.pentapod.base, np.zeros(5)]) * 1e3
    radius = 1.12 * float(np.linalg.norm(base - base.mean(axis=0), axis=1).max())
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    rim = base.mean(axis=0) + radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(73)])
    joints = _line3d(base, "base joints", QUIET_COLOUR, 1.0)
    joints |= {"mode": "markers", "marker": {"size": 5, "color": list(LEG_COLOURS)}, "showlegend": False}
    return [
        _line3d(rim, "base plane", QUIET_COLOUR, 2.0),
        joints,
        *(_line3d(line, *look) for line, look in zip(_pose_lines(machine, tip, axis), _LOOKS, strict=True)),
    ]


_LOOKS: tuple[tuple[str, str, float], ...] = (
    *((f"leg {k + 1}", LEG_COLOURS[k], 8.0) for k in range(5)),
    ("platform", "#6d7480", 14.0),
    ("tool", "#b9a36b", 8.0),
    ("tip", LIMIT_COLOUR, 3.0),
)


def _pose_lines(machine: Machine, tip: Floats, axis: Floats) -> list[Floats]:
    """Return the two ends of each moving line, mm; the page's script does the same for other poses."""
    robot = machine.pentapod
    joints = tip + (machine.tool_length - robot.offsets)[:, None] * axis
    base = np.column_stack([robot.base, np.zeros(5)])
    nose = tip + machine.bodies.shaft_end * axis
    far = joints[int(np.argmin(robot.offsets))]
    lines = [np.array([base[k], joints[k]]) for k in range(5)]
    return [1e3 * line for line in (*lines, np.array([far, nose]), np.array([nose, tip]), np.array([tip, tip]))]


def scene_figure(traces: list[dict[str, Any]], *, down: bool) -> Figure:
    """Return the figure of traces. down: z points down, as in the machine frame, from the base to the work."""
    sign = -1 if down else 1
    eye = {"x": 0.8, "y": -0.95, "z": 0.45 * sign} if down else {"x": 1.3, "y": -1.5, "z": 1.0}
    centre = {"x": 0.0, "y": 0.0, "z": 0.08 if down else 0.0}
    axis = {"showbackground": False, "zeroline": False}
    scene = {
        "aspectmode": "data",
        "dragmode": "orbit",  # the other mode knows no up but +z
        "camera": {"up": {"x": 0, "y": 0, "z": sign}, "eye": eye, "center": centre},
        **{f"{name}axis": axis | {"title": {"text": f"{name}, mm"}} for name in "xyz"},
    }
    legend = {"x": 0.0, "y": 1.0, "itemsizing": "constant", "bgcolor": "rgba(0,0,0,0)"}
    layout = {"scene": scene, "height": 640, "margin": {"l": 0, "r": 0, "t": 0, "b": 0}, "legend": legend}
    return {"data": traces, "layout": layout}


def _line3d(points: Floats, name: str, colour: str, width: float, **more: Any) -> dict[str, Any]:
    x, y, z = points.T
    tip = name == "tip"
    return {
        "type": "scatter3d",
        "mode": "markers" if tip else "lines",
        "x": packed(x), "y": packed(y), "z": packed(z),
        "name": name,
        "line": {"color": colour, "width": width},
        "marker": {"color": colour, "size": width},
        "hoverinfo": "name",
        "connectgaps": False,
        **more,
    }  # fmt: skip


def _with_gaps(points: Floats, chosen: Any) -> Floats:
    """Return points (K, 3), thinned, NaN where not chosen so that lines break there."""
    step = max(1, len(points) // _BUCKETS)
    edges = np.flatnonzero(np.diff(chosen.astype(np.int8)))
    keep = np.unique(np.concatenate([np.arange(0, len(points), step), edges, edges + 1]))
    return np.where(chosen[keep, None], points[keep], np.nan)
