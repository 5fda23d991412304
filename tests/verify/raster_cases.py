"""Sheets and pockets, and replays of rasters over them, for claims on the surface."""

import numpy as np
import replay_cases as cases

from pentapod.geometry.polyline import arc_length
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.distance import MeshDistance
from pentapod.mesh.region import Region
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify import Coverage, Cutting
from pentapod.verify.surface.surface_left import surface_left

UP = np.array([0.0, 0.0, 1.0])


def plate(low=(0.0, 0.0), high=(0.02, 0.012), cells=4):
    """A flat sheet at z = 0."""
    return sheet(lambda x, y: 0.0 * x, low, high, cells)


def sheet(height, low=(0.0, 0.0), high=(0.02, 0.012), cells=40):
    x, y = np.meshgrid(np.linspace(low[0], high[0], cells + 1), np.linspace(low[1], high[1], cells + 1), indexing="ij")
    k = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    points = np.stack([x.ravel(), y.ravel(), height(x, y).ravel()], axis=1)
    return Mesh.of(points, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]))


def pocket(depth=0.01, size=0.02):
    """A floor at z = 0 with four walls that are square to it, open above."""
    corners = np.array([[x, y, z] for z in (0.0, depth) for x, y in ((0, 0), (size, 0), (size, size), (0, size))])
    facets = [(0, 1, 2), (0, 2, 3)]
    for k in range(4):
        n = (k + 1) % 4
        facets += [(k, 4 + k, 4 + n), (k, 4 + n, n)]
    return Mesh.of(corners, facets)


def along(*lines, tool, axes=None, piece=None):
    """A replay that goes along lines of tips (n, 3) in turn, jumping between them."""
    tips = np.concatenate(lines)
    axes = np.tile(UP, (len(tips), 1)) if axes is None else np.concatenate(axes)
    kinds = [kind for line in lines for kind in [SegmentKind.CUT] * (len(line) - 1) + [SegmentKind.RAPID]][:-1]
    segments = [Segment(kind, tips[k : k + 2], axes[k : k + 2], 0.02) for k, kind in enumerate(kinds)]
    path = Toolpath(tuple(segments), tool.tilt_centre)
    return cases.measured(path, path.tilt_centres, axes, match={"arcs": arc_length(path.tilt_centres)}, piece=piece)


def raster(step, low=-0.004, high=0.024, y0=0.0, y1=0.012, z=0.0, lift=0.02):
    """Lines along x with z above them between: a retract, a crossing and a plunge at each end."""
    lines = []
    for y in np.arange(y0, y1 + 1e-9, step):
        lines.append(np.array([[low, y, lift], [low, y, z], [high, y, z], [high, y, lift]]))
    return lines


def judged(replay, mesh, tool, left, share=0.0, region=None, tilt=cases.TILT, **more):
    patch = Patch.of(mesh, region or Region())
    cutting = Cutting(MeshDistance.of(mesh), tool.solids, 0.0, Coverage(patch, left, share, UP, **more))
    return surface_left(cases.same_motion(replay, cutting=cutting, tilt=tilt))
