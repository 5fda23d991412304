"""Tip surface: where the tip of a bull-nose or flat end with a fixed axis is that rolls over the part.

What lies under an overhang, seen along the axis, is out of reach. The tip itself stands for the contact, and the axis
for the normal there: with the fixed axis each cutter's tip is then where it should be.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.cutters.bull_nose import BullNose
from pentapod.geometry.directions import tangent_frame
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.offset.tip_surface import Lowered
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.tree import FacetTree
from pentapod.mesh.region import Region
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.surfaces.options import DriveOptions
from pentapod.toolpath.surfaces.rolled_surface import RolledSurface
from pentapod.toolpath.surfaces.tip_places import TipPlaces

_Key = tuple[float, float, bytes, float]
_KNOWN: WeakKeyDictionary[Mesh, dict[_Key, tuple[Lowered, Mesh]]] = WeakKeyDictionary()
"""Tip surfaces of parts that are in use."""


@dataclass(frozen=True, eq=False)
class TipSurface(RolledSurface):
    """The surface of the tip of a cutter over a part; mesh: the surface itself. view (3,): unit, towards the tool."""

    part: Mesh
    mesh: Mesh
    tips: TipPlaces
    view: Floats
    options: DriveOptions
    turns = False

    @property
    def places(self) -> TipPlaces:
        """Where the tip may be."""
        return self.tips

    @property
    def rounding(self) -> float | None:
        """Radius of the cutter's corner, metres; None for a sharp one."""
        return self.tips.lowered.radius or None

    @classmethod
    def of(
        cls, part: Mesh, tool: BullNose, axis: Floats, view: Floats, finest: float, options: DriveOptions | None = None
    ) -> TipSurface:
        """Return the tip surface of a part for a tool axis (3,), unit. finest: metres, for the step of its grid.

        Raises MeshError where the part is too large for the cutter.
        """
        options, frame = options or DriveOptions(), np.stack([*tangent_frame(axis), axis])
        step = min(options.step * tool.radius, finest)
        known, key = _KNOWN.setdefault(part, {}), (tool.radius, tool.corner, axis.tobytes(), step)
        if key not in known:
            turned = part if (frame == np.eye(3)).all() else Mesh.of(part.vertices @ frame.T, part.faces)
            lowered = Lowered(FacetTree.of(turned), tool.corner, tool.radius - tool.corner)
            vertices, faces = lowered.surface(step)
            # A line goes on over creases: no edge parts passes.
            source = part.diagnosis.source
            known[key] = lowered, Mesh.of(vertices @ frame, faces, source=source, crease_angle=np.pi)
        lowered, mesh = known[key]
        return cls(part, mesh, TipPlaces(lowered, frame, tool.radius, options.places), view, options)

    def hides(self, points: Floats, slack: float) -> Bools:
        """Return False: along the axis nothing lies above the surface."""
        del slack
        return np.zeros(len(points), dtype=np.bool_)

    def _patch(self, region: Region) -> Patch:
        """Return the part of the surface from which the cutter touches a region; empty where there is none.

        The tip stays above the lowest point of the part. Around an open border the cutter does not roll.
        """
        patch = Patch.whole(self.mesh)
        patch, _ = patch.above(patch.vertices @ self.tips.axis, self._lowest)
        if region.box is not None:
            for bound, side in zip(region.bounds, (1.0, -1.0), strict=True):
                for k in range(3):
                    contacts = self._touched(patch)
                    patch, _ = patch.above(side * (contacts[:, k] - bound[k]), 0.0)
        patch = self._facing(patch, region)
        return patch if self.part.topology.watertight else patch.above(-self._beyond_border(patch), 0.0)[0]

    def _normals(self, points: Floats) -> Floats:
        local, options = points @ self.tips.frame.T, self.options
        heights, normals = self.tips.lowered.heights(local[:, :2])
        walls = ~(np.abs(local[:, 2] - heights) < options.border * self.radius)
        return np.where(walls[:, None], np.nan, normals @ self.tips.frame)

    def _whole(self, patch: Patch, region: Region) -> Ints:
        """Return the vertices of walls that face a region.

        At the foot of one that leans to the axis, the surface bends to go on along the axis. The mean normal there is
        out of the region.
        """
        normals = patch.facet_normals
        own = region.faces(normals, 0.5 * np.pi) >= 0.0
        return patch.faces[own & (normals @ region.direction < self.options.wall)].ravel()

    @property
    def _lowest(self) -> float:
        """Height along the axis, metres, to which the surface reaches down."""
        return float((self.part.vertices @ self.tips.axis).min()) - self.options.places.on_level * self.radius

    def feet(self, patch: Patch) -> Bools:
        """Return which edges (E,) of a patch are the lowest of steep faces: the end cuts above its tip alone."""
        topology, axis, heights = patch.topology, self.tips.axis, patch.vertices @ self.tips.axis
        low = heights < self._lowest + self.options.places.on_level * self.radius
        lowest = np.flatnonzero(low[topology.edges].all(axis=1))
        # A steep face rises from its foot.
        ends = heights[topology.edges].mean(axis=1)[topology.edge_of_side]
        rises = heights[patch.faces].mean(axis=1)[:, None] - ends
        sides = np.linalg.norm(patch.vertices[np.roll(patch.faces, -1, axis=1)] - patch.vertices[patch.faces], axis=2)
        steep = patch.facet_normals @ axis < np.cos(self.options.steep)
        foot = steep[:, None] & (rises * sides > self.options.rising * patch.areas[:, None])
        feet = np.zeros(len(topology.edges), dtype=np.bool_)
        feet[lowest] = feet[topology.edge_of_side[foot]] = True
        return feet & (topology.facets_at_edge == 1)

    def waypoints(self, passes: Passes, options: PathOptions) -> Passes:
        """Return tips for lines on the surface, put exactly on it, and the axis."""
        return self.tips.exact(passes, options.chordal, min(options.closest, options.chordal))

    def _at(self, contacts: Floats, normals: Floats) -> Floats:
        del normals
        return contacts

    def _contacts(self, places: Floats, normals: Floats) -> Floats:
        del normals
        return places

    def _seen(self, ways: list[Floats | None], slack: float) -> list[Floats | None]:
        del slack
        return ways

    def _touched(self, patch: Patch) -> Floats:
        """Return where the cutter touches a smooth surface (V, 3) if its tip is at the vertices of a patch."""
        normals = np.zeros_like(patch.vertices)
        np.add.at(normals, patch.faces.ravel(), patch.normals.reshape(-1, 3))
        return patch.vertices - self._leads(unit_or_zero(normals))

    def _leads(self, normals: Floats) -> Floats:
        """Return the way (N, 3) from the contact with a plane of given normals (N, 3) to the tip."""
        lowered, axis = self.tips.lowered, self.tips.axis
        flat = normals - (normals @ axis)[:, None] * axis
        # On nearly level surface the middle of the end counts, or else contacts would jump to its rim and back.
        sine = np.linalg.norm(flat, axis=1, keepdims=True)
        aside = flat / np.maximum(sine, self.options.border)
        return lowered.radius * (normals - axis) + lowered.disc * aside

    def _over(self, points: Floats) -> tuple[Floats, Floats]:
        lowered, frame = self.tips.lowered, self.tips.frame
        local = points @ frame.T
        touched = lowered.touched(local[:, :2])
        # At the very edge, rounded outwards, the cutter meets nothing: there its nearest point of the part counts.
        past = np.isnan(touched[:, 0])
        touched[past] = local[past] - lowered.tree.closest(local[past])[1]
        facets = lowered.tree.facets[lowered.tree.closest(touched)[2]]
        lead = self._leads(self.part.facet_normals[facets]) @ frame.T
        return touched @ frame, np.linalg.norm((local - touched - lead)[:, :2], axis=1)
