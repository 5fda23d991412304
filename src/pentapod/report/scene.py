"""The part, the path and the machine in 3D, machine frame, millimetres; the base hangs above the work."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.refusal import Refusal
from pentapod.geometry.rigid import RigidTransform
from pentapod.machine.leg_ends import arms_beside, base_rim, leg_ends, line_top, rails, strut_ends
from pentapod.machine.machine import Machine
from pentapod.mesh.diagnosis import fault_edges
from pentapod.mesh.mesh import Mesh
from pentapod.report.decimate import keep_extremes, thinned_mesh
from pentapod.report.drawings.colours import HELD_COLOUR, LEG_COLOURS, LIMIT_COLOUR, QUIET_COLOUR, leg_colour
from pentapod.report.figure import DETAIL, Figure, packed
from pentapod.report.held import Held
from pentapod.report.signals import Signals
from pentapod.toolpath.linking.partition import Piece
from pentapod.toolpath.toolpath import Toolpath

CUTS_BY = {
    "margin": "cuts, by smallest margin",
    "feed": "cuts, by share of the feed",
    "cause": "cuts, by what limits them",
}
"""Names of the traces of the cuts, of which one at a time is shown."""

CUT_WIDTH = 5.0
LIFT_M = 0.5e-3
"""Shift of the path along the tool axis: a ball's tip runs on and below the surface, which would hide it."""

# The worst is the darkest, so that the order can be read without colour.
_MARGIN_COLOURS = [[0.0, "#5c0019"], [0.2, "#b5371c"], [0.5, "#e39a2d"], [1.0, "#9fe0bd"]]
_CAUSE_COLOURS = ("#14213d", "#8f2d56", "#2a78d6", "#d1603d", "#1baa7a", "#e0a526", "#8ecae6", "#c9b1e8")


def part_trace(mesh: Mesh, placement: RigidTransform, *, down: bool) -> dict[str, Any]:
    """Return the part's surface, thinned for display, lit from above. down: as in `scene_figure`."""
    return _surface(placement.apply(mesh.vertices), mesh.faces, "part", "#c3ced9", down=down)


def fixture_trace(held: Held, *, down: bool) -> dict[str, Any]:
    """Return the surface of the fixture, transparent."""
    return _surface(held.vertices, held.faces, held.name, HELD_COLOUR, down=down) | {"opacity": 0.55}


def _surface(vertices: Floats, faces: Ints, name: str, colour: str, *, down: bool) -> dict[str, Any]:
    vertices, faces = thinned_mesh(vertices, faces, DETAIL.facets)
    x, y, z = 1e3 * vertices.T
    i, j, k = faces.T
    return {
        "type": "mesh3d",
        "x": packed(x), "y": packed(y), "z": packed(z),
        "i": packed(i, "i4"), "j": packed(j, "i4"), "k": packed(k, "i4"),
        "color": colour, "opacity": 1.0, "hoverinfo": "skip", "name": name, "showlegend": True,
        "lighting": {"ambient": 0.8, "diffuse": 0.35, "specular": 0.05, "roughness": 0.9, "fresnel": 0.1},
        "lightposition": {"x": 30_000, "y": -60_000, "z": -40_000 if down else 40_000},
    }  # fmt: skip


def fault_traces(mesh: Mesh, placement: RigidTransform) -> list[dict[str, Any]]:
    """Return the edges of each fault that the mesh has, thinned for display."""
    traces: list[dict[str, Any]] = []
    for k, (name, edges) in enumerate(fault_edges(mesh.vertices, mesh.topology).items()):
        shown = placement.apply(edges[:: max(1, len(edges) // DETAIL.edges)])
        lines = np.concatenate([shown, np.full((len(shown), 1, 3), np.nan)], axis=1).reshape(-1, 3)
        trace = _line3d(1e3 * lines, f"mesh: {name} ({len(edges):,})", leg_colour(k), 4.0)
        # The border of an open sheet is no fault.
        traces.append(trace | ({"visible": "legendonly"} if name == "border" else {}))
    return traces


def path_traces(signals: Signals) -> list[dict[str, Any]]:
    """Return the cuts coloured by margin, by feed and by what limits them (one is shown at a time), and the rest."""
    tips = 1e3 * (signals.tips + LIFT_M * signals.axes)
    margins = np.interp(signals.times, signals.times[signals.margin_rows], signals.smallest_margins)
    shares = 100.0 * signals.speeds / signals.speed_limits
    names, buckets = signals.cause_names, DETAIL.path_buckets
    steps = np.flatnonzero(np.diff(signals.causes))
    ticks = {"tickvals": list(range(len(names))), "ticktext": list(names)}
    causes = {"colorscale": _steps(len(names)), "cmin": -0.5, "cmax": len(names) - 0.5}
    coloured = {
        "margin": (margins, keep_extremes(margins, buckets), _scale(0.5, "smallest<br>margin")),
        "feed": (shares, keep_extremes(shares, buckets), _scale(100.0, "% of the<br>feed")),
        "cause": (
            signals.causes, np.append(steps, steps + 1)[: 2 * buckets],
            causes | {"colorbar": _bar("limited<br>by") | ticks},
        ),
    }  # fmt: skip
    return [
        *(
            _cuts(signals, tips, *how, CUTS_BY[kind], names if kind == "cause" else ()) | {"visible": kind == "margin"}
            for kind, how in coloured.items()
        ),
        _line3d(_with_gaps(tips, ~signals.cutting), "links and rapids", QUIET_COLOUR, 1.5, visible="legendonly"),
    ]


def _cuts(
    signals: Signals,
    tips: Floats,
    values: Floats | Ints,
    kept: Ints,
    look: dict[str, Any],
    name: str,
    words: Sequence[str],
) -> dict[str, Any]:
    """Return the cuts coloured by values (N,), thinned except for rows `kept`. words: texts of integer values."""
    even = np.linspace(0, len(tips) - 1, min(len(tips), 2 * DETAIL.path_buckets)).astype(np.intp)
    keep = np.unique(np.concatenate([even, kept]))
    trace = _line3d(np.where(signals.cutting[keep, None], tips[keep], np.nan), name, "", CUT_WIDTH)
    trace["line"] = {"width": CUT_WIDTH, "color": packed(values[keep]), "showscale": True, **look}
    trace["showlegend"] = False
    trace["text"] = [words[int(v)] for v in values[keep]] if words else [f"{float(v):.3g}" for v in values[keep]]
    trace["hovertemplate"] = "%{text}<br>%{x:.1f}, %{y:.1f}, %{z:.1f} mm<extra></extra>"
    return trace


def _scale(largest: float, title: str) -> dict[str, Any]:
    return {"colorscale": _MARGIN_COLOURS, "cmin": 0.0, "cmax": largest, "colorbar": _bar(title)}


def _bar(title: str) -> dict[str, Any]:
    return {"title": {"text": title}, "thickness": 12, "len": 0.5, "x": 0.98, "y": 0.4}


def _steps(count: int) -> list[list[Any]]:
    """Return a colour scale of `count` equal steps."""
    colours = [_CAUSE_COLOURS[k % len(_CAUSE_COLOURS)] for k in range(count)]
    return [[edge / count, colour] for k, colour in enumerate(colours) for edge in (k, k + 1)]


def refused_traces(tips: Floats, axes: Floats, refusal: Refusal) -> list[dict[str, Any]]:
    """Return the path in grey, and the waypoints of each exceeded limit as points. tips, axes (N, 3)."""
    tips = 1e3 * (tips + LIFT_M * axes)
    path = _line3d(tips[keep_extremes(tips[:, 2], DETAIL.path_buckets)], "toolpath", QUIET_COLOUR, 1.5)
    traces = [path]
    colours = (LIMIT_COLOUR, *LEG_COLOURS)
    for k, shortfall in enumerate(refusal.diagnosis):
        chosen = np.concatenate([np.arange(a, b + 1) for a, b in shortfall.waypoints] or [np.zeros(0, dtype=np.intp)])
        chosen = chosen[: len(tips)][:: max(1, len(chosen) // 3000)]
        points = _line3d(tips[np.minimum(chosen, len(tips) - 1)], shortfall.constraint, colours[k % len(colours)], 1.0)
        points |= {"mode": "markers", "marker": {"size": 3, "color": colours[k % len(colours)]}}
        traces.append(points)
    return traces


def piece_traces(toolpath: Toolpath, pieces: Sequence[Piece]) -> list[dict[str, Any]]:
    """Return the cuts of each set-up in a colour of its own, workpiece frame."""
    tips = 1e3 * (toolpath.tips + LIFT_M * toolpath.axes)
    traces: list[dict[str, Any]] = []
    for k, piece in enumerate(pieces):
        cuts = np.append(piece.cuts(toolpath), False)
        ends = cuts | np.concatenate([[False], cuts[:-1]])
        traces.append(_line3d(_with_gaps(tips, ends), f"set-up {k + 1}", leg_colour(k), 4.0))
    return traces


def machine_traces(machine: Machine, tip: Floats, axis: Floats) -> list[dict[str, Any]]:
    """Return the base, and then the traces that move: legs, arms, strut, platform line, tool and tip, at one pose."""
    base = 1e3 * machine.robot.base_joints
    joints = _line3d(base, "base joints", QUIET_COLOUR, 1.0)
    joints |= {
        "mode": "markers+text", "showlegend": False,
        "marker": {"size": 5.0, "color": [leg_colour(k) for k in range(len(base))]},
        "text": [f"{k + 1}" for k in range(len(base))], "textposition": "top center",
    }  # fmt: skip
    return [
        _line3d(1e3 * base_rim(machine, 73), "base plane", QUIET_COLOUR, 2.0),
        joints,
        *(_line3d(1e3 * rail, "rail", QUIET_COLOUR, 6.0) for rail in rails(machine)),
        *(_line3d(line, *look) for line, look in zip(_pose_lines(machine, tip, axis), _looks(machine), strict=True)),
    ]


def moving_traces(machine: Machine) -> int:
    """Return how many traces move with the pose: legs, arms, strut, platform line, tool, tip; the last ones."""
    return len(_looks(machine))


def _looks(machine: Machine) -> list[tuple[str, str, float]]:
    """Return name, colour and width of each moving line."""
    legs = [(f"leg {k + 1}", leg_colour(k), 8.0) for k in range(machine.robot.n_legs)]
    arms = [(f"arm {k + 1}", leg_colour(k), 5.0) for k in arms_beside(machine)[0].tolist()]
    strut = [("passive limb", QUIET_COLOUR, 8.0)] if machine.limb is not None else []
    return [*legs, *arms, *strut, ("platform", "#6d7480", 14.0), ("tool", "#b9a36b", 8.0), ("tip", LIMIT_COLOUR, 3.0)]


def _pose_lines(machine: Machine, tip: Floats, axis: Floats) -> list[Floats]:
    """Return the two ends of each moving line, mm; the page's script does the same for other poses."""
    nose = tip + machine.bodies.shaft_end * axis
    legs, far = np.stack(leg_ends(machine, tip, axis), axis=1), line_top(machine, tip, axis)
    beside, heights = arms_beside(machine)
    arms = np.stack([tip + heights[:, None] * axis, legs[beside, 1]], axis=1)
    line = (np.array([far, nose]), np.array([nose, tip]), np.array([tip, tip]))
    return [1e3 * ends for ends in (*legs, *arms, *strut_ends(machine, tip, axis), *line)]


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


def _with_gaps(points: Floats, chosen: Bools) -> Floats:
    """Return points (K, 3), thinned, NaN where not chosen so that lines break there."""
    step = max(1, len(points) // DETAIL.path_buckets)
    edges = np.flatnonzero(np.diff(chosen.astype(np.int8)))
    keep = np.unique(np.concatenate([np.arange(0, len(points), step), edges, edges + 1]))
    return np.where(chosen[keep, None], points[keep], np.nan)
