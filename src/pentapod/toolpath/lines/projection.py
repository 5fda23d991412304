"""Projection of flat lines onto a surface, along a direction or wrapped along geodesics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import normalised
from pentapod.geometry.polyline import spaced
from pentapod.geometry.runs import marked_runs
from pentapod.mesh.passes import Passes
from pentapod.toolpath.options import PathOptions

Landing = Callable[[Floats], tuple[Floats, Floats, Bools]]
"""Points of the plane (N, 2) → points on the surface (N, 3), normals (N, 3), and whether (N,) they landed."""


@dataclass(frozen=True)
class ProjectionOptions:
    """How lines are refined on the surface, and where they are broken.

    first: spacing of the first points, as a share of the largest. fine: distance of chords from the surface's line, as
    a share of the chordal tolerance. places: where a chord is tested, one after the other: a symmetric bend would hide
    in the middle, two bends from one place. rounds: of halving, at most. stretch: of wrapped lines, at most, beside
    `bridge` of the spacing that is bridged at corners of the mesh. steepest: stretch of projected lines, at most.
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
    landing: Landing,
    options: PathOptions,
    *,
    spacing: float,
    wrapped: bool,
    sink: float = 0.0,
    slope: float = 0.0,
    how: ProjectionOptions | None = None,
) -> tuple[Passes, tuple[str, ...]]:
    """Return flat lines (n, 2) on a surface, and a note of what did not land.

    Points are added between those that were given until every chord is within a fiftieth of the chordal tolerance of
    the surface's own line, wherever it is tested, and none are further apart than `spacing` metres. A line is broken
    where it leaves the surface, and where neighbours land so far apart that the surface between them must be torn.
    Wrapped lines part a little at a mesh's corners, which is bridged; projected ones part at steps alone, but are
    stretched on slopes. sink: depth of the landing in metres, by which neighbours part at a crease; slope: by how much
    it changes per metre.
    """
    how = how or ProjectionOptions()
    fine = [spaced(line, how.first * spacing) for line in lines]
    owner = np.repeat(np.arange(len(fine)), [len(line) for line in fine])
    plane, owner, points, normals, landed = _refined(np.concatenate(fine), owner, landing, options.chordal, how)
    steps = np.where(owner[1:] == owner[:-1], np.linalg.norm(np.diff(plane, axis=0), axis=1), 0.0)
    gaps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    swing = sink * np.linalg.norm(np.diff(normalised(normals), axis=0), axis=1)
    steepest = min(1.1 / max(np.cos(options.region.angle), 1e-9), how.steepest)
    stretch, bridge = (how.stretch, how.bridge * spacing) if wrapped else (steepest, options.chordal)
    near = gaps <= (stretch + slope) * steps + bridge + swing
    whole = (owner[1:] == owner[:-1]) & landed[1:] & landed[:-1] & near
    runs = marked_runs(whole)
    # A run's end is the point that its last step leads to.
    passes = Passes.of([(points[a : b + 1], normals[a : b + 1]) for a, b in runs], owner[runs[:, 0]])
    length = float(steps.sum())
    lost = 1.0 - float(steps[whole].sum()) / length if length > 0.0 else 1.0
    return passes, (f"{100.0 * lost:.2g} % of the lines lie beside the region and are left out",) if lost > 1e-6 else ()


def sunk(landing: Landing, depth: Callable[[Floats], Floats]) -> Landing:
    """Return a landing below another, along the normal, by a depth (N,) in metres of points of the plane (N, 2)."""

    def land(plane: Floats) -> tuple[Floats, Floats, Bools]:
        points, normals, landed = landing(plane)
        return points - depth(plane)[:, None] * normalised(normals), normals, landed

    return land


def _refined(
    plane: Floats, owner: Ints, landing: Landing, chordal: float, how: ProjectionOptions
) -> tuple[Floats, Ints, Floats, Floats, Bools]:
    """Return points of lines, the line (N,) of each, with more between, where they land, normals, and whether."""
    points, normals, landed = landing(plane)
    passed = np.where(owner[1:] == owner[:-1], 0, len(how.places))
    for _ in range(how.rounds):
        rows = np.flatnonzero(passed < len(how.places))
        if not len(rows):
            break
        share = np.array(how.places)[passed[rows], None]
        between = (1.0 - share) * plane[rows] + share * plane[rows + 1]
        new_points, new_normals, new_landed = landing(between)
        chord = (1.0 - share) * points[rows] + share * points[rows + 1]
        all_landed = new_landed & landed[rows] & landed[rows + 1]
        off = np.where(all_landed, np.linalg.norm(new_points - chord, axis=1), 0.0)
        rim = (landed[rows] != new_landed) | (landed[rows + 1] != new_landed)
        length = np.linalg.norm(plane[rows + 1] - plane[rows], axis=1)
        split = (off > how.fine * chordal) | (rim & (length > chordal))
        at = rows[split] + 1
        plane, points, normals = (
            np.insert(old, at, new[split], axis=0)
            for old, new in ((plane, between), (points, new_points), (normals, new_normals))
        )
        landed, owner = np.insert(landed, at, new_landed[split]), np.insert(owner, at, owner[at])
        # Both halves of what was split are tested from the start.
        passed[rows] = np.where(split, 0, passed[rows] + 1)
        passed = np.insert(passed, at, 0)
    return plane, owner, points, normals, landed
