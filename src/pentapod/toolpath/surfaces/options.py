"""Options of the surfaces on which a cutter rolls over a part. Shares are of the cutter's radius."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from pentapod.base.values import Value
from pentapod.toolpath.surfaces.places import PlaceOptions


@dataclass(frozen=True)
class OverhangOptions(Value):
    """When the surface above a point hides it.

    beside, sideways: distances around the point, shares, at both of which the surface must be above it; above: by which
    height, a share: walls, and valleys between steep flanks, do not hide themselves, nor do walls that lean under by
    less. under: the same as `sideways` for links, which may lead a little farther; upright: and for those between ends
    over which nothing leans. shade: height, a share, by which it must be above what is left out of a patch; beyond: how
    far a patch goes into the shade, at least.
    """

    beside: float = 0.01
    sideways: float = 0.2
    under: float = 0.3
    upright: float = 0.01
    above: float = 0.2
    shade: float = 0.5
    beyond: float = 1.0

    def leaning(self, share: float) -> OverhangOptions:
        """Return options by which the surface may lean over a point by a share of the radius."""
        sideways = max(share, self.upright)
        return replace(self, sideways=sideways, under=self.under / self.sideways * sideways)


@dataclass(frozen=True)
class ChannelOptions(Value):
    """Which channels are tight, and what is done then.

    play: of the ball, below which a channel is tight; fits: what the ball may lack, since meshes are rounded; parallel:
    angle between the walls, radians. samples: points of the part for the square of a radius that are looked at, at most
    `most`; share: of them, from which the part has such channels. above: height, a share, by which the part must be
    above a point to hide it. nearer: by how much nearer to the part the drive surface is made then; free: by how
    much nearer still the ball may come to the part on its way out along the view.
    """

    play: float = 0.047
    fits: float = 1e-3
    parallel: float = float(np.radians(5.0))
    samples: float = 4.0
    most: int = 40_000
    share: float = 5e-4
    above: float = 0.02
    nearer: float = 0.03
    free: float = 0.005


@dataclass(frozen=True)
class UnreachedOptions(Value):
    """How places of a region are found that the ball cannot touch.

    apart: distance between the points of the region that are looked at, a share; most: how many there are at most.
    nearer: a place beside the region counts if the ball is nearer to a point there by this share. fragment: a piece of
    the drive surface that is no wider than this share holds no pass.
    """

    apart: float = 0.1
    most: int = 200_000
    nearer: float = 0.03
    fragment: float = 0.5


@dataclass(frozen=True)
class DriveOptions(Value):
    """How the surface is made, and where it and a region of it end.

    step: of the grid, a share. parts: how many times finer it is in channels between its nodes; narrower ones may be
    closed. border: how exactly an open border is known, a share; enters: how far beyond it the ball gets where it is no
    hole. across: how far from an edge, a share, normals on both sides are compared: edges in a corner are not exactly
    in it. rolls: how far beyond it the ball goes about hollows, within `about_hollows`, that it cuts only so: points at
    a height `hollow` above the part tell. around: longest link around what is in the way, as a multiple of the straight
    way and twice the clearance. evened: how often the stepover for a scallop is averaged with that of neighbouring
    facets, whose curvature is noisy. about: how far beyond what the ball touches in a region's box the surface is made,
    as a multiple of the radius: links may lead there. region_ends: cosines by which a normal is off the limit of a
    region where that may end; crease: angle between exact and mean normals, radians, from which there are two;
    halvings: of an edge, to find where the region ends on it. wall: cosine to a region's direction below which a facet
    is one of a wall; foot: cosine by which the foot of one is within the region; leaning: cosine by which one may lean
    over a floor. steep: angle to the axis, radians, from which a face has a foot; rising: least rise of a facet over
    it, as a share of its height. overhangs: what hides a point. channels: in which it would be closed. unreached:
    places of a region. places: how they are moved onto the surface.
    """

    step: float = 0.25
    parts: int = 8
    border: float = 0.02
    across: float = 0.05
    enters: float = 0.5
    rolls: float = 0.3
    hollow: float = 0.05
    about_hollows: float = 2.0
    around: float = 3.0
    evened: int = 2
    about: float = 3.0
    region_ends: float = 0.5
    crease: float = 0.35
    halvings: int = 12
    wall: float = 0.1
    foot: float = 1e-3
    leaning: float = 0.05
    steep: float = 0.25 * np.pi
    rising: float = 0.5
    overhangs: OverhangOptions = field(default_factory=OverhangOptions)
    channels: ChannelOptions = field(default_factory=ChannelOptions)
    unreached: UnreachedOptions = field(default_factory=UnreachedOptions)
    places: PlaceOptions = field(default_factory=PlaceOptions)
