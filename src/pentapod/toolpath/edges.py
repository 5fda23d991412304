"""Edges: the borders of the region, and the sharp edges within it, for deburring and trimming."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pentapod.arrays import Bools, Floats, Ints, set_frozen
from pentapod.errors import ToolpathError
from pentapod.geometry.directions import angle_between
from pentapod.toolpath.drawing import Drawing, Order
from pentapod.toolpath.finishing import nothing_left
from pentapod.toolpath.mesh import Mesh
from pentapod.toolpath.normals import unit_or_zero
from pentapod.toolpath.options import PathOptions, chosen
from pentapod.toolpath.passes import Passes
from pentapod.toolpath.patch import Patch
from pentapod.toolpath.tools import Tool

_CORNER = np.radians(40.0)
_INSIDE_M = 1e-6


class Which(StrEnum):
    """border: where the surface ends. sharp: where facets meet at an angle, on the outside. both: all of them."""

    BORDER = "border"
    SHARP = "sharp"
    BOTH = "both"


@dataclass(frozen=True, kw_only=True, eq=False)
class EdgeOptions(PathOptions):
    """Which edges are followed. sharpest: radians between the normals of two facets from which an edge is sharp."""

    which: Which | str = Which.BOTH
    sharpest: float = float(np.radians(40.0))

    def __post_init__(self) -> None:
        super().__post_init__()
        set_frozen(self, which=chosen("which", self.which, Which))
        if not 0.0 < self.sharpest < np.pi:
            raise ToolpathError("the angle is out of range", key="sharpest", value=self.sharpest, expected="(0, pi)")


def draw_edges(mesh: Mesh, tool: Tool, options: EdgeOptions) -> Drawing:
    """Return the edges of the region: of the mesh's own border and of its creases that stand out.

    The tool stands on an edge along the mean of the normals on its sides. A line ends where an edge turns by more
    than 40° or meets others. Raises ToolpathError where there is no edge.
    """
    del tool
    patch = Patch.of(mesh, options.region)
    if not len(patch.faces):
        raise nothing_left(mesh, options, 0)
    topology = patch.topology
    chosen_edges = np.zeros(len(topology.edges), dtype=np.bool_)
    if options.which is not Which.SHARP:
        chosen_edges |= (topology.facets_at_edge == 1) & _on_mesh_border(mesh, patch)
    if options.which is not Which.BORDER:
        chosen_edges |= _sharp(patch, options.sharpest)
    if not chosen_edges.any():
        raise ToolpathError(
            "the region has no such edge",
            key="which",
            value=str(options.which),
            remedy="lower the angle from which edges count",
        )
    normals = _edge_normals(patch)
    lines = [_line(patch, normals, walk) for walk in _walks(patch, topology.edges, chosen_edges)]
    return Drawing(Passes.of(lines), 0.0, Order.SHORTEST)


def _on_mesh_border(mesh: Mesh, patch: Patch) -> Bools:
    """Return which edges (E,) of the patch lie on the border of the mesh, not only on the region's."""
    border = mesh.topology.edges[mesh.topology.facets_at_edge == 1]
    if not len(border):
        return np.zeros(len(patch.topology.edges), dtype=np.bool_)
    # A trimmed edge keeps its direction: its middle lies on a border edge of the mesh.
    from scipy.spatial import KDTree  # noqa: PLC0415

    ends = mesh.vertices[border]
    middles = patch.vertices[patch.topology.edges].mean(axis=1)
    candidates = np.asarray(KDTree(ends.mean(axis=1)).query(middles, k=min(8, len(border)))[1]).reshape(
        len(middles), -1
    )
    start, step = ends[candidates, 0], ends[candidates, 1] - ends[candidates, 0]
    offset = middles[:, None] - start
    t = np.clip((offset * step).sum(-1) / np.maximum((step * step).sum(-1), 1e-300), 0.0, 1.0)
    return (np.linalg.norm(offset - t[..., None] * step, axis=2) < _INSIDE_M).any(axis=1)


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
