"""GougeOptions: remedies and tolerances of the gouge check. GougeReport: its results."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated

import numpy as np

from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key, check_fields
from pentapod.base.values import Value
from pentapod.geometry.solids import KINDS
from pentapod.toolpath.linking.links import LinkStyle

_NAMED = 6
"""Most waypoints that a message names."""


class Remedy(StrEnum):
    """What is done about a gouge: tilt the tool clear within a cone, lift it along its axis, drop the cut, nothing."""

    TILT = "tilt"
    LIFT = "lift"
    DROP = "drop"
    REPORT = "report"


@dataclass(frozen=True)
class RemedySearch(Value):
    """How remedies are searched for.

    rings, spokes: directions tried within the cone, from the middle outwards. fade: share of a tilt that a neighbour
    takes over. rounds: of tilting, and lifts: of lifting, at most. rises: heights tried for a link that stands for a
    dropped cut, as shares of the most that lifting may lift.
    """

    rings: int = 4
    spokes: int = 16
    fade: float = 0.75
    rounds: int = 3
    lifts: int = 40
    rises: tuple[float, ...] = (0.05, 0.1, 0.25, 0.5, 1.0)


@dataclass(frozen=True)
class GougeOptions(Value):
    """What is done about gouges. remedies: tried in this order on what still gouges.

    links: how ways between cuts are led anew where the old ones meet the part; None: they stay, and are told.
    search: see `RemedySearch`. Raises ToolpathError for values that make no sense.
    """

    remedies: tuple[Remedy, ...] = (Remedy.REPORT,)
    tolerance: Annotated[float, Key("mm", "depth that counts as none", gt=0.0)] = 50e-6
    cone: Annotated[float, Key("deg", "tilt: largest angle by which an axis may turn", gt=0.0, lt=90.0)] = float(
        np.radians(30.0)
    )
    highest: Annotated[float, Key("mm", "lift: largest rise of a waypoint", gt=0.0)] = 20e-3
    links: LinkStyle | None = field(default=None, compare=False)
    search: RemedySearch = RemedySearch()

    def __post_init__(self) -> None:
        check_fields(self, ToolpathError)


@dataclass(frozen=True)
class GougeReport(Value):
    """What the check found. motions: cuts' motions between waypoints that were checked.

    gouging: of them too deep at first; depths: the deepest of cutter, shank and holder at first, metres, −inf for none.
    tilted, lifted: waypoints changed; dropped: motions taken out of the cut; most_lifted: metres.
    left: motions still too deep, left_depth how deep, metres; places: the first waypoint of each run of those.
    relinked: ways between cuts led anew. unclear: links deeper than the tolerance and rapids that touch,
    unclear_places likewise.
    """

    motions: int
    gouging: int
    depths: tuple[float, float, float]
    tilted: int = 0
    lifted: int = 0
    most_lifted: float = 0.0
    dropped: int = 0
    left: int = 0
    left_depth: float = 0.0
    places: tuple[int, ...] = ()
    relinked: int = 0
    unclear: int = 0
    unclear_places: tuple[int, ...] = ()

    def __str__(self) -> str:
        text = f"gouge check: {self.motions:,} motions"
        if not self.gouging:
            return text + ", none gouges" + self._unclear()
        deep = ", ".join(f"{k} {1e3 * d:.3g} mm" for k, d in zip(KINDS, self.depths, strict=True) if d > 0.0)
        text += f", {self.gouging:,} gouged: {deep} deep"
        if self.tilted:
            text += f"\n  note: {self.tilted:,} waypoints tilted clear"
        if self.lifted:
            text += f"\n  note: {self.lifted:,} waypoints lifted, by up to {1e3 * self.most_lifted:.3g} mm"
        if self.dropped:
            text += f"\n  note: {self.dropped:,} motions dropped: material is left there"
        if self.left:
            worst = 1e3 * self.left_depth
            text += f"\n  problem: {self.left:,} motions gouge by up to {worst:.3g} mm, from waypoints "
            text += _some(self.places)
        return text + self._unclear()

    def _unclear(self) -> str:
        text = f"\n  note: {self.relinked:,} ways between cuts led over the clearance level" if self.relinked else ""
        if not self.unclear:
            return text
        where = _some(self.unclear_places)
        return text + f"\n  problem: {self.unclear:,} motions of links and rapids meet the part, from waypoints {where}"


def _some(places: tuple[int, ...]) -> str:
    return ", ".join(str(place) for place in places[:_NAMED]) + (", ..." if len(places) > _NAMED else "")
