"""Surfaces with known answers, and an oracle for distances."""

from __future__ import annotations

import numpy as np

from pentapod.toolpath import Mesh


def grid(height, width=0.1, cells=60, depth=None):
    """Triangles of z = height(x, y) over a rectangle about the origin, metres."""
    depth = width if depth is None else depth
    x, y = np.meshgrid(np.linspace(-width / 2, width / 2, cells + 1), np.linspace(-depth / 2, depth / 2, cells + 1))
    i = np.arange(cells * (cells + 1)).reshape(cells, cells + 1)[:, :-1].ravel()
    n = cells + 1
    faces = np.concatenate([np.stack([i, i + 1, i + n + 1], 1), np.stack([i, i + n + 1, i + n], 1)])
    return np.stack([x, y, height(x, y)], -1).reshape(-1, 3), faces


def sphere(radius=0.05, subdivisions=4):
    """An icosphere."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return np.array(ball.vertices), np.array(ball.faces)


def torus(major=0.04, minor=0.015, sections=(160, 80)):
    """A torus about z."""
    u, v = (np.arange(n) * 2 * np.pi / n for n in sections)
    u, v = np.meshgrid(u, v, indexing="ij")
    ring = major + minor * np.cos(v)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), minor * np.sin(v)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(sections[0]), np.arange(sections[1]), indexing="ij")
    a, b, c, d = (
        (((i + p) % sections[0]) * sections[1] + (j + q) % sections[1]).ravel()
        for p, q in ((0, 0), (1, 0), (1, 1), (0, 1))
    )
    return points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def box(size=(0.06, 0.04, 0.02)):
    """A closed box, two triangles a side."""
    import trimesh

    solid = trimesh.creation.box(extents=size)
    return np.array(solid.vertices), np.array(solid.faces)


def surface_distance(mesh: Mesh, points):
    """Distance of points to a mesh by trimesh's closest point, an oracle of its own.

    In millimetres: its absolute tolerances take facets of a square millimetre in metres for degenerate.
    """
    import trimesh

    shape = trimesh.Trimesh(1e3 * mesh.vertices, mesh.faces, process=False)
    return 1e-3 * np.asarray(trimesh.proximity.closest_point(shape, 1e3 * points)[1])


def random_points(mesh: Mesh, count, region, seed=7):
    """Points (N, 3) spread evenly over the area of a mesh, those in a region, and smooth normals there."""
    random = np.random.default_rng(seed)
    facet = random.choice(len(mesh.faces), count, p=mesh.facet_areas / mesh.facet_areas.sum())
    weights = random.dirichlet([1, 1, 1], count)[:, :, None]
    points = (mesh.vertices[mesh.faces[facet]] * weights).sum(axis=1)
    normals = (mesh.corner_normals[facet] * weights).sum(axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    low, high = region.bounds
    inside = (normals @ region.direction >= np.cos(region.within)) & ((points >= low) & (points <= high)).all(axis=1)
    return points[inside], normals[inside]


def distance_to_lines(points, normals, lines, line_normals, step=1e-4):
    """Distance (N,) along the surface from points to polylines (lists of (n, 3)) on it, for distances of a few steps.

    Straight distance to the line sampled every `step`, lengthened as an arc between both normals would be; what faces
    another way by more than a right angle is another side of the part. An upper bound but for the sampling.
    """
    from scipy.spatial import cKDTree

    dense, facing = [], []
    for line, normal in zip(lines, line_normals, strict=True):
        count = np.maximum(np.ceil(np.linalg.norm(np.diff(line, axis=0), axis=1) / step).astype(int), 1)
        leg = np.repeat(np.arange(len(count)), count)
        t = ((np.arange(len(leg)) - np.repeat(np.cumsum(count) - count, count)) / count[leg])[:, None]
        dense += [line[leg] * (1 - t) + line[leg + 1] * t, line[-1:]]
        facing += [normal[leg] * (1 - t) + normal[leg + 1] * t, normal[-1:]]
    dense, facing = np.concatenate(dense), np.concatenate(facing)
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    near, which = cKDTree(dense).query(points, k=8)
    cosine = np.clip((facing[which] * normals[:, None]).sum(axis=2), -1, 1)
    half = 0.5 * np.arccos(cosine)
    along = near * np.where(half > 1e-6, half / np.maximum(np.sin(half), 1e-9), 1.0)
    return np.where(cosine > 0, along, np.inf).min(axis=1)
