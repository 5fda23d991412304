"""Region: which part of a surface is machined, by a box and by the way the surface faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Bools, Floats, frozen, set_frozen
from pentapod.errors import ToolpathError
from pentapod.geometry.directions import normalised
from pentapod.toolpath.mesh import Mesh

_BISECTIONS = 40


@dataclass(frozen=True, eq=False)
class Region:
    """Surface points within a box whose normal is within an angle of a direction.

    direction (3,): any length; angle: radians in (0, π/2], so that of a closed solid one side is
    machined. box (2, 3): two opposite corners, metres, or None. All in the mesh's frame.
    Raises ToolpathError for a direction of no length, an angle out of range, or a flat box.
    """

    direction: Floats | tuple[float, float, float] = (0.0, 0.0, 1.0)
    angle: float = float(np.radians(80.0))
    box: Floats | tuple[tuple[float, float, float], tuple[float, float, float]] | None = None

    def __post_init__(self) -> None:
        direction = frozen(self.direction, "region.direction", (3,))
        if not np.linalg.norm(direction) > 0.0:
            raise ToolpathError("the direction has no length", key="region.direction")
        set_frozen(self, direction=frozen(normalised(direction), "region.direction"))
        if not 0.0 < self.angle <= np.pi / 2:
            raise ToolpathError("the angle is out of range", key="region.angle", value=self.angle, expected="(0, pi/2]")
        if self.box is not None:
            box = frozen(self.box, "region.box", (2, 3))
            if (box[0] == box[1]).any():
                raise ToolpathError("the box is flat", key="region.box", value=box.tolist())
            set_frozen(self, box=frozen(np.sort(box, axis=0), "region.box"))

    @property
    def bounds(self) -> Floats:
        """Lowest and highest coordinates (2, 3), infinite without a box."""
        if self.box is None:
            return np.array([[-np.inf] * 3, [np.inf] * 3])
        return np.asarray(self.box)

    def faces(self, normals: Floats) -> Floats:
        """Return n·d − cos(angle)·‖n‖ (...) of normals (..., 3), of any length: not negative inside."""
        return normals @ self.direction - np.cos(self.angle) * np.linalg.norm(normals, axis=-1)

    def facets(self, mesh: Mesh) -> Bools:
        """Return which facets (F,) have a corner that faces the right way, and reach into the box."""
        facing = np.any(self.faces(mesh.corner_normals) >= 0.0, axis=1)
        if self.box is None:
            return facing
        low, high = self.bounds
        corners = mesh.vertices[mesh.faces]
        reaches = (corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)
        return facing & np.all(reaches, axis=1)

    def clip(self, points: Floats, normals: Floats) -> tuple[Floats, Floats]:
        """Return parameters t0, t1 (R,) of the part of each straight piece of surface that lies inside.

        points, normals (2, R, 3): the pieces' ends and the normals there, between which the normal is
        interpolated linearly. t1 < t0 where nothing is left. A piece with both ends outside that only grazes
        the cone of directions is left out: it is shorter than a facet.
        """
        t0, t1 = self._clip_box(points[0], points[1] - points[0])
        step = normals[1] - normals[0]
        at0 = self.faces(normals[0] + t0[:, None] * step) >= 0.0
        at1 = self.faces(normals[0] + t1[:, None] * step) >= 0.0
        mixed = np.flatnonzero((at0 != at1) & (t1 > t0))
        inside, outside = np.where(at0, t0, t1)[mixed], np.where(at0, t1, t0)[mixed]
        for _ in range(_BISECTIONS):
            middle = 0.5 * (inside + outside)
            good = self.faces(normals[0][mixed] + middle[:, None] * step[mixed]) >= 0.0
            inside, outside = np.where(good, middle, inside), np.where(good, outside, middle)
        t1[mixed] = np.where(at0[mixed], inside, t1[mixed])
        t0[mixed] = np.where(at0[mixed], t0[mixed], inside)
        t1[~(at0 | at1)] = -1.0
        return t0, t1

    def _clip_box(self, start: Floats, step: Floats) -> tuple[Floats, Floats]:
        t0, t1 = np.zeros(len(start)), np.ones(len(start))
        if self.box is None:
            return t0, t1
        for k, (low, high) in enumerate(self.bounds.T):
            along = step[:, k]
            moving = along != 0.0
            safe = np.where(moving, along, 1.0)
            a, b = (low - start[:, k]) / safe, (high - start[:, k]) / safe
            within = (start[:, k] >= low) & (start[:, k] <= high)
            t0 = np.maximum(t0, np.where(moving, np.minimum(a, b), np.where(within, 0.0, np.inf)))
            t1 = np.minimum(t1, np.where(moving, np.maximum(a, b), np.where(within, 1.0, -np.inf)))
        gone = t1 < t0
        return np.where(gone, 0.0, t0), np.where(gone, -1.0, t1)
