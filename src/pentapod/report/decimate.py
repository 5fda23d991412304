"""Decimation of curves and meshes for display."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints


def keep_extremes(values: Floats, buckets: int) -> Ints:
    """Return indices, ascending, of the first, last, lowest and highest value in each of `buckets` runs.

    values (N,); NaN counts as neither. All indices where N is at most 4 · buckets. The thinned curve covers
    the same pixels and has the same largest and smallest value.
    """
    count = len(values)
    if count <= 4 * buckets:
        return np.arange(count, dtype=np.intp)
    edges = np.linspace(0, count, buckets + 1).astype(np.intp)
    width = int(np.diff(edges).max())
    index = np.minimum(edges[:-1, None] + np.arange(width), edges[1:, None] - 1)
    block = values[index]
    low = np.where(np.isnan(block), np.inf, block).argmin(axis=1)
    high = np.where(np.isnan(block), -np.inf, block).argmax(axis=1)
    runs = np.arange(buckets)
    return np.unique(np.concatenate([edges[:-1], edges[1:] - 1, index[runs, low], index[runs, high]]))


def thinned_mesh(vertices: Floats, faces: Ints, most_facets: int) -> tuple[Floats, Ints]:
    """Return a mesh of at most about `most_facets` facets for display: vertices clustered on a grid.

    vertices (V, 3), faces (F, 3). A mesh that is small enough is returned as it is.
    """
    if len(faces) <= most_facets:
        return vertices, faces
    low, extent = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    cells = float(np.sqrt(most_facets))
    while True:
        keys = np.floor((vertices - low) / extent * cells).astype(np.int64)
        across = int(keys.max()) + 1  # one number for each cell: numbers are sorted much faster than triples
        cell = (keys[:, 0] * across + keys[:, 1]) * across + keys[:, 2]
        _, first, inverse = np.unique(cell, return_index=True, return_inverse=True)
        thin = inverse[faces]
        proper = (thin[:, 0] != thin[:, 1]) & (thin[:, 1] != thin[:, 2]) & (thin[:, 2] != thin[:, 0])
        if proper.sum() <= most_facets:
            return vertices[first], thin[proper].astype(np.intp)
        cells *= 0.8
