"""Contacts of a probe's ball with the surface of a part, and how motions of the part change them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.query.distance import MeshDistance


@dataclass(frozen=True)
class ContactOptions:
    """edge_deg: angle between the surface's normal and the direction to the ball from which the ball touches an edge.

    contact: metres; nearer than this, the direction from the surface to the ball's centre is the surface's normal.
    around: directions in which a ball is displaced, to see whether it would touch an edge.
    """

    edge_deg: float = 20.0
    contact: float = 1e-7
    around: int = 8


OPTIONS = ContactOptions()


@dataclass(frozen=True, eq=False)
class Contacts:
    """N balls beside the surface of a part, workpiece frame, metres.

    gaps (N,): from the ball to the surface, negative where the ball is inside. points (N, 3): nearest points of the
    surface. gradients (N, 3): unit directions in which the gaps grow. normals (N, 3): unit normals of the smooth
    surface that the mesh approximates; at edges the gradients. on_edge (N,): whether the ball touches an edge.
    """

    gaps: Floats
    points: Floats
    gradients: Floats
    normals: Floats
    on_edge: Bools

    @classmethod
    def of(cls, surface: MeshDistance, centres: Floats, radius: float) -> Contacts:
        """Return the contacts of balls with centres (N, 3) and one radius, metres."""
        feet = surface.feet(centres)
        offset = centres - feet.points
        length = np.linalg.norm(offset, axis=1)
        smooth = smooth_normals(surface, feet.points, feet.facets)
        gradients = np.where((length > OPTIONS.contact)[:, None], feet.sides[:, None] * unit_or_zero(offset), smooth)
        on_edge = np.einsum("ij,ij->i", gradients, smooth) < np.cos(np.radians(OPTIONS.edge_deg))
        normals = np.where(on_edge[:, None], gradients, smooth)
        return cls(feet.sides * length - radius, feet.points, gradients, normals, on_edge)


def off_edges(surface: MeshDistance, points: Floats, normals: Floats, radius: float, misplaced: float) -> Bools:
    """Return at which points (N, 3) with normals (N, 3) a ball touches no edge, though the part is misplaced so far."""
    sideways = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    first = unit_or_zero(sideways)
    second = np.cross(normals, first)
    off = np.ones(len(points), dtype=np.bool_)
    for angle in 2.0 * np.pi * np.arange(OPTIONS.around) / OPTIONS.around:
        shift = misplaced * (np.cos(angle) * first + np.sin(angle) * second)
        off &= ~Contacts.of(surface, points + radius * normals + shift, radius).on_edge
    return off


def smooth_normals(surface: MeshDistance, points: Floats, facets: Ints) -> Floats:
    """Return the unit normals (N, 3), interpolated between the facets' corners, at points (N, 3) on facets (N,)."""
    mesh = surface.mesh
    corners = mesh.vertices[mesh.faces[facets]]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal, off = np.cross(first, second), points - corners[:, 0]
    square = np.maximum(np.einsum("ij,ij->i", normal, normal), 1e-300)
    b = np.einsum("ij,ij->i", np.cross(off, second), normal) / square
    c = np.einsum("ij,ij->i", np.cross(first, off), normal) / square
    weights = np.clip(np.stack([1.0 - b - c, b, c], axis=1), 0.0, 1.0)
    outward = -1.0 if mesh.diagnosis.inverted else 1.0
    return outward * unit_or_zero(np.einsum("nk,nkc->nc", weights, mesh.corner_normals[facets]))


def motion_rows(points: Floats, normals: Floats, centre: Floats, size: float) -> Floats:
    """Return how far motions of the part shift its surface along normals (N, 3) at points (N, 3): rows (N, 6).

    Three columns for shifts along x, y, z; three for turns about axes through the centre (3,), in metres at the
    distance `size` from it.
    """
    return np.hstack([normals, np.cross(points - centre, normals) / size])
