"""Projection of flat lines onto a surface: along a direction, or wrapped along geodesics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import normalised
from pentapod.geometry.polyline import spaced
from pentapod.geometry.runs import marked_runs
from pentapod.mesh.passes import Passes
from pentapod.mesh.query.heightfield import HeightField
from pentapod.toolpath.options import PathOptions

SurfaceHits = tuple[Floats, Floats, Bools]
"""Points on the surface (N, 3), normals (N, 3), and which (N,) are hits; the others mean nothing."""
SurfaceMap = Callable[[Floats], SurfaceHits]
"""From points of the drawing (N, 2) or (N, 3) to the surface."""


@dataclass(frozen=True)
class ProjectionOptions:
    """How lines are refined on the surface, and where they are broken.

    first: spacing of the first points, as a share of the largest. fine: distance of chords from the surface's line, as
    a share of the chordal tolerance. places: where a chord is tested, one after the other: a symmetric bend would hide
    in the middle, two bends from one place. rounds: largest number of halvings. stretch: largest stretch of wrapped
    lines. bridge: gap that is bridged at corners of the mesh, as a share of the spacing. steepest: largest stretch of
    projected lines.
    """

    first: float = 0.25
    fine: float = 0.02
    places: tuple[float, ...] = (0.47, 0.21, 0.78)
    rounds: int = 16
    stretch: float = 4.0
    bridge: float = 0.1
    steepest: float = 60.0


def projected(
    lines: list[Floats],
    surface: SurfaceMap,
    options: PathOptions,
    *,
    spacing: float,
    wrapped: bool,
    depth: float = 0.0,
    depth_slope: float = 0.0,
    refinement: ProjectionOptions = ProjectionOptions(),
) -> tuple[Passes, tuple[str, ...]]:
    """Return lines (n, 2) or (n, 3) mapped onto a surface, and a note of the share that does not hit it.

    Points are inserted until every chord is within a fiftieth of the chordal tolerance of the surface's own line, as
    far as tested, and none are further apart than `spacing` metres. A line is broken where it leaves the surface, and
    where neighbours are mapped so far apart that the surface between them must be torn. wrapped: lines separate a
    little at a mesh's corners, which is bridged; projected lines separate only at steps, but are stretched on slopes.
    depth: of the lines below the surface in metres, by which neighbours separate at a crease. depth_slope: its largest
    change per metre.
    """
    fine = [spaced(line, refinement.first * spacing) for line in lines]
    owner = np.repeat(np.arange(len(fine)), [len(line) for line in fine])
    plane, owner, points, normals, hit = _refined(np.concatenate(fine), owner, surface, options.chordal, refinement)
    steps = np.where(owner[1:] == owner[:-1], np.linalg.norm(np.diff(plane, axis=0), axis=1), 0.0)
    gaps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    crease = depth * np.linalg.norm(np.diff(normalised(normals), axis=0), axis=1)
    steepest = min(1.1 / max(np.cos(options.region.within), 1e-9), refinement.steepest)
    stretch, bridge = (refinement.stretch, refinement.bridge * spacing) if wrapped else (steepest, options.chordal)
    near = gaps <= (stretch + depth_slope) * steps + bridge + crease
    kept = (owner[1:] == owner[:-1]) & hit[1:] & hit[:-1] & near
    runs = marked_runs(kept)
    passes = Passes.of([(points[a : b + 1], normals[a : b + 1]) for a, b in runs], owner[runs[:, 0]])
    length = float(steps.sum())
    lost = 1.0 - float(steps[kept].sum()) / length if length > 0.0 else 1.0
    return passes, (
        f"{100.0 * lost:.2g} % of the lines lie outside the region and are left out",
    ) if lost > 1e-6 else ()


def topmost_in_region(field: HeightField, points: Floats, options: PathOptions, slack: float = 0.0) -> SurfaceHits:
    """Return the topmost surface points along the view over points (N, 3), normals, and which are in the region.

    slack: distance from the region's box, metres, up to which a point still counts as inside.
    """
    found, normals, _ = field.topmost(points)
    hit = np.asarray(np.isfinite(found).all(axis=1))
    found, normals = np.where(hit[:, None], found, 0.0), np.where(hit[:, None], normals, options.up)
    low, high = options.region.bounds
    hit &= options.region.faces(normals) >= 0.0
    hit &= ((found >= low - slack) & (found <= high + slack)).all(axis=1)
    return found, normals, hit


def below(surface: SurfaceMap, depth: Callable[[Floats], Floats]) -> SurfaceMap:
    """Return a map to points below a surface, along the normal. depth: points of the drawing → depths (N,), metres."""

    def mapped(plane: Floats) -> SurfaceHits:
        points, normals, hit = surface(plane)
        return points - depth(plane)[:, None] * normalised(normals), normals, hit

    return mapped


def _refined(
    plane: Floats, owner: Ints, surface: SurfaceMap, chordal: float, refinement: ProjectionOptions
) -> tuple[Floats, Ints, Floats, Floats, Bools]:
    """Return points of lines with further ones inserted, the line (N,) of each, and where they hit the surface."""
    points, normals, hit = surface(plane)
    passed = np.where(owner[1:] == owner[:-1], 0, len(refinement.places))
    for _ in range(refinement.rounds):
        rows = np.flatnonzero(passed < len(refinement.places))
        if not len(rows):
            break
        share = np.array(refinement.places)[passed[rows], None]
        between = (1.0 - share) * plane[rows] + share * plane[rows + 1]
        new_points, new_normals, new_hit = surface(between)
        chord = (1.0 - share) * points[rows] + share * points[rows + 1]
        all_hit = new_hit & hit[rows] & hit[rows + 1]
        deviation = np.where(all_hit, np.linalg.norm(new_points - chord, axis=1), 0.0)
        rim = (hit[rows] != new_hit) | (hit[rows + 1] != new_hit)
        length = np.linalg.norm(plane[rows + 1] - plane[rows], axis=1)
        split = (deviation > refinement.fine * chordal) | (rim & (length > chordal))
        at = rows[split] + 1
        plane, points, normals = (
            np.insert(old, at, new[split], axis=0)
            for old, new in ((plane, between), (points, new_points), (normals, new_normals))
        )
        hit, owner = np.insert(hit, at, new_hit[split]), np.insert(owner, at, owner[at])
        # Both halves of a split chord are tested from the start.
        passed[rows] = np.where(split, 0, passed[rows] + 1)
        passed = np.insert(passed, at, 0)
    return plane, owner, points, normals, hit
