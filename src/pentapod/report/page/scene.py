"""The scene as the page's script draws it: machine, part, fixture, table and path, mm, in the machine's frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.refusal import Refusal
from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.solids import Solid
from pentapod.job.build.tool import job_tool
from pentapod.job.outcome import Outcome, SetUps
from pentapod.machine.leg_ends import base_rim, leg_ends, rails
from pentapod.machine.machine import Machine
from pentapod.mesh.diagnosis import fault_edges
from pentapod.mesh.mesh import Mesh
from pentapod.planning.placement.placed_path import PlacedPath, UnplacedPath
from pentapod.report.decimate import thinned_mesh
from pentapod.report.drawings.colours import HELD_COLOUR, LIMIT_COLOUR, PART_COLOUR, QUIET_COLOUR, leg_colour
from pentapod.report.drawings.held import held_at
from pentapod.report.figure import DETAIL
from pentapod.report.pack import MESH_STEP_MM, Packed
from pentapod.report.page.keys import joints_beside
from pentapod.report.signals import Signals
from pentapod.toolpath.linking.partition import Piece
from pentapod.toolpath.toolpath import Toolpath

LIFT_M = 0.5e-3
"""Shift of a path along the tool axis: a ball's tip runs on and below the surface, which would hide it."""

SLEEVE = 0.9
"""Length of the thick part of a leg, as a share of its shortest length."""

TABLE_MM = (60.0, 12.0)
"""By how much the table that is drawn is larger than the part on each side, and how thick it is."""

BROAD, FINE = 3.0, 1.0
"""Widths of lines, pixels."""


def scene_of(packed: Packed, outcome: Outcome, signals: Signals | None, machine: Machine) -> dict[str, Any]:
    """Add the arrays of the scene to the page's and return the rest.

    It is in the machine where a placement was found or tried, else the workpiece alone. machine: as the program moves
    it.
    """
    mesh, toolpath, refusal, placed = (
        outcome.find(Mesh),
        outcome.find(Toolpath),
        outcome.refusal,
        shown_placement(outcome),
    )
    transform = RigidTransform.identity() if placed is None else placed.placement.transform
    scene: dict[str, Any] = {
        "up": 1 if placed is None or machine.work.centre[2] < 0.0 else -1,
        "meshes": [], "machine": None, "table": None, "lines": [], "dots": [], "pose": None,
    }  # fmt: skip
    if mesh is not None:
        scene["meshes"].append(_part(packed, mesh, transform))
        scene["lines"] += fault_lines(packed, mesh, transform)
    if placed is not None:
        beside = np.zeros(0, dtype=np.intp)
        if signals is not None:
            beside = joints_beside(machine, signals.tips[0], signals.axes[0])
        elif placed.placement.rail_positions is not None:
            machine = machine.at(placed.placement.rail_positions)
        if (held := held_at(outcome.job, placed.placement.transform)) is not None:
            vertices, faces = thinned_mesh(held.vertices, held.faces, DETAIL.facets)
            packed.mesh("held", 1e3 * vertices, faces)
            moves = outcome.job.fixture.frame != "machine"
            scene["meshes"].append(_mesh("held", held.name, HELD_COLOUR, 0.55) | {"moves": moves})
        if signals is None:
            worst = int(placed.margins.min(axis=1).argmin())
            tip, axis = placed.tips[worst], placed.axes[worst]
            beside = joints_beside(machine, tip, axis)
            joints = 1e3 * leg_ends(machine, tip, axis)[1][beside]
            scene["pose"] = {"tip": (1e3 * tip).tolist(), "axis": axis.tolist(), "joints": joints.ravel().tolist()}
        scene["machine"] = machine_data(machine, job_tool(outcome.job, machine).solids, beside)
        scene["table"] = _table(outcome, mesh, transform)
    if signals is None and toolpath is not None:
        shown = toolpath if placed is None else placed
        tips = 1e3 * (shown.tips + LIFT_M * shown.axes)
        if refusal is not None:
            scene["lines"].append(
                _polyline(packed, "toolpath", tips, np.ones(len(tips), dtype=np.bool_), QUIET_COLOUR, FINE)
            )
            scene["dots"] += _exceeded(packed, tips, refusal)
        elif (setups := outcome.find(SetUps)) is not None:
            scene["lines"] += _pieces(packed, toolpath, tips, [part.piece for part in setups.parts])
    return scene


def shown_placement(outcome: Outcome) -> PlacedPath | None:
    """Return the placement of a run; of one that was refused the best attempt."""
    placed, refusal = outcome.find(PlacedPath), outcome.refusal
    return refusal.attempt if placed is None and isinstance(refusal, UnplacedPath) else placed


def machine_data(machine: Machine, tool: Sequence[Solid], beside: Ints) -> dict[str, Any]:
    """Return the machine's bodies; beside: legs with joints off the tool axis, which come with each pose."""
    robot, bodies, rim = machine.robot, machine.bodies, 1e3 * base_rim(machine, 4)
    first, second = rim[1] - rim[0], rim[2] - rim[0]
    centre = 1e3 * robot.base_joints.mean(axis=0)
    normal = np.cross(first, second)
    heights = 1e3 * (machine.tool_length - robot.offsets)
    limb = machine.limb
    return {
        "base": (1e3 * robot.base_joints).tolist(),
        "rim": {
            "centre": centre.tolist(), "normal": (normal / np.linalg.norm(normal)).tolist(),
            "radius": float(1e3 * np.linalg.norm(robot.base_joints - robot.base_joints.mean(axis=0), axis=1).max()),
        },
        "legs": [
            {"colour": leg_colour(k), "sleeve": SLEEVE * 1e3 * float(shortest)}
            for k, shortest in enumerate(machine.legs.min_length)
        ],
        "legRadius": 1e3 * bodies.leg_radius,
        "heights": heights.tolist(),
        "beside": beside.tolist(),
        "spindle": {
            "radius": 1e3 * bodies.shaft_radius, "low": 1e3 * bodies.shaft_end,
            "high": 1e3 * (machine.tool_length - machine.line_top),
        },
        "solids": [
            {
                "kind": solid.kind, "low": 1e3 * solid.low, "high": 1e3 * solid.high,
                "lowRadius": 1e3 * solid.low_radius, "highRadius": 1e3 * solid.high_radius,
                "rounding": 1e3 * solid.rounding,
            }
            for solid in tool
        ],
        "limb": None if limb is None else {
            "rail": (1e3 * rails(machine)[0]).tolist(), "height": 1e3 * (machine.tool_length - limb.joint),
            "radius": 1e3 * limb.radius,
        },
    }  # fmt: skip


def _part(packed: Packed, mesh: Mesh, transform: RigidTransform) -> dict[str, Any]:
    """Return the part. Its vertices stay in its own frame: there neighbours differ less, which packs better."""
    most = DETAIL.facets
    while True:
        vertices, faces = thinned_mesh(mesh.vertices, mesh.faces, most)
        alone = Packed()
        alone.mesh("part", 1e3 * vertices, faces)
        if len(alone.block) <= DETAIL.part_bytes or most < DETAIL.least_facets:
            break
        most = min(most, len(faces)) // 2
    packed.mesh("part", 1e3 * vertices, faces)
    matrix = [*transform.rotation.ravel().tolist(), *(1e3 * transform.translation).tolist()]
    return {**_mesh("part", "part", PART_COLOUR, 1.0), "matrix": matrix, "isPart": True, "moves": True}


def _mesh(array: str, name: str, colour: str, opacity: float) -> dict[str, Any]:
    """Return a mesh. moves: with the part, when that is dragged."""
    arrays = {"vertices": f"{array}.vertices", "faces": f"{array}.faces"}
    still = {"matrix": None, "isPart": False, "moves": False}
    return {"name": name, "colour": colour, "opacity": opacity, **still, **arrays}


def _table(outcome: Outcome, mesh: Mesh | None, transform: RigidTransform) -> dict[str, Any] | None:
    """Return the table's plate under the part; None where the job names no height."""
    table, (room, thick) = outcome.job.placement, TABLE_MM
    if mesh is None or table.mode != "table":
        return None
    corners = 1e3 * transform.apply(mesh.vertices)[:, :2]
    low, high = corners.min(axis=0), corners.max(axis=0)
    half = 0.5 * float((high - low).max()) + room
    return {"z": float(table.table_z_mm), "centre": (0.5 * (low + high)).tolist(), "half": half, "thick": thick}


def fault_lines(packed: Packed, mesh: Mesh, transform: RigidTransform) -> list[dict[str, Any]]:
    """Return the edges of each fault that the mesh has, thinned for display."""
    lines: list[dict[str, Any]] = []
    for k, (name, edges) in enumerate(fault_edges(mesh.vertices, mesh.topology).items()):
        shown = transform.apply(edges[:: max(1, len(edges) // DETAIL.edges)])
        name_shown, points = f"mesh: {name} ({len(edges):,})", 1e3 * shown.reshape(-1, 3)
        line = _lines(packed, name_shown, points, np.arange(0, len(points), 2), leg_colour(k), BROAD)
        lines.append(line | {"shown": name != "border"})  # the border of an open sheet is no fault
    return lines


def _lines(packed: Packed, name: str, points: Floats, runs: Ints, colour: str, width: float) -> dict[str, Any]:
    """Return lines along points (N, 3), mm; runs: where each line begins."""
    key = f"lines.{sum(array.startswith('lines.') for array in packed.directory) // 2}"
    packed.numbers(f"{key}.points", points, MESH_STEP_MM)
    packed.whole(f"{key}.runs", runs)
    arrays = {"points": f"{key}.points", "runs": f"{key}.runs"}
    return {"name": name, "colour": colour, "width": width, "shown": True, **arrays}


def _polyline(packed: Packed, name: str, points: Floats, chosen: Bools, colour: str, width: float) -> dict[str, Any]:
    """Return the line through the chosen points (N, 3), thinned, with gaps at those that are not."""
    step = max(1, len(points) // DETAIL.still_points)
    edges = np.flatnonzero(np.diff(chosen.astype(np.int8)))
    keep = np.unique(np.concatenate([np.arange(0, len(points), step), edges, edges + 1, [len(points) - 1]]))
    keep = keep[chosen[keep]]
    gaps = np.concatenate([[0], np.cumsum(~chosen)])
    runs = np.flatnonzero(np.append(True, gaps[keep[1:]] > gaps[keep[:-1]])[: len(keep)])
    return _lines(packed, name, points[keep], runs, colour, width)


def _exceeded(packed: Packed, tips: Floats, refusal: Refusal) -> list[dict[str, Any]]:
    """Return the waypoints of each exceeded limit as dots; tips (N, 3), mm."""
    groups: list[dict[str, Any]] = []
    for k, shortfall in enumerate(refusal.diagnosis):
        chosen = np.concatenate([np.arange(a, b + 1) for a, b in shortfall.waypoints] or [np.zeros(0, dtype=np.intp)])
        chosen = np.minimum(chosen[:: max(1, -(-len(chosen) // DETAIL.still_points))], len(tips) - 1)
        packed.numbers(f"dots.{k}", tips[chosen], MESH_STEP_MM)
        colour = LIMIT_COLOUR if k == 0 else leg_colour(k - 1)
        groups.append({"name": shortfall.constraint, "points": f"dots.{k}", "colour": colour, "shown": True})
    return groups


def _pieces(packed: Packed, toolpath: Toolpath, tips: Floats, pieces: Sequence[Piece]) -> list[dict[str, Any]]:
    """Return the cuts of each set-up in a colour of its own; tips (N, 3), mm."""
    lines: list[dict[str, Any]] = []
    for k, piece in enumerate(pieces):
        cuts = np.append(piece.cuts(toolpath), False)
        ends = cuts | np.concatenate([[False], cuts[:-1]])
        lines.append(_polyline(packed, f"set-up {k + 1}", tips, ends, leg_colour(k), BROAD))
    return lines
