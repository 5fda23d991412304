"""What figures share: how much detail a page has, JSON for its script."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Detail:
    """How many elements of each kind the report shows at most; they bound the size of the page.

    margin_rows: rows of the program with margins. buckets: of a curve against time or of a simulation, of each of which
    the lowest and the highest value are kept. margin_curves: margins plotted. facets: of a mesh in 3D. part_bytes: of
    the part in the page, beyond which it is thinned, down to least_facets. edges: of a kind of faults of the mesh.
    still_points: of a path without motion, and of a group of waypoints. cause_changes: of the active limit, at which a
    key is set. band_columns: of the band of margins. limits: rows of the table of limits.
    """

    margin_rows: int = 40_000
    buckets: int = 5000
    margin_curves: int = 6
    facets: int = 300_000
    part_bytes: int = 900_000
    least_facets: int = 1200
    edges: int = 5000
    still_points: int = 20_000
    cause_changes: int = 10_000
    band_columns: int = 480
    limits: int = 10


DETAIL = Detail()


def as_script(content: Any) -> str:
    """Return JSON for a <script> element."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    return text.replace("<", "\\u003c")
