"""Decimation of meshes for display."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints


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
