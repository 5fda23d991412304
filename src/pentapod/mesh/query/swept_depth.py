"""Penetration depth of a mesh in a moving tool, or the gap between them, continuous in time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, as_floats, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.progress import Progress, silent
from pentapod.geometry.directions import angle_between, tangent_frame
from pentapod.geometry.solids import KINDS, Solid
from pentapod.mesh.query.tree import FacetTree
from pentapod.numerics.threads import for_rows

RESOLUTION_M = 5e-7
"""Depths are exact to this and one per cent."""

STILL = 1e-9
"""Radians; an axis that turns by less counts as one that does not: a nanometre at the end of a tool of a metre."""

CHUNK = 5_000
"""Motions between two reports of progress."""

AT_ONCE = 64
"""Motions checked at a time by `is_clear`: many waste work behind the first that is not clear."""


class Body(Protocol):
    """A tool, or part of one."""

    @property
    def tilt_centre(self) -> float:
        """Metres from the tip along the axis to the point that moves linearly, about which the body turns."""
        ...

    @property
    def solids(self) -> tuple[Solid, ...]:
        """The convex bodies that make it up."""
        ...


@dataclass(frozen=True)
class TouchingBody:
    """Solids that do not move, so that their tilt centre does not matter."""

    solids: tuple[Solid, ...]
    tilt_centre: float = 0.0


@dataclass(frozen=True, eq=False)
class Sweep:
    """Depths of a mesh in a tool on M motions, one column for each of `KINDS`: cutter, shank, holder.

    depths (M, 3): metres by which the deepest mesh point lies inside that part of the tool; negative is a gap, −inf
    where nothing is beyond the threshold. times (M, 3): when, as a fraction of the motion. points (M, 3, 3): the mesh
    point, metres. facets (M, 3): of the mesh, −1 for none.
    """

    depths: Floats
    times: Floats
    points: Floats
    facets: Ints

    def __post_init__(self) -> None:
        for name in ("depths", "times", "points", "facets"):
            array = np.asarray(getattr(self, name))
            array.flags.writeable = False
            set_frozen(self, **{name: array})

    @property
    def deepest(self) -> Floats:
        """Largest depth (M,) of any part of the tool on each motion."""
        return self.depths.max(axis=1)


def sweep(
    tree: FacetTree,
    tool: Body,
    tips: Floats,
    axes: Floats,
    *,
    threshold: float = 0.0,
    every: int = 1,
    progress: Progress = silent,
) -> Sweep:
    """Return the depths of a mesh in a tool on the N − 1 motions between N poses: tips and unit axes (N, 3).

    On a motion the tilt centre moves linearly and the axis turns evenly about it. Found are depths above `threshold`,
    metres; a negative one asks for gaps too. Every point of every facet and every time is covered; depths are exact to
    `RESOLUTION_M` and 1 %. every: 2 takes the poses as pairs, a motion each, and skips the motions between pairs.
    Raises ToolpathError for fewer than two poses.
    """
    tips, axes = as_floats(tips, "tips", (None, 3)), as_floats(axes, "axes", (None, 3))
    if len(tips) < 2:
        raise ToolpathError("a motion needs two poses", value=len(tips))
    start, end = (tips[:-1:every], axes[:-1:every]), (tips[1::every], axes[1::every])
    return _swept(tree, tool, start, end, threshold, RESOLUTION_M, progress)


def meets(tree: FacetTree, tool: Body, tips: Floats, axes: Floats, *, threshold: float = 0.0, every: int = 1) -> Bools:
    """Return on which motions (M,) any part of the tool is deeper than `threshold`. As `sweep`, without the depths.

    Quicker than depths: the search on a motion ends at the first point that is deep enough.
    """
    start, end = (tips[:-1:every], axes[:-1:every]), (tips[1::every], axes[1::every])
    return _met(tree, tool.solids, _motions(start, end, tool.tilt_centre), tool.tilt_centre, threshold)


def is_clear(tree: FacetTree, tool: Body, tips: Floats, axes: Floats, *, threshold: float = 0.0) -> bool:
    """Return whether no part of the tool is deeper than `threshold` on the motions between poses. As `meets`.

    It ends at the first motion that is not clear.
    """
    motions = _motions((tips[:-1], axes[:-1]), (tips[1:], axes[1:]), tool.tilt_centre)
    parts = (motions[k : k + AT_ONCE] for k in range(0, len(motions), AT_ONCE))
    return not any(_met(tree, tool.solids, part, tool.tilt_centre, threshold).any() for part in parts)


def _met(tree: FacetTree, solids: tuple[Solid, ...], motions: Floats, tilt_centre: float, threshold: float) -> Bools:
    """Return on which motions (M, 18) one of the solids is deeper than `threshold`."""
    from pentapod.mesh.query.kernels.segment_kernels import nearest_all  # noqa: PLC0415 - loads numba
    from pentapod.mesh.query.kernels.sweep_kernels import sweep_all  # noqa: PLC0415

    met = np.zeros(len(motions), dtype=np.bool_)
    hierarchy = (tree.corners, tree.boxes, tree.starts)
    for solid in solids:
        rows = np.flatnonzero(~met)
        found = (np.empty(len(rows)), np.empty((len(rows), 4)), np.empty(len(rows), dtype=np.intp))
        if solid.is_ball and solid.low == tilt_centre:
            centres, travels = (np.ascontiguousarray(motions[rows, at : at + 3]) for at in (0, 6))
            for_rows(nearest_all, (centres, travels), (*hierarchy, solid.rounding - threshold, False), found)
        else:
            given = (*hierarchy, threshold, RESOLUTION_M, -np.inf)
            for_rows(partial(sweep_all, np.array(solid.numbers)), (motions[rows],), given, found)
        met[rows] = found[2] >= 0
    return met


def touch(
    tree: FacetTree,
    tool: Body,
    tips: Floats,
    axes: Floats,
    *,
    threshold: float = 0.0,
    resolution: float = RESOLUTION_M,
    progress: Progress = silent,
) -> Sweep:
    """Return the depths of a mesh in a tool at N poses: tips and unit axes (N, 3). As `sweep`, without motion.

    resolution: metres to which depths are exact; a coarser one is faster.
    """
    tips, axes = as_floats(tips, "tips", (None, 3)), as_floats(axes, "axes", (None, 3))
    return _swept(tree, tool, (tips, axes), (tips, axes), threshold, resolution, progress)


def _swept(
    tree: FacetTree,
    tool: Body,
    start: tuple[Floats, Floats],
    end: tuple[Floats, Floats],
    threshold: float,
    resolution: float,
    progress: Progress,
) -> Sweep:
    from pentapod.mesh.query.kernels.facet_kernels import RELATIVE_ERROR  # noqa: PLC0415
    from pentapod.mesh.query.kernels.segment_kernels import nearest_all  # noqa: PLC0415 - loads numba
    from pentapod.mesh.query.kernels.sweep_kernels import sweep_all  # noqa: PLC0415

    solids = tool.solids
    motions = _motions(start, end, tool.tilt_centre)
    count, parts = len(motions), len(solids)
    depths, where = np.full((parts, count), -np.inf), np.full((parts, count, 4), np.nan)
    facets = np.full((parts, count), -1, dtype=np.intp)
    hierarchy = (tree.corners, tree.boxes, tree.starts)
    for k, solid in enumerate(solids):
        ball = solid.is_ball and solid.low == tool.tilt_centre
        numbers = np.array(solid.numbers)
        # Nothing is deeper in a solid than it is thick: there the search ends, within the share of a depth that counts.
        enough = (1.0 - RELATIVE_ERROR) * solid.thickness
        for first in range(0, count, CHUNK):
            rows = slice(first, first + CHUNK)
            progress("gouge check", (k + first / count) / parts)
            found = (depths[k, rows], where[k, rows], facets[k, rows])
            if ball:
                centres, travels = (np.ascontiguousarray(motions[rows, at : at + 3]) for at in (0, 6))
                for_rows(nearest_all, (centres, travels), (*hierarchy, solid.rounding - threshold, False), found)
                depths[k, rows] = np.where(facets[k, rows] < 0, -np.inf, solid.rounding - depths[k, rows])
            else:
                given = (*hierarchy, threshold, resolution, enough)
                for_rows(partial(sweep_all, numbers), (motions[rows],), given, found)
    kinds = np.array([KINDS.index(solid.kind) for solid in solids], dtype=np.intp)
    return _by_kind(depths, where, np.where(facets < 0, -1, tree.facets[facets]), kinds)


def _motions(start_pose: tuple[Floats, Floats], end_pose: tuple[Floats, Floats], tilt_centre: float) -> Floats:
    """Return the motions (M, 18) in the layout of `sweep_kernels.deepest`."""
    (tips0, axes0), (tips1, axes1) = start_pose, end_pose
    start, end = tips0 + tilt_centre * axes0, tips1 + tilt_centre * axes1
    travel = end - start
    angle = angle_between(axes0, axes1)
    # The axis a quarter turn later; between opposite axes any direction will do.
    ahead = axes1 - (axes0 * axes1).sum(axis=1, keepdims=True) * axes0
    length = np.linalg.norm(ahead, axis=1, keepdims=True)
    ahead = np.where(length > STILL, ahead / np.where(length > STILL, length, 1.0), tangent_frame(axes0)[0])
    angle = np.where((length[:, 0] > STILL) | (angle > 1.0), angle, 0.0)
    spin = angle[:, None] * np.cross(axes0, ahead)
    size = np.linalg.norm(travel, axis=1)
    tall = np.full((len(start), 1), tilt_centre)
    return np.ascontiguousarray(np.hstack([start, axes0, travel, ahead, spin, size[:, None], angle[:, None], tall]))


def _by_kind(depths: Floats, where: Floats, facets: Ints, kinds: Ints) -> Sweep:
    """Return for each motion and kind of part the solid with the largest depth."""
    count = depths.shape[1]
    rows = np.arange(count)
    out = (np.full((count, 3), -np.inf), np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan))
    found = np.full((count, 3), -1, dtype=np.intp)
    for kind in range(len(KINDS)):
        own = np.flatnonzero(kinds == kind)
        if len(own) and count:
            worst = own[depths[own].argmax(axis=0)]
            out[0][:, kind], out[1][:, kind] = depths[worst, rows], where[worst, rows, 0]
            out[2][:, kind], found[:, kind] = where[worst, rows, 1:], facets[worst, rows]
    return Sweep(*out, found)
