"""Edges: the borders of the region, and the sharp edges within it, for deburring and trimming."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.numerics.threads import nearest_points
from pentapod.toolpath.lines.sharp_edges import edge_chains, other_end, sharp_edges
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.strategy import ContactPaths, Strategy, region_patch
from pentapod.toolpath.surface import Surface


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
    """Borders and sharp edges, for deburring.

    >>> edges = EdgeOptions(clearance=15e-3)
    """

    which: Annotated[Which | str, Key("", "which edges are followed")] = Which.BOTH
    sharpest: Annotated[float, Key("deg", "angle of the normals from which an edge is sharp", gt=0.0, lt=180.0)] = (
        float(np.radians(40.0))
    )


def edge_paths(surface: Surface, options: EdgeOptions, tracing: EdgeTracing = EdgeTracing()) -> ContactPaths:
    """Return the edges of the region: borders of the mesh, and convex sharp edges.

    The tool axis is the mean of the normals on both sides of an edge. A line ends at a corner of the edge, and where it
    meets other edges. Raises ToolpathError if there is no edge.
    """
    mesh = surface.part
    patch, whole = region_patch(surface, options), Patch.whole(mesh)
    topology = patch.topology
    wanted = np.zeros(len(whole.topology.edges), dtype=np.bool_)
    chosen = np.zeros(len(topology.edges), dtype=np.bool_)
    if options.which is not Which.SHARP:
        wanted |= whole.topology.facets_at_edge == 1
    if options.which is not Which.BORDER:
        wanted |= sharp_edges(whole, options.sharpest)
        chosen |= sharp_edges(patch, options.sharpest)
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
    chains = edge_chains(patch.vertices, topology.edges, chosen, tracing.corner)
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
    near = np.asarray(nearest_points(KDTree(samples), points, k=min(8, len(owner)))[1]).reshape(len(points), -1)
    candidates = owner[near]
    start, step = ends[candidates, 0], ends[candidates, 1] - ends[candidates, 0]
    offset = points[:, None] - start
    t = np.clip((offset * step).sum(-1) / np.maximum((step * step).sum(-1), 1e-300), 0.0, 1.0)
    distance = np.linalg.norm(offset - t[..., None] * step, axis=2)
    best = distance.argmin(axis=1)
    rows = np.arange(len(points))
    size = float(np.ptp(mesh.bounds, axis=0).max())
    return np.where(distance[rows, best] < tracing.on_edge * size, edges[candidates[rows, best]], -1)


def _edge_normals(patch: Patch) -> Floats:
    """Return the mean of the normals (E, 3) of the facets at each edge, of unit length unless they cancel."""
    total = np.zeros((len(patch.topology.edges), 3))
    edge = patch.topology.edge_of_side
    for k in range(3):
        weights = np.repeat(patch.facet_normals[:, k], 3)
        total[:, k] = np.bincount(edge.ravel(), weights=weights, minlength=len(total))
    return unit_or_zero(total)


def _line(patch: Patch, normals: Floats, chain: list[tuple[int, int]]) -> tuple[Floats, Floats]:
    """Return points and normals (n, 3) along a chain; the normal at a vertex is the mean of its edges'."""
    vertices = [v for _, v in chain]
    vertices.append(other_end(patch.topology.edges, *chain[-1]))
    own = normals[[e for e, _ in chain]]
    first, last = own[:1], own[-1:]
    if vertices[0] == vertices[-1]:
        first = last = own[:1] + own[-1:]
    return patch.vertices[vertices], unit_or_zero(np.concatenate([first, own[1:] + own[:-1], last]))


STRATEGY = Strategy("edges", EdgeOptions, edge_paths)
