"""Stay-down links: across the surface from the end of one pass to the start of the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.directions import angle_between, normalised
from pentapod.mesh.query.heightfield import HeightField
from pentapod.toolpath.options import PathOptions


@dataclass(frozen=True)
class StayDownLimits:
    """Where a link leaves the surface. turn: of the normals along it, in all. rise: metres up per metre along.

    beyond: how much steeper than the region it may be. Angles in radians.
    """

    turn: float = float(np.radians(30.0))
    rise: float = float(np.tan(np.radians(80.0)))
    beyond: float = float(np.radians(10.0))


LinkEnds = tuple[Floats, Floats, Floats, Floats]
"""Contacts and normals of the pass that is left, then of the pass that is entered."""


def surface_links(
    field: HeightField,
    options: PathOptions,
    stepover: float,
    ends: list[LinkEnds],
    limits: StayDownLimits | None = None,
) -> list[tuple[Floats, Floats] | None]:
    """Return for each pair of passes contacts and normals (n, 3) of a link on the surface, or None.

    None: the tool must retract. The link runs straight as seen along the view, on the topmost surface. It
    may bridge the outside of a border that curves inwards, where nothing lies below; it may neither jump in
    height (a wall, a step), nor turn by more than the limits allow, nor leave the region by more than a stepover
    or `beyond`.
    """
    if not ends:
        return []
    starts, stops = np.stack([e[0][-1] for e in ends]), np.stack([e[2][0] for e in ends])
    length = np.linalg.norm(stops - starts, axis=1)
    counts = np.maximum(np.ceil(length / min(options.spacing, stepover / 3.0)), 3.0).astype(np.intp)
    link = np.repeat(np.arange(len(ends)), counts - 1)
    number = np.arange(len(link)) - np.repeat(np.cumsum(counts - 1) - (counts - 1), counts - 1) + 1
    t = number / counts[link]
    points = starts[link] + t[:, None] * (stops - starts)[link]
    surface, normals, _ = field.topmost(points)
    answers: list[tuple[Floats, Floats] | None] = []
    for k, (_, before, _, after) in enumerate(ends):
        rows = link == k
        answers.append(
            _checked(
                field,
                options,
                stepover,
                limits or StayDownLimits(),
                t=np.concatenate([[0.0], t[rows], [1.0]]),
                contacts=np.vstack([starts[k], surface[rows], stops[k]]),
                normals=np.vstack([before[-1], normals[rows], after[0]]),
            )
        )
    return answers


def _checked(
    field: HeightField,
    options: PathOptions,
    stepover: float,
    limits: StayDownLimits,
    *,
    t: Floats,
    contacts: Floats,
    normals: Floats,
) -> tuple[Floats, Floats] | None:
    """Return the link where it holds what `surface_links` promises."""
    found = np.isfinite(contacts).all(axis=1)
    contacts, normals = (
        np.stack([np.interp(t, t[found], v[found, k]) for k in range(3)], axis=1) for v in (contacts, normals)
    )
    normals = normalised(normals)
    steps = np.diff(contacts, axis=0)
    rise = np.abs(steps @ field.view)
    flat = np.linalg.norm(steps - (steps @ field.view)[:, None] * field.view, axis=1)
    region = options.region
    low, high = region.bounds
    leaves_box = ((contacts < low - stepover) | (contacts > high + stepover)).any()
    facing = angle_between(normals, region.direction)
    if (
        (flat < 0.1 * options.closest).any()
        or (rise > limits.rise * flat).any()
        or angle_between(normals[1:], normals[:-1]).sum() > limits.turn
        or leaves_box
        or (facing > min(region.angle + limits.beyond, np.pi / 2)).any()
    ):
        return None
    return contacts, normals
