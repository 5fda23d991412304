"""Options of the search for advice, and how a plan in it ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from pentapod.base.values import Value

FEWEST = 4
"""Points below which a sketch shows nothing."""


class Tried(NamedTuple):
    """How a plan ended. stage: that refused it, None where its verdict passed. margin: its smallest, if it is known.

    failed: names of the claims that fail, of the other way in which it was planned where there is one. meets: heights
    as of `met_below`, where nothing but the tool or the spindle that touches the part stood against its placement.
    left: percent of the region that it leaves, where that is all that fails.
    """

    stage: str | None
    margin: float | None = None
    failed: frozenset[str] = frozenset()
    meets: tuple[float, ...] = ()
    left: float | None = None


@dataclass(frozen=True)
class AdviceOptions(Value):
    """How advice is searched for. Nothing depends on time, so that a job always gets the same advice.

    wanted: number of changes to find. plans: whole plans that are tried for them, at most; replans: where a program
    fails its verdict, as long as its plan, or the run went back for another way. points: that stand for the path in
    estimates. enough: estimated margin from which a change is planned; scarcely: from which one is planned before less
    of the task is. comfortable: estimated margin beyond which more counts for nothing. failures: plans of one placement
    that fail before it is the next one's turn. cones_deg: wider tilt cones. angles_deg: smaller angles of the region.
    setups: numbers of set-ups. lengths: of the tool, as shares of the machine's. first, halvings: first share of the
    extents, and steps of the bisection, for the largest box. cores: shares of the work volume, for boxes that show what
    fits where the whole is too wide. most: share of the area from which a region counts as all. elsewhere: how many
    times more of the area a box must hold elsewhere than about the part's middle; places: of the region that stand for
    its area. hopeless: estimated margin of the flattest part of a wide region, with a share `flattest` of its area,
    below which no toolpath of it is made. cuts: places of a toolpath of which smaller regions hold some. top_deg: angle
    of the region within which a place is flat, where only the top is tried; nearly_all: share of the places where the
    tool or the spindle touch the part that lie below the first height that is tried; rise: by how much a box begins
    higher, metres, so that its lowest pass has room. shallow: first depth of it, as a share of the region's. flat:
    height, as a share of the largest extent, below which a box keeps it. least: smallest extent of a box, and smallest
    scale, as shares of what is within reach. spare: share of the extent, or of the scale, that is found and taken; the
    estimate looks at few points. smaller: factor on the extent of a second, smaller box.
    doubtful: width of a part, as a multiple of the work volume's, beyond which its unit is doubted. strategies: that
    are tried where another makes no toolpath. worth_length: what another tool counts beside a region that keeps a share
    of the area. other_face_deg: turn of a part on a table from which it lies on another face. steep_deg: slope from
    which walls get waterlines. beside: distance between passes, in cutters, where more than one cutter is asked for.
    Where a program fails its verdict: nearer, thinner, slower: factors on the distance between passes, on the cutter's
    diameter (with that distance), and on the feed; surface_points: of the region, at which it is estimated what is
    left; near_share: steps along the toolpath, in radii of the ball; beside: distance between passes, in the cutter's
    diameters, where that asked for is larger than one; surely: share of what may be left that the estimate must keep
    to; deviations: standard deviations by which it may be wrong; little: share of the region that may stay as it is,
    where nothing else helps; hardly: that may before anything else is planned; long: waypoints from which other ways
    take minutes, so that `little` may before; largest: that may where nothing else was found; more: what is allowed
    then, as a multiple of what is left; about: up to this multiple of what another way leaves, the program as it is
    counts.
    """

    wanted: int = 1
    plans: int = 4
    replans: int = 2
    points: int = 96
    enough: float = 0.04
    scarcely: float = 0.0
    comfortable: float = 0.15
    failures: int = 2
    cones_deg: tuple[float, ...] = (20.0, 30.0, 45.0)
    steep_deg: float = 60.0
    angles_deg: tuple[float, ...] = (80.0, 70.0, 60.0, 50.0, 40.0, 30.0, 20.0, 10.0)
    setups: tuple[int, ...] = (2, 3, 4)
    lengths: tuple[float, ...] = (0.7, 1.3, 0.5, 1.6)
    first: float = 0.6
    halvings: int = 5
    cores: tuple[float, ...] = (0.6, 0.3)
    most: float = 0.999
    elsewhere: float = 1.5
    cuts: int = 4000
    places: int = 2000
    hopeless: float = -1.0
    flattest: float = 0.9
    top_deg: float = 40.0
    nearly_all: float = 0.99
    rise: float = 0.5e-3
    shallow: float = 0.2
    flat: float = 0.1
    least: float = 0.1
    spare: float = 0.97
    smaller: float = 0.75
    doubtful: float = 5.0
    strategies: tuple[str, ...] = ("raster", "offset")
    worth_length: float = 0.7
    other_face_deg: float = 10.0
    nearer: tuple[float, ...] = (0.7, 0.5, 0.3)
    thinner: float = 0.6
    slower: float = 0.6
    surface_points: int = 20_000
    near_share: float = 0.05
    beside: float = 0.5
    surely: float = 0.8
    deviations: float = 3.0
    hardly: float = 0.005
    little: float = 0.02
    largest: float = 0.1
    long: int = 10_000
    more: float = 1.2
    about: float = 2.0


OPTIONS = AdviceOptions()
