"""Touches forged from a known placement, by formulas of their own: SciPy's rotations, distances of joints."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from pentapod.geometry import RigidTransform
from pentapod.mesh import Mesh

RADIUS, PROBE = 2e-3, 0.2


def moved(seed: int, degrees: float = 2.0, metres: float = 2e-3) -> RigidTransform:
    """A placement that is off by so much in each direction."""
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(np.radians(degrees) * rng.normal(size=3)).as_matrix()
    return RigidTransform(turn, metres * rng.normal(size=3))


def touched(mesh: Mesh, facets, count: int, seed: int, radius: float = RADIUS):
    """Centres (N, 3) of balls that touch the mesh's facets, workpiece frame: those that go into no other facet."""
    rng = np.random.default_rng(seed)
    areas = np.linalg.norm(
        np.cross(*(mesh.vertices[mesh.faces[:, k]] - mesh.vertices[mesh.faces[:, 0]] for k in (1, 2))), axis=1
    )
    areas = areas * facets
    centres = []
    while len(centres) < count:
        facet = int(rng.choice(len(areas), p=areas / areas.sum()))
        point = rng.dirichlet(np.ones(3)) @ mesh.vertices[mesh.faces[facet]]
        centre = point + radius * mesh.facet_normals[facet]
        if free(mesh, centre, radius):
            centres.append(centre)
    return np.array(centres)


def free(mesh: Mesh, centre, radius: float) -> bool:
    """Whether no edge or corner of the mesh is inside a ball, and no facet near it cuts it."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    height = ((centre - a) * normal).sum(axis=1)
    foot = centre - height[:, None] * normal
    inside = np.all(
        [(np.cross(v - u, foot - u) * normal).sum(axis=1) >= 0.0 for u, v in ((a, b), (b, c), (c, a))], axis=0
    )
    near = np.where(inside, np.abs(height), np.inf).min()
    for u, v in ((a, b), (b, c), (c, a)):
        share = np.clip(((centre - u) * (v - u)).sum(axis=1) / np.square(v - u).sum(axis=1), 0.0, 1.0)
        near = min(near, np.linalg.norm(u + share[:, None] * (v - u) - centre, axis=1).min())
    return bool(near >= radius - 1e-9)


def legs_at(robot, centres, axes, probe: float = PROBE, radius: float = RADIUS):
    """Legs (N, n) that hold a probe's ball at centres (N, 3) with unit axes (N, 3), tip to spindle."""
    p = centres + (probe - radius) * axes
    joints = p[:, None] - robot.offsets[None, :, None] * axes[:, None]
    return np.linalg.norm(joints - robot.base_joints, axis=2)


def sphere(rings: int, radius: float = 0.03) -> Mesh:
    """A sphere of latitudes and longitudes."""
    return revolved([(radius * np.sin(t), radius * np.cos(t)) for t in np.linspace(0.0, np.pi, rings + 1)], 2 * rings)


def revolved(profile, sections: int) -> Mesh:
    """A surface of revolution about z of a profile of radii and heights."""
    angles = 2.0 * np.pi * np.arange(sections) / sections
    points = np.array([[r * np.cos(a), r * np.sin(a), z] for r, z in profile for a in angles])
    faces = []
    for k in range(len(profile) - 1):
        for j in range(sections):
            a, b = k * sections + j, k * sections + (j + 1) % sections
            faces += [[a, a + sections, b + sections], [a, b + sections, b]]
    return Mesh.of(points, np.array(faces))


def sheet(height, size: float = 0.06, cells: int = 40) -> Mesh:
    """A sheet over a square."""
    grid = np.linspace(-0.5, 0.5, cells + 1) * size
    x, y = np.meshgrid(grid, grid, indexing="ij")
    points = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    k = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    return Mesh.of(points, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]))
