"""Meshes of tools as solids of revolution, and rotations as quaternions, for display."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.spatial.transform import Rotation

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.directions import tangent_frame
from pentapod.geometry.solids import Solid

SECTIONS, ARC_POINTS = 32, 7
"""Corners of a circle about the axis; points of a rounded edge."""


def revolved(profile: Floats) -> tuple[Floats, Ints]:
    """Return vertices (V, 3) and faces (F, 3) of a profile turned about z; profile (k, 2): radius and height, upwards.

    Facets face outwards.
    """
    from trimesh.creation import revolve  # noqa: PLC0415 - heavy

    body = revolve(profile, sections=SECTIONS)
    return np.asarray(body.vertices, dtype=np.float64), np.asarray(body.faces, dtype=np.intp)


def solid_profile(solid: Solid) -> Floats:
    """Return the profile (k, 2) of a thickened frustum, radius and height, from its lowest point to its highest."""
    lean = float(np.arctan2(solid.low_radius - solid.high_radius, max(solid.high - solid.low, 1e-12)))
    lean = 0.0 if solid.is_ball else lean
    lower, upper = np.linspace(-0.5 * np.pi, lean, ARC_POINTS), np.linspace(lean, 0.5 * np.pi, ARC_POINTS)
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
    return np.roll(Rotation.from_matrix(rotation).as_quat(canonical=True), 1)


def rotation_of(wxyz: Floats) -> Floats:
    """Return the rotation (3, 3) of a quaternion (4,), w first, of any length but zero."""
    return Rotation.from_quat(np.roll(wxyz, -1)).as_matrix()
