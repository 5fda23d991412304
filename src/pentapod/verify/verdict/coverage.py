"""Coverage: the surface that a program must machine, and how much material it may leave there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.cutters.stand_off import StandOff
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import normalised
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.region import Region
from pentapod.numerics.threads import nearest_points
from pentapod.toolpath.lines.scallop import scallop_height
from pentapod.toolpath.linking.partition import Piece, cutting_intervals
from pentapod.toolpath.options import CoverOptions, PathOptions
from pentapod.toolpath.strategies.registry import rolls_over
from pentapod.toolpath.strategies.waterline import WaterlineOptions
from pentapod.toolpath.toolpath import Toolpath

MOST_FACETS = 1_000_000
"""Facets into which the region of a piece is refined at most."""

SAME_ANGLE = 1e-9
"""Cosine by which a facet's normal may be beyond the angle of a region, and still counts as within it."""

NOISE = 0.25
"""Radius of the circle within a steep facet, ball radii, from which it is no noise of the mesh. Where the ball rolls
only beside a narrower one, it leaves no more than about a thirtieth of its radius."""

RIDGE_FACTOR = 1.25
"""Default of how much higher than on a plane ridges may be, because the surface is curved."""


@dataclass(frozen=True, eq=False)
class Coverage(Value):
    """What a program must machine, and what it may leave there.

    region: the surface, workpiece frame; None where the program draws lines and covers no surface: see `why`.
    left: height of material, along the surface normal, up to which the surface is finished, metres; for a stand-off
    tool the largest distance of the surface from the line of its beam or spray. share: of the region's area, 0 to 1, on
    which more may be left. view (3,): towards the tool, any length. whole: makes the toolpath that covers all of the
    region, where a program may be a piece of it. leans: largest angle of the tool from the view, radians, up to which
    it is told what the program leaves although a tool that leans might reach it; 0 tells nothing. one_direction:
    whether the tool must keep the direction of its axis, so that it need not reach what it could only reach lying down.
    Raises ArrayError unless `left` is positive and `share` from 0 to 1.

    >>> coverage = Coverage.of(part, tool, RasterOptions(stepover=15e-3), path_tolerance=20e-6)
    """

    region: Patch | None
    left: float
    share: float = 0.0
    view: Floats | tuple[float, float, float] = (0.0, 0.0, 1.0)
    whole: Callable[[], Toolpath] | None = None
    why: str = ""
    leans: float = 0.0
    one_direction: bool = False

    def __post_init__(self) -> None:
        if not (np.isfinite(self.left) and self.left > 0.0):
            raise ArrayError("must be positive", key="left", value=self.left)
        if not 0.0 <= self.share <= 1.0:
            raise ArrayError("must be from 0 to 1", key="share", value=self.share)
        set_frozen(self, view=frozen(normalised(frozen(self.view, "view", (3,))), "view"))

    @classmethod
    def nothing(cls, why: str) -> Coverage:
        """Return the coverage of a program that covers no surface, and why."""
        return cls(None, np.finfo(float).max, why=why)

    @classmethod
    def of(
        cls,
        part: Mesh,
        tool: Tool,
        options: PathOptions,
        *,
        path_tolerance: float,
        left: float | None = None,
        share: float = 1e-3,
        whole: Callable[[], Toolpath] | None = None,
    ) -> Coverage:
        """Return what a strategy with these options must cover; nothing, where it draws lines, unless `left` is given.

        left: by default 1.25 times the ridge between passes on a plane, plus the tolerances of chords and path; for a
        beam or spray half the distance between the lines replaces the ridge.
        """
        if left is None and not isinstance(options, CoverOptions):
            return cls.nothing(f"{type(options).__name__.removesuffix('Options').lower()}: lines that cover no region")
        region = Patch.whole(part).in_box(options.region)
        if rolls_over(tool, options):
            region = _as_facets_lean(region, options.region, NOISE * tool.tilt_centre)
        region = region.where_normals(options.region.faces)
        if isinstance(options, WaterlineOptions):
            upright, flattest = np.asarray(options.upright), options.shallowest
            region = region.steeper(upright, flattest)
            # Here, too, a facet counts as it is.
            region = region.only(np.abs(region.facet_normals @ upright) < np.cos(flattest))
        if left is None:
            left = cls.allowed_left(options, tool, path_tolerance)
        return cls(region, left, share, options.up, whole)

    @staticmethod
    def allowed_left(options: PathOptions, tool: Tool, path_tolerance: float) -> float:
        """Return the default of `left` for a strategy with these options, metres."""
        return RIDGE_FACTOR * _ridge(options, tool) + options.chordal + path_tolerance

    @property
    def up(self) -> Floats:
        """The view direction (3,), unit, towards the tool."""
        return np.asarray(self.view)

    def of_piece(self, piece: Piece) -> Coverage:
        """Return what a piece of the whole toolpath must machine: where the nearest cut of the whole is its own.

        Raises ArrayError where the whole is not known.
        """
        if self.region is None or not len(self.region.faces):
            return self
        if self.whole is None:
            raise ArrayError("the whole toolpath is not known", key="whole", value=piece)
        whole = self.whole()
        mine, size = piece.cuts(whole), max(0.5 * self.left, float(np.sqrt(self.region.areas.sum() / MOST_FACETS)))
        cutting = np.flatnonzero(cutting_intervals(whole))
        start, end = whole.tilt_centres[cutting], whole.tilt_centres[cutting + 1]
        counts = np.ceil(np.linalg.norm(end - start, axis=1) / size).astype(np.intp) + 1
        owner = np.repeat(np.arange(len(cutting)), counts)
        number = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
        share = ((number + 0.5) / counts[owner])[:, None]
        fine = self.region.refined(size)
        middles = fine.vertices[fine.faces].mean(axis=1) + max(whole.tilt_centre, 0.0) * fine.facet_normals
        nearest = nearest_points(KDTree(start[owner] + share * (end - start)[owner]), middles)[1]
        own = mine[cutting[owner[np.asarray(nearest)]]]
        return replace(self, region=Patch(fine.vertices, fine.faces[own], fine.normals[own]))


def _as_facets_lean(patch: Patch, region: Region, narrow: float) -> Patch:
    """Return a patch without the facets that are steeper than a region.

    A ball rolls over a large flat facet as it is, however far smooth normals lean over it. Steep facets amid others
    are noise of the mesh: where the smooth normals of all corners are within the region, they stay. narrow: radius of
    the circle within a facet, metres, from which it is none.
    """
    own = region.faces(patch.facet_normals) >= -SAME_ANGLE
    corners = patch.vertices[patch.faces]
    around = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).sum(axis=1)
    amid = (region.faces(patch.normals) >= 0.0).all(axis=1) & (2.0 * patch.areas < narrow * around)
    return patch.only(own | amid)


def _ridge(options: PathOptions, tool: Tool) -> float:
    """Return the height of the ridge between passes on a plane; of a beam, half the distance between its lines."""
    scallop, stepover = getattr(options, "scallop", None), getattr(options, "stepover", None)
    if isinstance(tool, StandOff):
        return 0.5 * float(stepover or 0.0)
    return scallop_height(float(stepover or 0.0), tool) if scallop is None else float(scallop)
