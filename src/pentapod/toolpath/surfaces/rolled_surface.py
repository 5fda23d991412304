"""Rolled surface: what drive surfaces of all cutters have in common: links on them, stepovers, what is known as clear.

Lines are drawn on its mesh as on any mesh. Points are then put exactly on the surface, and chords between them proven.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property, partial

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import turned
from pentapod.geometry.polyline import arc_length
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.heightfield import HeightField
from pentapod.mesh.region import Region
from pentapod.mesh.topology import components
from pentapod.numerics.threads import nearest_points
from pentapod.toolpath.lines.scallop import surface_steps
from pentapod.toolpath.options import CoverOptions, PathOptions
from pentapod.toolpath.surface import Contacts
from pentapod.toolpath.surfaces.options import DriveOptions
from pentapod.toolpath.surfaces.places import Places
from pentapod.toolpath.surfaces.ways_around import drawn_taut, shortest_ways


class RolledSurface(ABC):
    """Where a cutter is that rolls over a part; mesh: the surface itself, facing outwards.

    view (3,): unit, towards the tool. options: how the surface was made and is used.
    """

    part: Mesh
    mesh: Mesh
    view: Floats
    options: DriveOptions
    slides = True
    turns = True

    @property
    @abstractmethod
    def places(self) -> Places:
        """Where the cutter may be."""

    @property
    @abstractmethod
    def rounding(self) -> float | None:
        """Radius in metres of the rounding that leaves scallops between passes; None if there is none."""

    @abstractmethod
    def hides(self, points: Floats, slack: float) -> Bools:
        """Return whether the surface lies above points (N, 3) on it by more than `slack` metres."""

    @abstractmethod
    def _patch(self, region: Region) -> Patch:
        """Return the part of the surface from which the cutter touches a region; empty where there is none."""

    @abstractmethod
    def _at(self, contacts: Floats, normals: Floats) -> Floats:
        """Return the places (N, 3) of contacts (N, 3) with unit normals (N, 3)."""

    @abstractmethod
    def _contacts(self, places: Floats, normals: Floats) -> Floats:
        """Return the contacts (N, 3) of places (N, 3) with unit normals (N, 3)."""

    @abstractmethod
    def _over(self, points: Floats) -> tuple[Floats, Floats]:
        """Return what a cutter at places (N, 3) touches, (N, 3), and how far (N,) it is across from its facet."""

    @abstractmethod
    def _seen(self, ways: list[Floats | None], slack: float) -> list[Floats | None]:
        """Return ways (n, 3) of the cutter, None for those on which the part lies above."""

    @abstractmethod
    def _normals(self, points: Floats) -> Floats:
        """Return the unit normals (N, 3) of the surface at points near it, NaN where they are not known."""

    def _whole(self, patch: Patch, region: Region) -> Ints:
        """Return vertices of a patch that face a region whatever their normals: none for a ball."""
        del patch, region
        return np.zeros(0, dtype=np.intp)

    def feet(self, patch: Patch) -> Bools:
        """Return which edges (E,) of a patch are borders along which a pass must run: here none."""
        return np.zeros(len(patch.topology.edges), dtype=np.bool_)

    @property
    def radius(self) -> float:
        """Radius of the cutter, metres."""
        return self.places.radius

    @cached_property
    def field(self) -> HeightField:
        """Ray casting along the view."""
        return HeightField(self.mesh, self.view)

    @property
    def part_field(self) -> HeightField:
        """Ray casting onto the part along the view."""
        return HeightField(self.part, self.view)

    def patch(self, region: Region) -> Patch:
        """Return the part of the surface from which the cutter touches a region; empty where there is none."""
        if id(region) not in self._patches:
            self._patches[id(region)] = region, self._patch(region)
        return self._patches[id(region)][1]

    @cached_property
    def _patches(self) -> dict[int, tuple[Region, Patch]]:
        """Patches that are known: strategies, fills and links ask for the same one. Regions are kept for their ids."""
        return {}

    def _facing(self, patch: Patch, region: Region) -> Patch:
        """Return the part of a patch that faces a region.

        Its border is found by the normals of the surface itself. The mean of those of the facets about the foot of a
        wall leans, and the region would end up to a facet above the foot. At creases the means count.
        """
        faces, options = partial(region.faces, default=0.5 * np.pi), self.options
        means = np.zeros_like(patch.vertices)
        means[patch.faces.ravel()] = patch.normals.reshape(-1, 3)
        values = faces(means)
        near = np.flatnonzero(np.abs(values) < options.region_ends)
        exact = self._normals(patch.vertices[near])
        smooth = np.einsum("vi,vi->v", exact, means[near]) > np.cos(options.crease)
        values[near[smooth]] = faces(exact[smooth])
        whole = self._whole(patch, region)
        values[whole] = np.maximum(values[whole], options.foot)

        def root(facet: Ints, a: Ints, b: Ints) -> Floats:
            first, last = patch.faces[facet, a], patch.faces[facet, b]
            low, high, inside = np.zeros(len(first)), np.ones(len(first)), values[first] >= 0.0
            for _ in range(options.halvings):
                middle = 0.5 * (low + high)
                share = middle[:, None]
                normals = self._normals((1.0 - share) * patch.vertices[first] + share * patch.vertices[last])
                unknown = np.isnan(normals[:, 0])
                between = (1.0 - share) * means[first] + share * means[last]
                same = (faces(np.where(unknown[:, None], between, normals)) >= 0.0) == inside
                low, high = np.where(same, middle, low), np.where(same, high, middle)
            return np.where(inside, low, high)

        return patch.trimmed(values[patch.faces], root)

    def steps(self, patch: Patch, across: Floats, options: CoverOptions) -> Floats:
        """Return the stepover (F,) on each facet, along the drive surface. Raises ToolpathError as `surface_steps`."""
        steps = surface_steps(patch, self.rounding, across, options, offset=True)
        if options.stepover is None:
            corners = patch.faces.ravel()
            facets = np.maximum(np.bincount(corners, minlength=len(patch.vertices)), 1)
            for _ in range(self.options.evened):
                mean = np.bincount(corners, weights=np.repeat(steps, 3), minlength=len(facets)) / facets
                steps = mean[patch.faces].mean(axis=1)
        return steps

    def links(
        self, ends: dict[int, tuple[Contacts, Contacts]], options: PathOptions, stepover: float
    ) -> dict[int, Contacts]:
        """Return the links on the surface between pairs of passes; axes turn evenly.

        They are straight (`Places.ways`), or else lead around what is in the way, within the region.
        """
        del stepover
        if not ends:
            return {}
        first, last = (
            (
                np.stack([pair[k][0][row] for pair in ends.values()]),
                np.stack([pair[k][1][row] for pair in ends.values()]),
            )
            for k, row in ((0, -1), (1, 0))
        )
        starts, stops = (self._at(contacts, normals) for contacts, normals in (first, last))
        told = options.spacing, options.chordal, min(options.closest, options.chordal)
        ways = self._seen(self.places.ways(starts, stops, *told), options.chordal)
        missed = [row for row, way in enumerate(ways) if way is None]
        for row, way in zip(missed, self._around(starts[missed], stops[missed], options), strict=True):
            ways[row] = way
        found: dict[int, Contacts] = {}
        for row, (key, way) in enumerate(zip(ends, ways, strict=True)):
            if way is not None:
                length = arc_length(way)
                share = length / length[-1] if length[-1] > 0.0 else np.linspace(0.0, 1.0, len(way))
                normals = turned(first[1][row], last[1][row], share, self.view)
                contacts = self._contacts(way, normals)
                for end, (contact, normal) in ((0, (first[0][row], first[1][row])), (-1, (last[0][row], last[1][row]))):
                    contacts[end], normals[end] = contact, normal
                found[key] = contacts, normals
        return found

    def _around(self, starts: Floats, ends: Floats, options: PathOptions) -> list[Floats | None]:
        """Return ways (n, 3) between pairs of centres (L, 3) around what is between them, where there is one."""
        if not len(starts):
            return []
        patch = self.patch(options.region)
        seen = ~self.hides(patch.vertices, options.chordal)
        over = np.linalg.norm(ends - starts, axis=1) + 2.0 * options.clearance
        longest = self.options.around * over
        lines = shortest_ways(patch, seen, starts, ends, longest)
        rows = [row for row, line in enumerate(lines) if line is not None]
        found = [line for line in lines if line is not None]
        told = options.spacing, options.chordal, min(options.closest, options.chordal)
        allowed = partial(self._seen, slack=options.chordal)
        for row, way in zip(rows, drawn_taut(self.places, found, *told, allowed), strict=True):
            lines[row] = way
        return lines

    def is_clear(self, centres: Floats, chordal: float) -> bool:
        """Return whether the cutter is clear of the part but for `chordal` metres along a line of centres (n, 3)."""
        return bool(self.places.clear(centres[:-1], centres[1:], chordal).all())

    def tight(self, passes: Passes) -> int:
        """Return 0: the cutter is clear of the part on the drive surface."""
        del passes
        return 0

    def _beyond_border(self, patch: Patch) -> Floats:
        """Return how far (V,) the cutter is beyond the part's open border at vertices; negative above facets.

        Measured across the border in the plane of the facet there. Holes that the cutter cannot enter are no border.
        """
        contacts, over = self._over(patch.vertices)
        corners = self.part.vertices[self.part.topology.edges[self.part.topology.facets_at_edge == 1]]
        step = self.options.border * self.radius
        count = np.ceil(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1) / step).astype(np.intp) + 1
        edge = np.repeat(np.arange(len(count)), count)
        share = (np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)) / (count - 1)[edge]
        border = corners[edge, 0] + share[:, None] * (corners[edge, 1] - corners[edge, 0])
        # Farther from the border than any vertex next to a crossing, the distance makes no difference: a search that
        # is not bounded takes long in the middle of a straight border, where much of it is about as near.
        sides = np.stack([patch.faces, np.roll(patch.faces, -1, axis=1)], axis=-1).reshape(-1, 2)
        longest = np.linalg.norm(patch.vertices[sides[:, 1]] - patch.vertices[sides[:, 0]], axis=1).max(initial=0.0)
        far = longest + 2.0 * self.radius + step
        near = np.minimum(nearest_points(KDTree(border), contacts, distance_upper_bound=far)[0], far)
        beyond = np.where((near < step) & (over > step), over, -near)
        # A cutter over a hole smaller than itself is beyond its border, but not far.
        sides = sides[(beyond[sides] > 0.0).all(axis=1)]
        number, piece = components(len(beyond), sides[:, 0], sides[:, 1])
        furthest = np.full(number, -np.inf)
        np.maximum.at(furthest, piece, beyond)
        bridged = (beyond > 0.0) & (furthest[piece] < self.options.enters * self.radius)
        return np.where(bridged, -step, beyond)
