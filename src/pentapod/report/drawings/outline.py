"""Outline of a part as a draughtsman draws it: the area that its facets cover, with holes, and the lines that are seen.

Lines are borders, creases, and where the surface turns away from the viewer. Those behind the surface are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.runs import members, run_starts
from pentapod.mesh.topology import Topology
from pentapod.report.drawings.raster import Grid, borders, simplified


@dataclass(frozen=True)
class OutlineOptions:
    """How finely an outline is drawn.

    cells: of the grid, along the longer side. crease_deg: angle between facets from which their edge is a line. close:
    how near to its true course a line is drawn, in cells. shortest: the shortest line, in cells. smallest: the smallest
    area, or hole, in cells. most_lines, most_links: where there are more lines, or more pieces of them, those of
    creases are left out, and then all.
    """

    cells: int = 900
    crease_deg: float = 35.0
    close: float = 1.0
    shortest: float = 4.0
    smallest: float = 3.0
    most_lines: int = 3000
    most_links: int = 60_000


OPTIONS = OutlineOptions()

FLAT = 1e-6
"""Facets count as seen from the side where the cosine of their normal to the view is at most this."""

LONGEST_WALK = 4096
"""Pieces into which an edge is cut at most, to see which of them are hidden."""


@dataclass(frozen=True, eq=False)
class Outline:
    """An outline in its view plane, in the unit of the vertices: to the right and upwards.

    areas: closed lines (K, 2) around what is covered, the outer ones counterclockwise, holes clockwise.
    lines: lines (K, 2) inside. low, high (2,): of the covered box.
    """

    areas: tuple[Floats, ...]
    lines: tuple[Floats, ...]
    low: Floats
    high: Floats

    @property
    def area(self) -> float:
        """The covered area, without holes."""
        return sum(_area(line) for line in self.areas)


def outline_of(vertices: Floats, topology: Topology, options: OutlineOptions = OPTIONS) -> Outline:
    """Return the outline of a mesh's facets with vertices (V, 3): to the right, upwards, and towards the viewer."""
    faces = topology.faces
    used = np.zeros(len(vertices), dtype=np.bool_)
    used[faces.ravel()] = True
    flat = vertices[used, :2].T
    low, high = flat.min(axis=1), flat.max(axis=1)
    grid = Grid.around(low, high, options.cells)
    cuts = grid.cuts(vertices[faces])
    covered = grid.covered(cuts)
    areas = [simplified(line, options.close) for line in borders(covered)]
    areas = [grid.points(line) for line in areas if abs(_area(line)) > options.smallest]
    turns, creases = _edges(vertices, topology, options)
    seen = _Seen(grid, covered, grid.nearest(cuts))
    edges = topology.edges
    for drawn in (turns | creases, turns):
        lines = _joined(seen.parts(vertices[edges[drawn]]), options)
        if lines is not None and len(lines) <= options.most_lines:
            break
    else:
        lines = []
    return Outline(tuple(areas), tuple(grid.points(line) for line in lines), low, high)


def _area(line: Floats) -> float:
    """Return the area (counterclockwise: positive) within a closed line."""
    x, y = line.T
    return 0.5 * float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum())


def _edges(vertices: Floats, topology: Topology, options: OutlineOptions) -> tuple[Bools, Bools]:
    """Return which edges (E,) are borders or where the surface turns away, and which are creases."""
    a, b, c = (vertices[topology.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    first, second = (side // 3 for side in topology.side_pairs)
    turns = topology.facets_at_edge == 1
    turns |= topology.facets_at_edge > 2
    creases = np.zeros(len(turns), dtype=np.bool_)
    towards = normals[:, 2] > FLAT
    turns[topology.pair_edges] = towards[first] != towards[second]
    bend = np.einsum("ij,ij->i", normals[first], normals[second])
    creases[topology.pair_edges] = bend < np.cos(np.radians(options.crease_deg))
    return turns, creases


@dataclass(frozen=True, eq=False)
class _Seen:
    """What hides lines: the cells that are covered, and how near the nearest facet is at each."""

    grid: Grid
    covered: Bools
    nearest: Floats

    def parts(self, edges: Floats) -> Floats:
        """Return the parts (P, 2, 2) of edges (E, 2, 3) that are seen, in cells, but for those on the border."""
        from scipy.ndimage import maximum_filter, minimum_filter  # noqa: PLC0415 - slow to import

        flat = self.grid.cells(edges[..., :2])
        counts = np.ceil(np.linalg.norm(flat[:, 1] - flat[:, 0], axis=1)).astype(np.intp)
        counts = np.clip(counts, 1, LONGEST_WALK)
        edge, number = members(counts)
        share = ((number + 0.5) / counts[edge])[:, None]
        places = flat[edge, 0] + share * (flat[edge, 1] - flat[edge, 0])
        depths = edges[edge, 0, 2] + share[:, 0] * (edges[edge, 1, 2] - edges[edge, 0, 2])
        # The nearest facet counts where all cells around are in front: a line is at the end of the surface beside it.
        inside = np.asarray(minimum_filter(self.covered, 3)) > 0
        around: Floats = np.asarray(minimum_filter(self.nearest, 3))
        column, row = (np.clip(places[:, k].astype(np.intp), 0, self.covered.shape[1 - k] - 1) for k in (0, 1))
        beside = np.asarray(maximum_filter(self.covered, 3)) > 0
        on_border = ~inside[row, column] & beside[row, column]
        seen = (depths >= around[row, column] - 1e-9) & ~on_border
        # Pieces of an edge that follow each other are one part.
        begins = seen & np.concatenate([[True], ~seen[:-1] | (edge[1:] != edge[:-1])])[: len(seen)]
        ends = seen & np.concatenate([~seen[1:] | (edge[1:] != edge[:-1]), [True]])[: len(seen)]
        e = edge[begins]
        t = np.stack([number[begins] / counts[e], (number[ends] + 1) / counts[e]], axis=1)[..., None]
        return flat[e, None, 0] + t * (flat[e, None, 1] - flat[e, None, 0])


def _joined(parts: Floats, options: OutlineOptions) -> list[Floats] | None:
    """Return lines (K, 2) of parts (P, 2, 2), joined where two of them meet, and simplified; None: too many."""
    if not len(parts):
        return []
    keys = np.round(2.0 * parts.reshape(-1, 2)).astype(np.intp)
    _, first, node = np.unique(keys[:, 0] * (keys[:, 1].max() + 1) + keys[:, 1], return_index=True, return_inverse=True)
    places, ends = parts.reshape(-1, 2)[first], np.sort(node.reshape(-1, 2), axis=1)
    ends = ends[ends[:, 0] != ends[:, 1]]
    ends = ends[np.unique(ends[:, 0] * len(places) + ends[:, 1], return_index=True)[1]]
    if len(ends) > options.most_links:
        return None
    walks = _walks(ends, len(places))
    between = places[[walk[-1] for walk in walks]] - places[[walk[0] for walk in walks]]
    if np.count_nonzero(np.abs(between).sum(axis=1) >= options.shortest) > options.most_lines:
        return None  # lines that are kept anyway, and there are more
    lines = [simplified(places[walk], options.close) for walk in walks]
    return [line for line in lines if np.abs(np.diff(line, axis=0)).sum() >= options.shortest]


def _walks(ends: Ints, count: int) -> list[Ints]:
    """Return walks of nodes that take each link (L, 2) of `count` nodes once, and go on where two links meet."""
    links = np.concatenate([ends, ends[:, ::-1]])
    order = np.argsort(links[:, 0], kind="stable")
    degree = np.bincount(links[:, 0], minlength=count)
    start, target, link = run_starts(degree).tolist(), links[order, 1].tolist(), (order % len(ends)).tolist()
    used, degrees = [False] * len(ends), degree.tolist()
    walks: list[Ints] = []
    # First from where lines end or fork, then around those that are closed.
    for node in [*np.flatnonzero((degree > 0) & (degree != 2)).tolist(), *np.flatnonzero(degree == 2).tolist()]:
        for k in range(start[node], start[node + 1]):
            if used[link[k]]:
                continue
            walk, at = [node], k
            while True:
                used[link[at]] = True
                walk.append(target[at])
                here = walk[-1]
                ways = [] if degrees[here] != 2 else [j for j in (start[here], start[here] + 1) if not used[link[j]]]
                if not ways:
                    break
                at = ways[0]
            walks.append(np.array(walk, dtype=np.intp))
    return walks
