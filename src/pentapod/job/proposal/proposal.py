"""Proposal: a job for a part, from its size and shape: unit, side, region, cutter, strategy and placement."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import MeshError
from pentapod.base.units import from_si, to_si
from pentapod.base.values import Value
from pentapod.geometry.directions import tangent_frame
from pentapod.geometry.runs import distinct
from pentapod.job.proposal.cutter import cutter_for, rounded
from pentapod.job.proposal.options import OPTIONS
from pentapod.machine.machine import Machine
from pentapod.machine.parts import WorkVolume
from pentapod.mesh.io.load import UNITS, load_mesh
from pentapod.mesh.io.registry import states_unit
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.heightfield import HeightField
from pentapod.mesh.region import Region
from pentapod.toolpath.strategies.waterline import WaterlineOptions

_SIDES = {
    f"{sign}{axis}": np.array([float(axis == other) for other in "xyz"]) * (1.0 if sign == "+" else -1.0)
    for sign in "+-"
    for axis in "xyz"
}
"""The directions that a side of a part can face, by name."""


@dataclass(frozen=True)
class Proposal(Value):
    """A job for a part. tables: values by table and key; reasons: for some of them; remarks: sentences to print."""

    tables: dict[str, dict[str, Any]]
    reasons: dict[tuple[str, str], str]
    remarks: tuple[str, ...]


def propose(part: Path, machine: Machine, name: str) -> Proposal:
    """Return a job for a mesh file on a machine, which the job calls `name`. Raises MeshError where it is unusable."""
    unit = None if states_unit(part) else _unit(part, machine.work)
    mesh, broken = _loaded(part, unit)
    table: dict[str, Any] = {} if unit is None else {"unit": unit}
    reasons: dict[tuple[str, str], str] = {}
    mesh, cleared = _without_debris(mesh, table, reasons)
    size = " x ".join(f"{from_si(extent, 'mm'):.4g}" for extent in mesh.diagnosis.extents)
    guess = "" if unit is None else f", if its unit is {unit}: a guess from its size"
    remarks = [f"the part is {size} mm{guess}", *cleared]
    if unit is not None:
        reasons["part", "unit"] = f"a guess: the file does not say it; the part is {size} mm then"
    if broken:
        table["repair"], reasons["part", "repair"] = True, broken
        remarks.append(f"repair = true: {broken}")
    side, flipped = _side(mesh)
    if flipped:
        table["flip"], mesh = True, mesh.flipped()
        reasons["part", "flip"] = "this open surface shows its back to the top"
        remarks.append("it is an open surface that shows its back to the top: flip = true turns it over")
    direction = _SIDES[side]
    if side != "+z":
        table["region_direction"] = [float(v) + 0.0 for v in direction]
        reasons["part", "region_direction"] = "the side that shows most of the surface"
    remarks.append(f"machined from {side}")
    box, where = _box(mesh, direction, machine.work)
    region = Region(box=box, direction=direction)
    patch = Patch.of(mesh, replace(region, angle=0.5 * np.pi))
    if not len(patch.faces):
        raise MeshError("no side of this surface can be machined", file=part, remedy="check the mesh")
    if box is not None:
        table["region_box_mm"] = [[rounded(v) for v in corner] for corner in from_si(box, "mm")]
        reasons["part", "region_box_mm"] = f"the part is larger than the machine's work volume; this is {where}"
        remarks.append(
            f"it is larger than the work volume: a box {where} is machined (region_box_mm), "
            f"{100.0 * float(patch.areas.sum() / mesh.facet_areas.sum()):.2g} % of the surface"
        )
    toolpath, cutter = _toolpath(patch, direction), cutter_for(mesh, patch, direction, stands=box is None)
    toolpath = {**toolpath, "stepover_mm": rounded(OPTIONS.stepover * cutter.diameter_mm)}
    tool = {"type": "ball", "diameter_mm": cutter.diameter_mm}
    if cutter.why:
        reasons["tool", "diameter_mm"] = cutter.why
    if cutter.foot is not None:
        table[cutter.foot.key], reasons["part", cutter.foot.key] = cutter.foot.value, cutter.foot.why
        remarks.append(cutter.foot.remark)
    flatter = "region_angle_deg" in table
    if not flatter and toolpath["strategy"] == "raster" and (walls := _walls(patch, direction)) > OPTIONS.walls:
        toolpath["steep_deg"] = OPTIONS.steep_deg
        reasons["toolpath", "steep_deg"] = "upright walls get waterlines: passes of a raster do not cover all of them"
        remarks.append(f"upright walls, {100.0 * walls:.2g} % of what faces {side}, get waterlines (steep_deg)")
    reasons["placement", "table_z_mm"] = (
        "a guess: half the height of what is machined is then in the middle of the work volume; set that of your table"
    )
    placement = _placement(mesh, patch, direction, machine.work)
    remarks += [
        f"a ball of {tool['diameter_mm']:g} mm, {toolpath['strategy']}, {toolpath['stepover_mm']:g} mm apart",
        f"table_z_mm = {placement['table_z_mm']:g} is a guess, with which this part is in the middle of the "
        "work volume: set the height of your table",
    ]
    tables = {
        "part": table,
        "machine": {"file" if name.endswith(".toml") else "name": name},
        "tool": tool,
        "toolpath": toolpath,
        "axis": {"mode": "auto"},
        "feed": {"cut_mm_min": OPTIONS.feed_mm_min},
        "placement": placement,
    }
    return Proposal(tables, reasons, tuple(remarks))


def _loaded(part: Path, unit: str | None) -> tuple[Mesh, str]:
    """Return the mesh, repaired where it needs to be, and why. Raises MeshError where that does not help."""
    try:
        mesh, why = load_mesh(part, unit), ""
    except MeshError as error:
        mesh, why = None, error.what
    if mesh is not None and (mesh.diagnosis.inverted or not mesh.diagnosis.consistent):
        why = "facets are wound in opposite senses" if not mesh.diagnosis.inverted else "the surface is inside out"
    mesh = load_mesh(part, unit, repair=True) if mesh is None or why else mesh
    if mesh.diagnosis.shattered:
        raise MeshError(
            "the facets do not join, so there is no surface to machine",
            file=part,
            value=f"{mesh.diagnosis.bodies:,} bodies of {mesh.diagnosis.facets:,} facets",
            expected="facets that share their edges",
            remedy="merge close vertices in the program that wrote the mesh, or mend it there",
        )
    return mesh, why


def _without_debris(
    mesh: Mesh, table: dict[str, Any], reasons: dict[tuple[str, str], str]
) -> tuple[Mesh, tuple[str, ...]]:
    """Return an open surface without bodies as small as debris, and what to say; the key for it goes into [part]."""
    if mesh.diagnosis.watertight:
        return mesh, ()
    least = rounded(from_si(OPTIONS.cutter * max(mesh.diagnosis.extents), "mm"))
    small = mesh.small_bodies(float(to_si(least, "mm")))
    share = float(mesh.facet_areas[small].sum() / mesh.facet_areas.sum())
    if not 0.0 < share < OPTIONS.debris:
        return mesh, ()
    table["least_body_mm"] = least
    reasons["part", "least_body_mm"] = "smaller pieces are taken for the debris of a scan"
    clean = mesh.without_small_bodies(float(to_si(least, "mm")))
    return clean, (f"{clean.diagnosis.notes[-1]}, as the debris of a scan (least_body_mm)",)


def _unit(part: Path, work: WorkVolume) -> str:
    """Return the likely unit of a file's numbers."""
    # In metres the numbers are as they are in the file.
    largest = max(load_mesh(part, "m", repair=True).diagnosis.extents)
    low, high = to_si(OPTIONS.usual_mm, "mm")
    if low <= largest * UNITS["mm"] <= high:
        return "mm"
    return min(UNITS, key=lambda unit: abs(np.log(largest * UNITS[unit] / work.diameter)))


def _side(mesh: Mesh) -> tuple[str, bool]:
    """Return the side that shows most, the top unless another shows much more, and whether to turn the surface over."""
    shown = {
        name: float((mesh.facet_areas * np.maximum(mesh.facet_normals @ direction, 0.0)).sum())
        for name, direction in _SIDES.items()
    }
    open_, most = not mesh.diagnosis.watertight, max(shown.values())
    if open_ and shown["-z"] == most and shown["+z"] < OPTIONS.backs * most:
        return "+z", True
    if OPTIONS.sideways * shown["+z"] < most:  # what lies behind other surface was counted, too
        shown = {name: HeightField(mesh, direction).front_area() for name, direction in _SIDES.items()}
    most = max(shown.values())
    best = next(name for name in shown if shown[name] >= OPTIONS.alike * most)
    return ("+z" if OPTIONS.sideways * shown["+z"] >= most else best), False


def _box(mesh: Mesh, direction: Floats, work: WorkVolume) -> tuple[Floats | None, str]:
    """Return the box (2, 3) of a part that the work volume holds, and where it is; None where it holds the part.

    It is in the middle, unless it holds much less there than where it holds most of what faces the direction.
    """
    frame = np.stack([*tangent_frame(direction), direction])
    points = mesh.vertices @ frame.T
    low, high = points.min(axis=0), points.max(axis=0)
    share = min(work.diameter / float((high - low)[:2].max()), 1.0)
    height = min(work.height, high[2] - low[2])
    if share == 1.0 and height == high[2] - low[2]:
        return None, ""
    half, where = 0.5 * share * (high - low)[:2], "in its middle"
    # Facets may be larger than the box: points stand for what faces the direction.
    spread, normals = Patch.whole(mesh).spread(OPTIONS.points)
    facing, places = np.maximum(normals @ direction, 0.0), spread @ frame.T
    first, last = (low + 0.5 * share * (high - low))[:2], (high - 0.5 * share * (high - low))[:2]
    rows, columns = (np.unique(each) for each in np.linspace(first, last, OPTIONS.boxes).T)
    middles = [0.5 * (low + high)[:2], *(np.array([x, y]) for x in rows for y in columns)]
    held = [float(facing[(np.abs(places[:, :2] - middle) <= half).all(axis=1)].sum()) for middle in middles]
    middle = middles[0]
    if held[0] < OPTIONS.middle * max(held):
        middle, where = middles[int(np.argmax(held))], "where it holds most"
    # What lies above the middle; the highest of it is machined.
    both = np.concatenate([points, places])
    near = both[(np.abs(both[:, :2] - middle) <= half).all(axis=1)]
    top = near[:, 2].max() if len(near) else high[2]
    margin = OPTIONS.margin * work.height
    corners = np.array([[*(middle - half), top - height - margin], [*(middle + half), top + margin]]) @ frame
    return np.sort(corners, axis=0), where


def _toolpath(patch: Patch, direction: Floats) -> dict[str, Any]:
    """Return the strategy for a region: waterlines where it is steep all over, else a raster along its longer side."""
    upright, whole = patch.facet_normals @ direction, float(patch.areas.sum())
    steep = float(patch.areas[upright < np.cos(to_si(OPTIONS.steep_deg, "deg"))].sum())
    flat = float(patch.areas[upright > np.cos(WaterlineOptions.shallowest)].sum())
    if steep > OPTIONS.steep * whole and flat < OPTIONS.flat * whole:
        return {"strategy": "waterline"}
    width, height = np.ptp(patch.vertices[distinct(patch.faces)] @ np.stack(tangent_frame(direction)).T, axis=0)
    return {"strategy": "raster", "direction_deg": 0.0 if width >= height else 90.0}


def _walls(patch: Patch, direction: Floats) -> float:
    """Return the share of a region's area that is upright, about."""
    return patch.share_steeper(direction, to_si(OPTIONS.walls_deg, "deg"))


def _placement(mesh: Mesh, patch: Patch, direction: Floats, work: WorkVolume) -> dict[str, Any]:
    """Return the placement on a table at the height that brings the region to the middle of the work volume."""
    heights = patch.vertices[distinct(patch.faces)] @ direction
    above = 0.5 * float(heights.min() + heights.max()) - float((mesh.vertices @ direction).min())
    towards_base = -1.0 if work.centre[2] > 0.0 else 1.0
    table = {"mode": "table", "table_z_mm": rounded(from_si(work.centre[2] - towards_base * above, "mm"))}
    return table | ({} if direction[2] == 1.0 else {"up": [float(v) + 0.0 for v in direction]})
