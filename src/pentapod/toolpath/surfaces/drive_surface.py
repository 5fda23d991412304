"""Drive surface: where the centre of a ball is that rolls over the part and cuts into it nowhere.

It is the offset surface of the part at the ball's radius, seen from outside. Lines are drawn on it as on any mesh. For
a region with a box it is made around this box only, so that the rest of the part may be of any size.
Points are then put exactly on the offset, and chords between them are proven clear by their exact distance from the
part. A ball is clear at a centre whatever its axis, so nothing of this depends on the tool axis.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from weakref import WeakKeyDictionary

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import tangent_frame
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.offset.offset_surface import Window, offset_surface
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.tree import FacetTree
from pentapod.mesh.region import Region
from pentapod.numerics.threads import nearest_points
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.surfaces.ball_centres import BallCentres, smoothed
from pentapod.toolpath.surfaces.options import DriveOptions
from pentapod.toolpath.surfaces.rolled_surface import RolledSurface
from pentapod.toolpath.surfaces.shade import out_of_the_shade
from pentapod.toolpath.surfaces.tight_channels import has_tight_channels
from pentapod.toolpath.surfaces.unreached import nearest_to_unreached

_KNOWN: WeakKeyDictionary[Mesh, dict[tuple[float, float, int, bytes], tuple[FacetTree, Mesh, bool]]] = (
    WeakKeyDictionary()
)
"""Drive surfaces of parts that are in use: planning, the verdict and changes of a job need the same."""

_KEPT = 4
"""Drive surfaces of a part that are kept, the last ones used: they are large."""


@dataclass(frozen=True, eq=False)
class DriveSurface(RolledSurface):
    """The drive surface of a ball of `radius` metres over a part; mesh: the surface itself, facing outwards.

    view (3,): unit, towards the tool. lowered: whether it is nearer to the part, for its tight channels.
    """

    part: Mesh
    mesh: Mesh
    centres: BallCentres
    view: Floats
    options: DriveOptions
    lowered: bool = False

    @property
    def places(self) -> BallCentres:
        """Where the ball's centre may be."""
        return self.centres

    @property
    def rounding(self) -> float:
        """Radius of the ball, metres."""
        return self.radius

    @classmethod
    def of(
        cls,
        part: Mesh,
        radius: float,
        view: Floats,
        options: DriveOptions | None = None,
        region: Region | None = None,
    ) -> DriveSurface:
        """Return the drive surface of a part, as far as it is needed for a region, if one is given.

        Raises MeshError where part or region is too large for the ball.
        """
        options = options or DriveOptions()
        window = None if region is None else _window(part, radius, view, options, region)
        asked = view.tobytes() if window is None else window.box.tobytes() + window.view.tobytes()
        key = radius, options.step, options.parts, asked
        known = _KNOWN.setdefault(part, {})
        found = known.pop(key, None)  # put back as the last one: others are forgotten first
        if found is None:
            tree = FacetTree.of(part)
            tight = has_tight_channels(part, tree, radius, view, options.channels, region)
            distance = (1.0 - options.channels.nearer) * radius if tight else radius
            vertices, faces = offset_surface(tree, distance, options.step * distance, options.parts, window)
            # A line goes on over creases of the drive surface: no edge of it parts passes.
            mesh = Mesh.of(vertices, faces, source=part.diagnosis.source, crease_angle=np.pi)
            found = tree, mesh, tight
        tree, mesh, tight = known[key] = found
        for other in list(known)[:-_KEPT]:
            known.pop(other, None)
        return cls(part, mesh, BallCentres(tree, radius, options.places), view, options, tight)

    def hides(self, points: Floats, slack: float) -> Bools:
        """Return whether the drive surface lies above points (N, 3) on it by more than `slack` metres."""
        return self._hides(points, slack, self.options.overhangs.sideways)

    def _hides(self, points: Floats, slack: float, sideways: float) -> Bools:
        height = points @ self.view + max(slack, self.options.overhangs.above * self.radius)
        # Walls and corners along the view do not hide themselves: one of four points around is free, close to the
        # point where a channel is narrow, farther from it where a wall leans under.
        hidden = np.ones(len(points), dtype=np.bool_)
        for step in (self.options.overhangs.beside, sideways):
            x, y = (step * self.radius * side for side in tangent_frame(self.view))
            around = (0.83 * x + 0.56 * y, 0.56 * x - 0.83 * y)
            for aside in (*around, *(-one for one in around)):
                hidden[hidden] = self.field.above(points[hidden] + aside, height[hidden])
        if self.lowered:  # in narrow bores the mesh is too coarse to tell
            rows, top = np.flatnonzero(hidden), float((self.mesh.vertices @ self.view).max(initial=-np.inf))
            out = points[rows] + np.maximum(top - points[rows] @ self.view, 0.0)[:, None] * self.view
            near = self.options.channels.nearer + self.options.channels.free
            hidden[rows] = ~self.centres.clear(points[rows], out, near * self.radius)
        return hidden

    def _patch(self, region: Region) -> Patch:
        """Return the part of the drive surface from which the ball touches a region; empty where there is none.

        A region that reaches a right angle reaches a little further, so that rounding does not split walls. Around an
        open border the ball does not roll. What lies far in the shade is left out.
        """
        patch = Patch.whole(self.mesh)
        if region.box is not None:
            for bound, side in zip(region.bounds, (1.0, -1.0), strict=True):
                for axis in range(3):
                    contacts = self.contacts(patch.vertices)
                    patch, _ = patch.above(side * (contacts[:, axis] - bound[axis]), 0.0)
        patch, overhangs = self._facing(patch, region), self.options.overhangs
        hidden = self.hides(patch.vertices[patch.faces].mean(axis=1), overhangs.shade * self.radius)
        patch = out_of_the_shade(patch, hidden, overhangs.beyond * self.radius)
        if self.part.topology.watertight:
            return patch
        beyond = self._beyond_border(patch)
        beyond[self._over_hollows(patch, beyond, region)] -= self.options.rolls * self.radius
        return patch.above(-beyond, 0.0)[0]

    def _over_hollows(self, patch: Patch, beyond: Floats, region: Region) -> Bools:
        """Return the vertices (V,) beyond the part's border about hollows that the ball only cuts from there.

        Beside ragged borders, as scans have them, there are hollows in which it rests on the border itself.
        """
        rolls = (beyond > 0.0) & (beyond <= self.options.rolls * self.radius)
        normals, middles = self.part.facet_normals, self.part.vertices[self.part.faces].mean(axis=1)
        above = (middles + self.options.hollow * self.radius * normals)[region.faces(normals, 0.5 * np.pi) >= 0.0]
        about = self.options.about_hollows * self.radius
        above = above[_distance(patch.vertices[rolls], above, self.radius) < np.inf]
        away = _distance(patch.vertices[beyond <= 0.0], above, about)
        missed = above[(away > self.radius) & (away < np.inf)]
        return (beyond > 0.0) & (_distance(missed, patch.vertices, about) < np.inf)

    def nearest_to_unreached(self, region: Region) -> Patch | None:
        """Return the facets from which the ball comes nearest to places of a region that it cannot touch.

        None for a region that takes upright walls, too, and has no box: there the ball touches what is of the region.
        """
        own = Patch.of(self.part, region)
        upright = region.angle is None or region.angle >= 0.5 * np.pi
        if (upright and region.box is None) or not len(own.faces):
            return None
        covers = partial(self.part_field.hides, slack=1e-3 * self.radius)
        given = self.patch(region), own, self.radius, self._machined, covers, self.options.unreached
        return nearest_to_unreached(self.mesh, *given)

    def _machined(self) -> Bools:
        """Return at which vertices (V,) of the drive surface the ball may be: neither hidden nor beyond a border."""
        seen = ~self.hides(self.mesh.vertices, 0.0)
        return seen if self.part.topology.watertight else seen & (self._beyond_border(Patch.whole(self.mesh)) <= 0.0)

    def feet(self, patch: Patch) -> Bools:
        """Return which edges (E,) of a patch are its borders along a corner: without a pass much is left under it."""
        foot = np.zeros(len(patch.topology.edges), dtype=np.bool_)
        foot[patch.topology.edge_of_side.ravel()[self.rising(patch)[0]]] = True
        return foot

    def rising(self, patch: Patch) -> tuple[Ints, Floats]:
        """Return the sides (S,) of facets at which a patch ends in a corner, and normals (S, 3) of what rises beyond.

        A region that ends by its angle at the foot of a wall ends there. What leans over the patch is no such wall, but
        for a little over a floor.
        """
        topology = patch.topology
        side = np.flatnonzero(topology.facets_at_edge[topology.edge_of_side.ravel()] == 1)
        ends = patch.vertices[patch.side_ends(side)]
        out = unit_or_zero(np.cross(ends[:, 1] - ends[:, 0], patch.facet_normals[side // 3]))
        step, middles = self.options.across * self.radius * out, ends.mean(axis=1)
        within, beyond = self._normals(middles - step), self._normals(middles + step)
        bent = np.einsum("ni,ni->n", within, beyond) < np.cos(self.options.crease)
        higher = np.einsum("ni,ni->n", beyond - within, out) < 0.0
        least = np.where(within @ self.view > np.cos(self.options.steep), self.options.leaning, self.options.foot)
        foot = bent & higher & (beyond @ self.view > -least)
        return side[foot], beyond[foot]

    def _normals(self, points: Floats) -> Floats:
        away = self.centres.tree.closest(points)[1]
        return away / np.maximum(np.linalg.norm(away, axis=1), 1e-300)[:, None]

    def waypoints(self, passes: Passes, options: PathOptions) -> Passes:
        """Return contacts and unit normals for lines on the drive surface, their centres put exactly on the offset.

        Along a corner the normals are midway between its sides; they are averaged along each pass. Where they jump, a
        contact is the point of the ball in the direction of the mean normal, so that the centre is where it should be.
        """
        exact = self.centres.exact(passes, options.chordal, min(options.closest, options.chordal))
        exact = self.centres.midway(exact)
        normals = smoothed(exact, self.options.places.window * self.radius)
        return replace(exact, points=exact.points - self.radius * normals, normals=normals)

    def _seen(self, ways: list[Floats | None], slack: float) -> list[Floats | None]:
        """Return ways (n, 3) of centres, None for those on which the part lies above: there only the ball has room.

        Between ends over which nothing leans, nothing may lean over a link: it is not worth a lean of the tool. Beside
        its ends, where cuts are, nothing counts.
        """
        kept = [way for way in ways if way is not None]
        if not kept:
            return ways
        begins, points = np.cumsum([0, *(len(way) for way in kept[:-1])]), np.concatenate(kept)
        ends = np.append(begins[1:], len(points)) - 1
        to_ends = [np.minimum(*(np.linalg.norm(way - way[end], axis=1) for end in (0, -1))) for way in kept]
        apart = np.concatenate(to_ends) > self.options.overhangs.under * self.radius
        hidden = np.logical_or.reduceat(self._hides(points, slack, self.options.overhangs.under) & apart, begins)
        leant = self._hides(points, slack, self.options.overhangs.upright)
        hidden |= np.logical_or.reduceat(leant & apart, begins) & ~leant[begins] & ~leant[ends]
        gone = iter(hidden.tolist())
        return [None if way is None or next(gone) else way for way in ways]

    def _at(self, contacts: Floats, normals: Floats) -> Floats:
        return contacts + self.radius * normals

    def _contacts(self, places: Floats, normals: Floats) -> Floats:
        return places - self.radius * normals

    def contacts(self, centres: Floats) -> Floats:
        """Return the points (N, 3) of the part that are nearest to centres (N, 3): where the ball touches."""
        return centres - self.centres.tree.closest(centres)[1]

    def _over(self, points: Floats) -> tuple[Floats, Floats]:
        gap, away, facet = self.centres.tree.closest(points)
        upright = np.einsum("ni,ni->n", self.part.facet_normals[self.centres.tree.facets[facet]], away)
        return points - away, np.sqrt(np.maximum(gap**2 - upright**2, 0.0))


def _distance(centres: Floats, points: Floats, most: float) -> Floats:
    """Return how far points (N, 3) are from the nearest of some centres (M, 3); infinite beyond `most` metres."""
    if not len(centres) or not len(points):
        return np.full(len(points), np.inf)
    return np.asarray(nearest_points(KDTree(centres), points, distance_upper_bound=most)[0])


def _window(part: Mesh, radius: float, view: Floats, options: DriveOptions, region: Region) -> Window | None:
    """Return where the drive surface is needed for a region; None for all of it.

    That is around what lies in the region's box, and along the view up to the top of the part above.
    """
    if region.box is None:
        return None
    inside = Patch.whole(part).in_box(region)
    box = np.array(region.bounds)
    if len(inside.faces):
        box = np.stack([inside.vertices.min(axis=0), inside.vertices.max(axis=0)])
    around = (1.0 + options.about) * radius
    box = box + np.array([[-around], [around]])
    corners = np.array([[box[k >> axis & 1, axis] for axis in range(3)] for k in range(8)])
    column = Patch.whole(part)
    for side in tangent_frame(view):
        for sense in (1.0, -1.0):
            column, _ = column.above(sense * (column.vertices @ side), float((sense * (corners @ side)).min()))
    top = float((column.vertices @ view).max(initial=-np.inf)) + 2.0 * radius
    rise = max(top - float((corners @ view).min()), 0.0) * view
    return Window(np.stack([np.minimum(box[0], box[0] + rise), np.maximum(box[1], box[1] + rise)]), view)
