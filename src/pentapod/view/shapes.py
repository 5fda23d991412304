"""Meshes for the eye: tools as bodies of revolution, and how a cylinder is laid between two points."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.directions import tangent_frame
from pentapod.geometry.solids import Solid

_AROUND, _ARC = 32, 7


def revolved(profile: Floats) -> tuple[Floats, Ints]:
    """Return vertices (V, 3) and faces (F, 3) of a profile turned about z; profile (k, 2): radius and height, upwards.

    Facets face outwards.
    """
    turn = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    radius, height = profile[:, 0, None], np.repeat(profile[:, 1, None], _AROUND, axis=1)
    vertices = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=-1).reshape(-1, 3)
    ring, step = np.meshgrid(np.arange(len(profile) - 1), np.arange(_AROUND), indexing="ij")
    a = (ring * _AROUND + step).ravel()
    b = (ring * _AROUND + (step + 1) % _AROUND).ravel()
    faces = np.concatenate([np.stack([a, b, b + _AROUND], axis=1), np.stack([a, b + _AROUND, a + _AROUND], axis=1)])
    return vertices, faces.astype(np.intp)


def solid_profile(solid: Solid) -> Floats:
    """Return the profile (k, 2) of a thickened frustum, radius and height, from its lowest point to its highest."""
    lean = float(np.arctan2(solid.low_radius - solid.high_radius, max(solid.high - solid.low, 1e-12)))
    lean = 0.0 if solid.is_ball else lean
    lower, upper = np.linspace(-0.5 * np.pi, lean, _ARC), np.linspace(lean, 0.5 * np.pi, _ARC)
    ends = ((solid.low_radius, solid.low, lower), (solid.high_radius, solid.high, upper))
    arcs = [
        np.stack([radius + solid.rounding * np.cos(arc), height + solid.rounding * np.sin(arc)], axis=1)
        for radius, height, arc in ends
    ]
    bottom, top = (0.0, arcs[0][0, 1]), (0.0, arcs[1][-1, 1])
    return np.concatenate([[bottom], *arcs, [top]])


def tool_mesh(solids: Iterable[Solid]) -> tuple[Floats, Ints]:
    """Return vertices (V, 3) and faces (F, 3) of a tool: its tip at the origin, its axis along z."""
    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.intp)], 0
    for solid in solids:
        points, facets = revolved(solid_profile(solid))
        vertices.append(points)
        faces.append(facets + count)
        count += len(points)
    return np.concatenate(vertices), np.concatenate(faces)


def along(direction: Floats) -> Floats:
    """Return the rotation (3, 3) that takes z to a unit direction (3,)."""
    return np.column_stack([*tangent_frame(direction), direction])


def quaternion(rotation: Floats) -> Floats:
    """Return the unit quaternion (4,), w first and not negative, of a rotation (3, 3)."""
    r = rotation
    # Of each product of two components: the column of the largest square is the least rounded.
    k = np.array([
        [1.0 + r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
        [r[2, 1] - r[1, 2], 1.0 + r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
        [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], 1.0 - r[0, 0] + r[1, 1] - r[2, 2], r[1, 2] + r[2, 1]],
        [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], 1.0 - r[0, 0] - r[1, 1] + r[2, 2]],
    ])  # fmt: skip
    column = k[int(np.diag(k).argmax())]
    q = column / np.linalg.norm(column)
    return q if q[0] >= 0.0 else -q


def rotation_of(wxyz: Floats) -> Floats:
    """Return the rotation (3, 3) of a quaternion (4,), w first, of any length but zero."""
    w, x, y, z = np.asarray(wxyz, dtype=np.float64) / np.linalg.norm(wxyz)
    return np.array([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ])  # fmt: skip
