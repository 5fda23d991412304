"""Arrays for a page's script: quantised, as differences, bytes in planes, gzip, base64; `web/unpack.js` reads them."""

from __future__ import annotations

import base64
import gzip
import zlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pentapod.base.arrays import Floats, Ints

STEPS = 65534.0
"""Steps over the range of a column that names no step of its own: with NaN they fit 16 bits."""

MOST_OF_16 = 65535

LEVEL = 9
"""Of the compression."""

MESH_STEP_MM = 0.005
"""Step of the coordinates of meshes, mm."""

CURVE_BITS = 10
"""Bits of each coordinate along the space-filling curve on which the facets of a disordered mesh are sorted."""


class Packed:
    """Arrays by name.

    A column of whole numbers is stored as differences from row to row, of 16 or 32 bits, with the sign in the lowest
    bit. First come the lowest bytes of all columns, one column after the other, then the next bytes. So
    neighbours that differ little give long runs of equal bytes.
    """

    def __init__(self) -> None:
        self.directory: dict[str, dict[str, Any]] = {}
        self._bytes = bytearray()

    def numbers(self, name: str, values: ArrayLike, step: float | None = None) -> None:
        """Add numbers (N,) or (N, d), exact to half a step; step: by default 1/65534 of each column's range.

        What is not finite becomes NaN: it is stored as 0, and the lowest number as 1.
        """
        columns = _columns(np.asarray(values, dtype=np.float64))
        known = np.isfinite(columns)
        low = np.where(known, columns, np.inf).min(axis=0, initial=np.inf)
        high = np.where(known, columns, -np.inf).max(axis=0, initial=-np.inf)
        low, high = np.where(low <= high, low, 0.0), np.where(low <= high, high, 0.0)
        steps = np.full(len(low), step) if step else np.maximum(high - low, 1e-12) / STEPS
        whole = np.where(known, 1 + np.rint((np.where(known, columns, low) - low) / steps), 0).astype(np.int64)
        self._add(name, whole, low=(low - steps).tolist(), step=steps.tolist())

    def whole(self, name: str, values: ArrayLike) -> None:
        """Add whole numbers (N,) or (N, d), none negative."""
        self._add(name, _columns(np.asarray(values, dtype=np.int64)))

    def mesh(self, name: str, vertices: Floats, faces: Ints) -> None:
        """Add a mesh in the order that packs best; vertices (V, 3) in mm, faces (F, 3)."""
        orders = [np.arange(len(faces)), _along_curve(vertices, faces)]
        tried = [by_first_use(vertices, faces[order]) for order in orders]
        sizes = [_of_mesh(*mesh).rough_size for mesh in tried]
        places, corners = tried[int(np.argmin(sizes))]
        self.numbers(f"{name}.vertices", places, MESH_STEP_MM)
        self.whole(f"{name}.faces", corners)

    def _add(self, name: str, whole: NDArray[np.int64], **scale: list[float]) -> None:
        size = 2 if int(whole.max(initial=0)) <= MOST_OF_16 else 4
        change = np.diff(whole, axis=0, prepend=0)
        half = 1 << (8 * size - 1)
        change = (change + half) % (2 * half) - half  # numbers may go round: then steps are small, too
        signed = np.where(change < 0, -2 * change - 1, 2 * change).astype(f"<u{size}")
        planes = np.ascontiguousarray(signed.T).view(np.uint8).reshape(-1, size).T
        place = {"at": len(self._bytes), "rows": len(whole), "columns": whole.shape[1], "size": size}
        self.directory[name] = {**place, **scale}
        self._bytes += planes.tobytes()

    @property
    def rough_size(self) -> int:
        """Bytes of the arrays with quick compression, to compare orders by."""
        return len(zlib.compress(bytes(self._bytes), 1))

    @property
    def block(self) -> str:
        """All arrays, as text; empty where there are none."""
        return base64.b64encode(gzip.compress(bytes(self._bytes), LEVEL, mtime=0)).decode("ascii")


def by_first_use(vertices: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Return the same surface, its vertices in the order in which the faces name them; unused ones are left out."""
    used, first, inverse = np.unique(faces.ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return vertices[used[order]], place[inverse].reshape(-1, 3)


def _of_mesh(vertices: Floats, faces: Ints) -> Packed:
    packed = Packed()
    packed.numbers("vertices", vertices, MESH_STEP_MM)
    packed.whole("faces", faces)
    return packed


def _columns(values: NDArray[Any]) -> NDArray[Any]:
    return values[:, None] if values.ndim == 1 else values


def _along_curve(vertices: Floats, faces: Ints) -> Ints:
    """Return the order of the facets along a curve that fills space (Morton's)."""
    middles = vertices[faces].mean(axis=1)
    low, extent = middles.min(axis=0), max(float(np.ptp(middles, axis=0).max()), 1e-12)
    cells = ((middles - low) / extent * ((1 << CURVE_BITS) - 1)).astype(np.int64)
    code = np.zeros(len(faces), dtype=np.int64)
    for bit in range(CURVE_BITS):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")
