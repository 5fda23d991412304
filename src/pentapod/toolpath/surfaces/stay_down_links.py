"""Stay-down links: across the surface from the end of one pass to the beginning of the next."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.directions import angle_between, normalised
from pentapod.mesh.passes import Passes
from pentapod.mesh.query.heightfield import HeightField
from pentapod.toolpath.lines.resampling import resample
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.surface import Contacts


@dataclass(frozen=True)
class StayDownLimits:
    """Limits beyond which a link does not stay on the surface.

    turn: of the normals along it in total, radians. rise: metres up per metre along. steeper: how much steeper than the
    region it may be, radians.
    """

    turn: float = float(np.radians(30.0))
    rise: float = float(np.tan(np.radians(80.0)))
    steeper: float = float(np.radians(10.0))


def stay_down_links(
    field: HeightField,
    options: PathOptions,
    stepover: float,
    ends: dict[int, tuple[Contacts, Contacts]],
    limits: StayDownLimits = StayDownLimits(),
) -> dict[int, Contacts]:
    """Return contacts and unit normals of the links on the surface between pairs of passes, where there is one.

    A link runs straight as seen along the view, on the topmost surface. It may bridge the outside of a concave border,
    where nothing lies below. It may not jump in height (a wall, a step), turn by more than the limits allow, or leave
    the region by more than a stepover or `steeper`.
    """
    if not ends:
        return {}
    starts = np.stack([contacts[-1] for (contacts, _), _ in ends.values()])
    stops = np.stack([contacts[0] for _, (contacts, _) in ends.values()])
    length = np.linalg.norm(stops - starts, axis=1)
    counts = np.maximum(np.ceil(length / min(options.spacing, stepover / 3.0)), 3.0).astype(np.intp)
    link = np.repeat(np.arange(len(ends)), counts - 1)
    number = np.arange(len(link)) - np.repeat(np.cumsum(counts - 1) - (counts - 1), counts - 1) + 1
    t = number / counts[link]
    points = starts[link] + t[:, None] * (stops - starts)[link]
    surface, normals, _ = field.topmost(points)
    found: dict[int, Contacts] = {}
    for k, (key, ((_, before), (_, after))) in enumerate(ends.items()):
        rows = link == k
        contacts = np.vstack([starts[k], surface[rows], stops[k]])
        along = np.vstack([before[-1], normals[rows], after[0]])
        candidate = _bridged(np.concatenate([[0.0], t[rows], [1.0]]), contacts, along)
        if _allowed(*candidate, field.view, options, stepover, limits):
            found[key] = candidate
    return _resampled(found, ends, options)


def _bridged(t: Floats, contacts: Floats, normals: Floats) -> Contacts:
    """Return contacts and unit normals (n, 3) with those interpolated for which the surface has no point (NaN)."""
    found = np.isfinite(contacts).all(axis=1)
    contacts, normals = (
        np.stack([np.interp(t, t[found], v[found, k]) for k in range(3)], axis=1) for v in (contacts, normals)
    )
    return contacts, normalised(normals)


def _allowed(
    contacts: Floats, normals: Floats, view: Floats, options: PathOptions, stepover: float, limits: StayDownLimits
) -> bool:
    """Return whether a link keeps the limits."""
    steps = np.diff(contacts, axis=0)
    rise = np.abs(steps @ view)
    flat = np.linalg.norm(steps - (steps @ view)[:, None] * view, axis=1)
    region = options.region
    low, high = region.bounds
    leaves_box = ((contacts < low - stepover) | (contacts > high + stepover)).any()
    slope = angle_between(normals, region.direction)
    return not (
        (flat < 0.1 * options.closest).any()
        or (rise > limits.rise * flat).any()
        or angle_between(normals[1:], normals[:-1]).sum() > limits.turn
        or leaves_box
        or (slope > min(region.within + limits.steeper, np.pi / 2)).any()
    )


def _resampled(
    links: dict[int, Contacts], ends: dict[int, tuple[Contacts, Contacts]], options: PathOptions
) -> dict[int, Contacts]:
    """Return links with waypoints as the tolerances ask, that begin and end exactly where the passes do."""
    if not links:
        return {}
    lengths = [float(np.linalg.norm(contacts[-1] - contacts[0])) for contacts, _ in links.values()]
    fine = resample(
        Passes.of(list(links.values()), np.array(list(links))),
        chordal=options.chordal,
        spacing=options.spacing,
        axis_step=options.axis_step,
        closest=min(options.closest, 0.25 * min(lengths)),
    )
    result: dict[int, Contacts] = {}
    for key, (a, b) in zip(fine.levels.tolist(), pairwise(fine.starts.tolist()), strict=True):
        before, after = ends[key]
        contacts, normals = fine.points[a:b].copy(), fine.normals[a:b]
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        contacts[0], contacts[-1] = before[0][-1], after[0][0]
        normals[0], normals[-1] = before[1][-1], after[1][0]
        result[key] = contacts, normals
    return result
