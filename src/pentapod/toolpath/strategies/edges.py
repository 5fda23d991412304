"""Edges: the borders of the region, and the sharp edges within it, for deburring and trimming."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import angle_between
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.strategy import ContactPaths, Strategy, region_patch


@dataclass(frozen=True)
class EdgeTracing:
    """How edges are found and joined to lines.

    corner: a line ends where the edge turns by more than this angle, radians. on_edge: distance within which a point
    lies on an edge, as a share of the part's size. most_samples: largest number of samples of a long edge, by which it
    is found.
    """

    corner: float = float(np.radians(40.0))
    on_edge: float = 1e-7
    most_samples: int = 1000


class Which(StrEnum):
    """border: where the surface ends. sharp: where facets meet at an angle, on the outside. both: all of them."""

    BORDER = "border"
    SHARP = "sharp"
    BOTH = "both"


@dataclass(frozen=True, kw_only=True, eq=False)
class EdgeOptions(PathOptions):
    """Borders and sharp edges, for deburring."""

    which: Annotated[Which | str, Key("", "which edges are followed")] = Which.BOTH
    sharpest: Annotated[float, Key("deg", "angle of the normals from which an edge is sharp", gt=0.0, lt=180.0)] = (
        float(np.radians(40.0))
    )


def edge_paths(mesh: Mesh, tool: Tool, options: EdgeOptions, tracing: EdgeTracing = EdgeTracing()) -> ContactPaths:
    """Return the edges of the region: borders of the mesh, and convex sharp edges.

    The tool axis is the mean of the normals on both sides of an edge. A line ends at a corner of the edge, and where it
    meets other edges. Raises ToolpathError if there is no edge.
    """
    del tool
    patch, whole = region_patch(mesh, options), Patch.whole(mesh)
    topology = patch.topology
    wanted = np.zeros(len(whole.topology.edges), dtype=np.bool_)
    chosen = np.zeros(len(topology.edges), dtype=np.bool_)
    if options.which is not Which.SHARP:
        wanted |= whole.topology.facets_at_edge == 1
    if options.which is not Which.BORDER:
        wanted |= _sharp(whole, options.sharpest)
        chosen |= _sharp(patch, options.sharpest)
    # Where the region ends, an edge counts if it is one of the whole mesh: the other side may face away.
    rim = np.flatnonzero(topology.facets_at_edge == 1)
    middles = patch.vertices[topology.edges[rim]].mean(axis=1)
    edge_of_rim = _edges_at(middles, mesh, np.flatnonzero(wanted), tracing)
    rim, edge_of_rim = rim[edge_of_rim >= 0], edge_of_rim[edge_of_rim >= 0]
    chosen[rim] = True
    if not chosen.any():
        raise ToolpathError(
            "the region has no such edge",
            key="which",
            value=str(options.which),
            remedy="lower the angle from which edges count",
        )
    normals = _edge_normals(patch)
    normals[rim] = _edge_normals(whole)[edge_of_rim]
    chains = _edge_chains(patch.vertices, topology.edges, chosen, tracing.corner)
    return ContactPaths(Passes.of([_line(patch, normals, chain) for chain in chains]))


def _edges_at(points: Floats, mesh: Mesh, edges: Ints, tracing: EdgeTracing) -> Ints:
    """Return on which of some edges of the mesh each point (N, 3) lies, or −1."""
    if not (len(edges) and len(points)):
        return np.full(len(points), -1, dtype=np.intp)
    # Candidates are the edges with the nearest samples; then the exact distance decides.
    ends = mesh.vertices[mesh.topology.edges[edges]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    counts = np.ceil(length / max(float(np.median(length)), 1e-300))
    counts = np.minimum(counts, tracing.most_samples).astype(np.intp) + 1
    owner = np.repeat(np.arange(len(edges)), counts)
    share = (np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)) / (counts - 1)[owner]
    samples = ends[owner, 0] + share[:, None] * (ends[owner, 1] - ends[owner, 0])
    near = np.asarray(KDTree(samples).query(points, k=min(8, len(owner)))[1]).reshape(len(points), -1)
    candidates = owner[near]
    start, step = ends[candidates, 0], ends[candidates, 1] - ends[candidates, 0]
    offset = points[:, None] - start
    t = np.clip((offset * step).sum(-1) / np.maximum((step * step).sum(-1), 1e-300), 0.0, 1.0)
    distance = np.linalg.norm(offset - t[..., None] * step, axis=2)
    best = distance.argmin(axis=1)
    rows = np.arange(len(points))
    size = float(np.ptp(mesh.bounds, axis=0).max())
    return np.where(distance[rows, best] < tracing.on_edge * size, edges[candidates[rows, best]], -1)


def _sharp(patch: Patch, angle: float) -> Bools:
    """Return which edges (E,) of the patch are convex, with an angle of more than `angle` between the normals."""
    a, b = patch.topology.side_pairs
    normal_a, normal_b = patch.facet_normals[a // 3], patch.facet_normals[b // 3]
    # An edge is convex where the third corner of one facet lies behind the plane of the other.
    corners = patch.faces.ravel()
    third = patch.vertices[corners[b - b % 3 + (b + 2) % 3]]
    convex = ((third - patch.vertices[corners[a]]) * normal_a).sum(axis=1) < 0.0
    cosine = (normal_a * normal_b).sum(axis=1)
    sharp = np.zeros(len(patch.topology.edges), dtype=np.bool_)
    sharp[patch.topology.pair_edges] = convex & patch.topology.pair_agrees & (cosine < np.cos(angle))
    return sharp


def _edge_normals(patch: Patch) -> Floats:
    """Return the mean of the normals (E, 3) of the facets at each edge, of unit length unless they cancel."""
    total = np.zeros((len(patch.topology.edges), 3))
    edge = patch.topology.edge_of_side
    for k in range(3):
        weights = np.repeat(patch.facet_normals[:, k], 3)
        total[:, k] = np.bincount(edge.ravel(), weights=weights, minlength=len(total))
    return unit_or_zero(total)


def _edge_chains(points: Floats, edges: Ints, marked: Bools, corner: float) -> list[list[tuple[int, int]]]:
    """Return the marked edges in chains without corners or branches: each edge, and the vertex where it is entered."""
    numbers = np.flatnonzero(marked)
    at: dict[int, list[int]] = {}
    for e in numbers.tolist():
        for v in edges[e].tolist():
            at.setdefault(v, []).append(e)

    def next_edge(e: int, v: int) -> int | None:
        """Return the edge that continues edge e beyond vertex v, if it is the only one and straight enough."""
        others = [other for other in at[v] if other != e]
        if len(others) != 1:
            return None
        arriving = points[v] - points[_other_end(edges, e, v)]
        leaving = points[_other_end(edges, others[0], v)] - points[v]
        return others[0] if float(angle_between(arriving, leaving)) < corner else None

    done: set[int] = set()
    chains: list[list[tuple[int, int]]] = []
    for first in numbers.tolist():
        if first in done:
            continue
        # Back to the beginning of the chain, or once round a closed one.
        e, v = first, int(edges[first, 0])
        while (back := next_edge(e, v)) is not None and back != first:
            e, v = back, _other_end(edges, back, v)
        chain: list[tuple[int, int]] = []
        step: int | None = e
        while step is not None and step not in done:
            done.add(step)
            chain.append((step, v))
            v = _other_end(edges, step, v)
            step = next_edge(step, v)
        chains.append(chain)
    return chains


def _other_end(edges: Ints, e: int, v: int) -> int:
    a, b = edges[e]
    return int(b if a == v else a)


def _line(patch: Patch, normals: Floats, chain: list[tuple[int, int]]) -> tuple[Floats, Floats]:
    """Return points and normals (n, 3) along a chain; the normal at a vertex is the mean of its edges'."""
    vertices = [v for _, v in chain]
    vertices.append(_other_end(patch.topology.edges, *chain[-1]))
    own = normals[[e for e, _ in chain]]
    first, last = own[:1], own[-1:]
    if vertices[0] == vertices[-1]:
        first = last = own[:1] + own[-1:]
    return patch.vertices[vertices], unit_or_zero(np.concatenate([first, own[1:] + own[:-1], last]))


STRATEGY = Strategy("edges", EdgeOptions, edge_paths)
