"""Edges: the borders of the region, and the sharp edges within it, for deburring and trimming."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import angle_between
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.toolpath.drawing import Drawing, Order
from pentapod.toolpath.nothing_left import nothing_left
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.strategies.strategy import Strategy

_CORNER = np.radians(40.0)
_INSIDE = 1e-7
"""Share of the part's size within which a point lies on an edge."""

_MOST_PLACES = 1000


class Which(StrEnum):
    """border: where the surface ends. sharp: where facets meet at an angle, on the outside. both: all of them."""

    BORDER = "border"
    SHARP = "sharp"
    BOTH = "both"


@dataclass(frozen=True, kw_only=True, eq=False)
class EdgeOptions(PathOptions):
    """Borders and sharp edges, for deburring."""

    which: Annotated[Which | str, Key("", "which edges are followed")] = Which.BOTH
    sharpest: Annotated[float, Key("deg", "angle of normals that makes an edge", gt=0.0, lt=180.0)] = float(
        np.radians(40.0)
    )


def draw_edges(mesh: Mesh, tool: Tool, options: EdgeOptions) -> Drawing:
    """Return the edges of the region: of the mesh's own border and of its creases that stand out.

    The tool stands on an edge along the mean of the normals on its sides. A line ends where an edge turns by more
    than 40° or meets others. Raises ToolpathError where there is no edge.
    """
    del tool
    patch = Patch.of(mesh, options.region)
    if not len(patch.faces):
        raise nothing_left(mesh, options, 0)
    topology, whole = patch.topology, Patch.whole(mesh)
    wanted = np.zeros(len(whole.topology.edges), dtype=np.bool_)
    chosen_edges = np.zeros(len(topology.edges), dtype=np.bool_)
    if options.which is not Which.SHARP:
        wanted |= whole.topology.facets_at_edge == 1
    if options.which is not Which.BORDER:
        wanted |= _sharp(whole, options.sharpest)
        chosen_edges |= _sharp(patch, options.sharpest)
    # Where the region ends, an edge counts if it is one of the whole mesh: the other side may face away.
    rim = np.flatnonzero(topology.facets_at_edge == 1)
    lies_on = _lying_on(patch.vertices[topology.edges[rim]].mean(axis=1), mesh, np.flatnonzero(wanted))
    chosen_edges[rim[lies_on >= 0]] = True
    if not chosen_edges.any():
        raise ToolpathError(
            "the region has no such edge",
            key="which",
            value=str(options.which),
            remedy="lower the angle from which edges count",
        )
    normals = _edge_normals(patch)
    normals[rim[lies_on >= 0]] = _edge_normals(whole)[lies_on[lies_on >= 0]]
    lines = [_line(patch, normals, walk) for walk in _walks(patch, topology.edges, chosen_edges)]
    return Drawing(Passes.of(lines), 0.0, Order.SHORTEST)


def _lying_on(points: Floats, mesh: Mesh, edges: Ints) -> Ints:
    """Return which of some edges of the mesh each point (N, 3) lies on, or −1."""
    if not (len(edges) and len(points)):
        return np.full(len(points), -1, dtype=np.intp)
    from scipy.spatial import KDTree  # noqa: PLC0415

    # A trimmed edge keeps its direction. Long edges are found by places along them.
    ends = mesh.vertices[mesh.topology.edges[edges]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    counts = np.minimum(np.ceil(length / max(float(np.median(length)), 1e-300)), _MOST_PLACES).astype(np.intp) + 1
    owner = np.repeat(np.arange(len(edges)), counts)
    share = (np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)) / (counts - 1)[owner]
    places = ends[owner, 0] + share[:, None] * (ends[owner, 1] - ends[owner, 0])
    near = np.asarray(KDTree(places).query(points, k=min(8, len(owner)))[1]).reshape(len(points), -1)
    candidates = owner[near]
    start, step = ends[candidates, 0], ends[candidates, 1] - ends[candidates, 0]
    offset = points[:, None] - start
    t = np.clip((offset * step).sum(-1) / np.maximum((step * step).sum(-1), 1e-300), 0.0, 1.0)
    apart = np.linalg.norm(offset - t[..., None] * step, axis=2)
    best = apart.argmin(axis=1)
    rows = np.arange(len(points))
    size = float(np.ptp(mesh.bounds, axis=0).max())
    return np.where(apart[rows, best] < _INSIDE * size, edges[candidates[rows, best]], -1)


def _sharp(patch: Patch, angle: float) -> Bools:
    """Return which edges (E,) of the patch two facets meet at by more than an angle, standing out."""
    a, b = patch.topology.side_pairs
    facet_a, facet_b = a // 3, b // 3
    normal_a, normal_b = patch.facet_normals[facet_a], patch.facet_normals[facet_b]
    # The corner of one facet that is off the edge lies behind the plane of the other where the edge stands out.
    far = patch.vertices[patch.faces.ravel()[b - b % 3 + (b + 2) % 3]]
    out = ((far - patch.vertices[patch.faces.ravel()[a]]) * normal_a).sum(axis=1) < 0.0
    cosine = (normal_a * normal_b).sum(axis=1)
    sharp = np.zeros(len(patch.topology.edges), dtype=np.bool_)
    sharp[patch.topology.pair_edges] = out & patch.topology.pair_agrees & (cosine < np.cos(angle))
    return sharp


def _edge_normals(patch: Patch) -> Floats:
    """Return the mean of the normals (E, 3) of the facets at each edge, of unit length where they do not cancel."""
    total = np.zeros((len(patch.topology.edges), 3))
    edge = patch.topology.edge_of_side
    for k in range(3):
        weights = np.repeat(patch.facet_normals[:, k], 3)
        total[:, k] = np.bincount(edge.ravel(), weights=weights, minlength=len(total))
    return unit_or_zero(total)


def _walks(patch: Patch, edges: Ints, marked: Bools) -> list[list[tuple[int, int]]]:
    """Return the marked edges in runs: edge and the vertex it is entered from. The loop is over marked edges."""
    numbers = np.flatnonzero(marked)
    at: dict[int, list[int]] = {}
    for e in numbers.tolist():
        for v in edges[e].tolist():
            at.setdefault(v, []).append(e)
    points = patch.vertices

    def onward(e: int, v: int) -> int | None:
        """Return the edge that goes on from edge e beyond vertex v, straight enough and the only one."""
        others = [other for other in at[v] if other != e]
        if len(others) != 1:
            return None
        came, goes = points[v] - points[_other(edges, e, v)], points[_other(edges, others[0], v)] - points[v]
        return others[0] if float(angle_between(came, goes)) < _CORNER else None

    done: set[int] = set()
    walks: list[list[tuple[int, int]]] = []
    for first in numbers.tolist():
        if first in done:
            continue
        # Back to where the run begins, or once round.
        e, v = first, int(edges[first, 0])
        while (back := onward(e, v)) is not None and back != first:
            e, v = back, _other(edges, back, v)
        walk: list[tuple[int, int]] = []
        step: int | None = e
        while step is not None and step not in done:
            done.add(step)
            walk.append((step, v))
            v = _other(edges, step, v)
            step = onward(step, v)
        walks.append(walk)
    return walks


def _other(edges: Ints, e: int, v: int) -> int:
    a, b = edges[e]
    return int(b if a == v else a)


def _line(patch: Patch, normals: Floats, walk: list[tuple[int, int]]) -> tuple[Floats, Floats]:
    """Return points and normals (n, 3) along a run of edges: at vertices the mean of the edges' that meet there."""
    edges = patch.topology.edges
    numbers = np.array([e for e, _ in walk])
    vertices = [v for _, v in walk]
    vertices.append(_other(edges, walk[-1][0], walk[-1][1]))
    own = normals[numbers]
    first, last = own[:1], own[-1:]
    if vertices[0] == vertices[-1]:
        first = last = own[:1] + own[-1:]
    return patch.vertices[vertices], unit_or_zero(np.concatenate([first, own[1:] + own[:-1], last]))


STRATEGY = Strategy("edges", EdgeOptions, draw_edges)
