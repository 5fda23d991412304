"""GougeOptions: remedies and tolerances of the gouge check. GougeReport: its results."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key, check_fields
from pentapod.base.values import Value
from pentapod.geometry.solids import KINDS
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.linking.ways_out import WayOutSearch

MOST_NAMED = 6
"""Largest number of waypoints that a message names."""


class Remedy(StrEnum):
    """What is done about a gouge: tilt the tool within a cone, lift it along its axis, drop the cut, or only report.

    >>> [remedy.value for remedy in Remedy]
    ['tilt', 'lift', 'drop', 'report']
    """

    TILT = "tilt"
    LIFT = "lift"
    DROP = "drop"
    REPORT = "report"


@dataclass(frozen=True)
class RemedySearch(Value):
    """How remedies are searched for.

    rings, spokes: directions tried within the cone, from the middle outwards. fade: share of a tilt that a neighbour
    gets at least. rounds, lifts: largest number of rounds of tilting and of lifting. rises: heights tried for the link
    over a dropped cut, as shares of `GougeOptions.highest`.
    """

    rings: int = 4
    spokes: int = 16
    fade: float = 0.75
    rounds: int = 3
    lifts: int = 40
    rises: tuple[float, ...] = (0.05, 0.1, 0.25, 0.5, 1.0)


@dataclass(frozen=True)
class GougeOptions(Value):
    """What is done about gouges. remedies: tried in this order on the motions that still gouge.

    links: style of new links where old ones collide with the part; None: they stay, and are reported. search, ways: see
    `RemedySearch`, `WayOutSearch`. Raises ToolpathError for values out of range.

    >>> remedies = GougeOptions(remedies=(Remedy.LIFT, Remedy.DROP))
    """

    remedies: tuple[Remedy, ...] = (Remedy.REPORT,)
    tolerance: Annotated[float, Key("mm", "depth up to which the tool does not count as gouging", gt=0.0)] = 50e-6
    cone: Annotated[float, Key("deg", "tilt: largest angle by which an axis may turn", gt=0.0, lt=90.0)] = float(
        np.radians(30.0)
    )
    highest: Annotated[float, Key("mm", "lift: largest rise of a waypoint", gt=0.0)] = 20e-3
    links: LinkStyle | None = field(default=None, compare=False)
    search: RemedySearch = RemedySearch()
    ways: WayOutSearch = field(default_factory=WayOutSearch)

    def __post_init__(self) -> None:
        check_fields(self, ToolpathError)


@dataclass(frozen=True)
class GougeReport(Value):
    """Result of the gouge check. motions: number of cutting motions between waypoints.

    gouging: how many of them gouged at first; depths: of the deepest gouge of cutter, shank and holder, metres, −inf
    for none. tilted, lifted: number of waypoints changed; most_lifted: metres. dropped: number of motions taken out of
    the cut; dropped_share: of the length of all cuts, along the part; dropped_centres (n, 2, 3): the tilt centre at
    both ends of each of them, workpiece frame, metres. left: number of motions that still gouge; left_depth: how deep,
    metres; places: first waypoint of each run of them. relinked: number of links replaced. stuck: number of motions of
    cuts that were left out, as the tool cannot leave them. unclear: number of links that gouge and rapids that touch;
    unclear_places: first waypoint of each run of them.
    """

    motions: int
    gouging: int
    depths: tuple[float, float, float]
    tilted: int = 0
    lifted: int = 0
    most_lifted: float = 0.0
    dropped: int = 0
    dropped_share: float = 0.0
    dropped_centres: Floats = field(default_factory=lambda: np.zeros((0, 2, 3)), repr=False)
    left: int = 0
    left_depth: float = 0.0
    places: tuple[int, ...] = ()
    relinked: int = 0
    stuck: int = 0
    unclear: int = 0
    unclear_places: tuple[int, ...] = ()

    def __str__(self) -> str:
        text = f"gouge check: {self.motions:,} motions"
        if not self.gouging:
            return text + ", no gouge" + self._unclear()
        deep = ", ".join(f"{k} {1e3 * d:.3g} mm" for k, d in zip(KINDS, self.depths, strict=True) if d > 0.0)
        text += f", {self.gouging:,} gouged: {deep} deep"
        if self.tilted:
            text += f"\n  note: {self.tilted:,} waypoints tilted clear"
        if self.lifted:
            text += f"\n  note: {self.lifted:,} waypoints lifted, by up to {1e3 * self.most_lifted:.3g} mm"
        if self.dropped:
            share = f"{100.0 * self.dropped_share:.3g} % of the length of the cuts"
            text += f"\n  note: {self.dropped:,} motions dropped, {share}: material is left there"
        if self.left:
            worst = 1e3 * self.left_depth
            text += f"\n  problem: {self.left:,} motions gouge by up to {worst:.3g} mm, from waypoints "
            text += _some(self.places)
        return text + self._unclear()

    def _unclear(self) -> str:
        text = f"\n  note: {self.relinked:,} links replaced by others that are clear" if self.relinked else ""
        if self.stuck:
            text += f"\n  note: {self.stuck:,} motions dropped: the tool cannot leave their cuts clear of the part"
        if not self.unclear:
            return text
        where = _some(self.unclear_places)
        return (
            text
            + f"\n  problem: {self.unclear:,} motions of links and rapids collide with the part, from waypoints {where}"
        )


def _some(places: tuple[int, ...]) -> str:
    return ", ".join(str(place) for place in places[:MOST_NAMED]) + (", ..." if len(places) > MOST_NAMED else "")
