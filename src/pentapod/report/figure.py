"""What figures share: colours, how much detail a page has, JSON for its script."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

LEG_COLOURS = ("#296cb8", "#c88600", "#2aa58f", "#b64165", "#8c8dd3", "#7b6938")
"""Colours of the legs, the same in every figure.

Their contrast is at least 3 to 1 on a white and on a dark page, and they are at least 15 apart (CIELAB), also for
protanopes, deuteranopes and tritanopes.
"""

KIND_COLOURS = ("#7995c1", "#0d71b1", "#ce8300", "#bf4c00", "#b86b91", "#069d6e")
"""Colours of the kinds of limits on the motion, as far apart as those of the legs."""

OTHER_COLOUR = "#8a8f98"
"""Colour of what belongs to no kind."""

RAMP = ((0.0, "#5c0019"), (0.25, "#b5371c"), (0.55, "#e39a2d"), (1.0, "#8dd6be"))
"""Colours from the worst to the best. The worst is the darkest, so that the order can be read without colour."""

LIMIT_COLOUR = "#d2413a"
QUIET_COLOUR = "#8a8f98"
HELD_COLOUR = "#a08a6a"
PART_COLOUR = "#b9b4aa"


@dataclass(frozen=True)
class Detail:
    """How many elements of each kind the report shows at most; they bound the size of the page.

    margin_rows: rows of the program with margins. buckets: of a curve against time or of a simulation, of each of which
    the lowest and the highest value are kept. margin_curves: margins plotted. facets: of a mesh in 3D; part_bytes: of
    the part in the page, beyond which it is thinned. edges: of a kind of faults of the mesh. still_points: of a path
    without motion, and of a group of waypoints. cause_changes: of the active limit, at which a key is set. view_facets,
    view_points: of mesh and path in the drawings of the set-up sheet. band_columns: of the band of margins. limits:
    rows of the table of limits.
    """

    margin_rows: int = 40_000
    buckets: int = 5000
    margin_curves: int = 6
    facets: int = 300_000
    part_bytes: int = 900_000
    edges: int = 5000
    still_points: int = 20_000
    cause_changes: int = 10_000
    view_facets: int = 1200
    view_points: int = 1500
    band_columns: int = 480
    limits: int = 10


DETAIL = Detail()


def leg_colour(leg: int) -> str:
    """Return the colour of a leg, counted from 0; they repeat where there are more legs than colours."""
    return LEG_COLOURS[leg % len(LEG_COLOURS)]


def as_script(content: Any) -> str:
    """Return JSON for a <script> element."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    return text.replace("<", "\\u003c")
