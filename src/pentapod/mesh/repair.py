"""Mesh repair: vertex welding, joined borders, degenerate and duplicated facets, consistent winding."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats, Ints, row_lengths, row_maxima
from pentapod.geometry.runs import distinct
from pentapod.mesh.normals import CHUNK, facet_cross
from pentapod.mesh.topology import Topology

WELD = 1e-8
"""Vertices closer than about this fraction of the largest extent are merged."""

NEAR = 1e-5
"""Vertices on borders that are closer than this fraction of the largest extent are merged, and it is reported."""

DEGENERATE, SLIVER = 1e-9, 1e-3
"""Height of a facet, as a fraction of its longest side, up to which it is degenerate, or a sliver."""


def weld(vertices: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Return the vertices with equal ones merged and unused ones dropped, and the facets on them.

    Equal means after rounding to `WELD` of the largest extent. That is finer than the 24 bits of an STL: rounding noise
    about zero is merged, vertices that a file tells apart are not. The order follows the coordinates.
    """
    used = np.zeros(len(vertices), dtype=np.bool_)
    used[faces] = True
    points = vertices[used]
    lowest = points.min(axis=0)
    extent = float((points.max(axis=0) - lowest).max())
    x, y, z = np.rint((points - lowest) / (WELD * extent if extent > 0.0 else 1.0)).astype(np.int64).T
    bits = int(1.0 / WELD).bit_length() + 1
    first, number = _distinct((x << bits) + y)
    first, number = _distinct((number << bits) + z)
    return points[first], number[np.cumsum(used)[faces] - 1]


def joined_borders(vertices: Floats, topology: Topology) -> tuple[Ints, float] | None:
    """Return the vertex (V,) that replaces each one, and the distance below which border vertices were merged.

    None where no two vertices on borders are that close. A vertex is merged with one within this distance only, so that
    a border of very short edges does not shrink to a point.
    """
    open_ = topology.facets_at_edge == 1
    if not open_.any():
        return None
    border = distinct(topology.edges[open_])
    near = NEAR * float(np.ptp(vertices, axis=0).max())
    pairs = border[np.sort(KDTree(vertices[border]).query_pairs(near, output_type="ndarray"), axis=1)]
    if not len(pairs):
        return None
    instead = np.arange(len(vertices))
    np.minimum.at(instead, pairs[:, 1], pairs[:, 0])
    return instead, near


def _distinct(keys: Ints) -> tuple[Ints, Ints]:
    """Return where each distinct key first occurs, in the order of the keys, and each key's number."""
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    new = np.concatenate([[True], ordered[1:] != ordered[:-1]])
    number = np.empty(len(keys), dtype=np.intp)
    number[order] = np.cumsum(new) - 1
    return order[new], number


def degenerate_facets(vertices: Floats, faces: Ints) -> Bools:
    """Return which facets (F,) have corners that coincide or lie on a line."""
    return _lower_than(DEGENERATE, vertices, faces)


def slivers(vertices: Floats, faces: Ints) -> Bools:
    """Return which facets (F,) are lower than a thousandth of their longest side."""
    return _lower_than(SLIVER, vertices, faces)


def _lower_than(share: float, vertices: Floats, faces: Ints) -> Bools:
    """Return which facets (F,) have a height of at most `share` of their longest side."""
    low = np.empty(len(faces), dtype=np.bool_)
    for first in range(0, len(faces), CHUNK):
        part = faces[first : first + CHUNK]
        corners = vertices[part]
        longest = row_maxima(row_lengths(corners - np.roll(corners, 1, axis=1))) ** 2
        low[first : first + CHUNK] = row_lengths(facet_cross(vertices, part)) <= share * longest
    return low


def duplicated_facets(faces: Ints, vertex_count: int) -> Bools:
    """Return which facets (F,) repeat an earlier one on the same three vertices, however wound."""
    low, middle, high = np.sort(faces, axis=1).T
    _, pair = _distinct(low * np.intp(vertex_count) + middle)
    first, _ = _distinct(pair * np.intp(vertex_count) + high)
    repeated = np.ones(len(faces), dtype=np.bool_)
    repeated[first] = False
    return repeated


def signed_volume(vertices: Floats, faces: Ints) -> float:
    """Return the volume in cubic metres that a closed surface encloses, negative when it is inside out."""
    centred = vertices - vertices.mean(axis=0)
    return float((centred[faces[:, 0]] * facet_cross(centred, faces)).sum() / 6.0)


def wind(vertices: Floats, faces: Ints) -> tuple[Ints, tuple[str, ...]]:
    """Return the facets wound alike within each body, closed bodies outwards, and a sentence for each change."""
    changes: list[str] = []
    areas = np.linalg.norm(facet_cross(vertices, faces), axis=1)
    flip, possible = Topology(faces, len(vertices)).consistent_winding(areas)
    if flip.any():
        changes.append(f"{int(flip.sum()):,} facets turned so that neighbours are wound alike")
    if not possible:
        changes.append("a one-sided surface cannot be wound consistently; it was left unchanged")
    wound = np.where(flip[:, None], faces[:, ::-1], faces)
    topology = Topology(wound, len(vertices))
    if topology.watertight and topology.consistent and signed_volume(vertices, wound) < 0.0:
        wound = wound[:, ::-1]
        changes.append("the closed surface was inside out and has been turned")
    return np.ascontiguousarray(wound), tuple(changes)
