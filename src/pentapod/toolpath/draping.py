"""Draping: flat lines laid on a surface, projected along a direction or wrapped along geodesics."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pentapod.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import normalised
from pentapod.toolpath.links import spaced
from pentapod.toolpath.passes import Passes

Landing = Callable[[Floats], tuple[Floats, Floats, Bools]]
"""Points of the plane (N, 2) → points on the surface (N, 3), normals (N, 3), and whether (N,) they landed."""

_MOST_ROUNDS = 14
_TORN = 4.0
_ROUGH = 0.1
_FINE = 0.02
_FIRST = 0.25
_NOT_QUITE_HALF = 0.47
"""Where chords are tested: a symmetric bend would hide in the middle."""


def draped(lines: list[Floats], landing: Landing, *, spacing: float, chordal: float) -> tuple[Passes, float]:
    """Return flat lines (n, 2) on a surface, and which share of their length did not land.

    Points are added between those that were given until the middle of every chord is within a fiftieth of `chordal`
    metres of the surface's own line, and none are further apart than `spacing`. A line is broken where it leaves the
    surface, and where neighbours land so far apart that the surface between them must be torn; what is torn by less
    than a tenth of the spacing (straightest lines part at a mesh's corners) is bridged.
    """
    # Two bends within one chord could hide from a test of one place.
    fine = [spaced(line, _FIRST * spacing) for line in lines]
    owner = np.repeat(np.arange(len(fine)), [len(line) for line in fine])
    plane, owner, points, normals, landed = _refined(np.concatenate(fine), owner, landing, chordal)
    steps = np.where(owner[1:] == owner[:-1], np.linalg.norm(np.diff(plane, axis=0), axis=1), 0.0)
    gaps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    whole = (owner[1:] == owner[:-1]) & landed[1:] & landed[:-1] & (gaps <= _TORN * steps + _ROUGH * spacing)
    runs = _runs(whole)
    passes = Passes.of([(points[a : b + 1], normals[a : b + 1]) for a, b in runs], owner[[a for a, _ in runs]])
    length = float(steps.sum())
    return passes, 1.0 - float(steps[whole].sum()) / length if length > 0.0 else 1.0


def sunk(landing: Landing, depth: Callable[[Floats], Floats]) -> Landing:
    """Return a landing below another, along the normal, by a depth (N,) in metres of points of the plane (N, 2)."""

    def land(plane: Floats) -> tuple[Floats, Floats, Bools]:
        points, normals, landed = landing(plane)
        return points - depth(plane)[:, None] * normalised(normals), normals, landed

    return land


def _refined(
    plane: Floats, owner: Ints, landing: Landing, chordal: float
) -> tuple[Floats, Ints, Floats, Floats, Bools]:
    """Return points of lines, the line (N,) of each, with more between, where they land, normals, and whether."""
    points, normals, landed = landing(plane)
    unsure = owner[1:] == owner[:-1]
    for _ in range(_MOST_ROUNDS):
        rows = np.flatnonzero(unsure)
        if not len(rows):
            break
        between = (1.0 - _NOT_QUITE_HALF) * plane[rows] + _NOT_QUITE_HALF * plane[rows + 1]
        new_points, new_normals, new_landed = landing(between)
        chord = (1.0 - _NOT_QUITE_HALF) * points[rows] + _NOT_QUITE_HALF * points[rows + 1]
        all_landed = new_landed & landed[rows] & landed[rows + 1]
        off = np.where(all_landed, np.linalg.norm(new_points - chord, axis=1), 0.0)
        rim = (landed[rows] != new_landed) | (landed[rows + 1] != new_landed)
        length = np.linalg.norm(plane[rows + 1] - plane[rows], axis=1)
        split = (off > _FINE * chordal) | (rim & (length > chordal))
        at = rows[split] + 1
        plane, points, normals = (
            np.insert(old, at, new[split], axis=0)
            for old, new in ((plane, between), (points, new_points), (normals, new_normals))
        )
        landed, owner = np.insert(landed, at, new_landed[split]), np.insert(owner, at, owner[at])
        # Both halves of what was split are looked at again.
        unsure = np.zeros(len(plane) - 1, dtype=np.bool_)
        place = at + np.arange(len(at))
        unsure[place - 1] = unsure[place] = True
    return plane, owner, points, normals, landed


def _runs(whole: Bools) -> list[tuple[int, int]]:
    """Return first and last point of each run of steps marked in `whole`."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
