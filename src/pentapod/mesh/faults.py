"""Places of mesh faults, as line segments to draw."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.mesh import repair
from pentapod.mesh.mesh import Mesh


def faults(mesh: Mesh) -> dict[str, Floats]:
    """Return by name the edges (K, 2, 3), metres, of each fault that a mesh has.

    "border": of holes and of an open sheet; "more than two facets": not manifold; "wound unlike": the facets on
    either side face opposite ways; "sliver": the longest side of each.
    """
    topology = mesh.topology
    pairs = topology.pair_edges[~topology.pair_agrees]
    edges = {
        "border": topology.edges[topology.facets_at_edge == 1],
        "more than two facets": topology.edges[topology.facets_at_edge > 2],
        "wound unlike": topology.edges[pairs],
        "sliver": _longest_sides(mesh),
    }
    return {name: mesh.vertices[ends] for name, ends in edges.items() if len(ends)}


def _longest_sides(mesh: Mesh) -> np.ndarray[tuple[int, int], np.dtype[np.intp]]:
    """Return the vertices (K, 2) of the longest side of each sliver."""
    narrow = mesh.faces[repair.slivers(mesh.vertices, mesh.faces)]
    after = np.roll(narrow, -1, axis=1)
    longest = np.linalg.norm(mesh.vertices[after] - mesh.vertices[narrow], axis=2).argmax(axis=1)
    rows = np.arange(len(narrow))
    return np.stack([narrow[rows, longest], after[rows, longest]], axis=1)
