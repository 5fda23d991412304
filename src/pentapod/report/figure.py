"""Figures as plotly.js reads them: plain dictionaries, arrays packed as base64 of 32-bit floats."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats
from pentapod.report.decimate import keep_extremes

Figure = dict[str, Any]

LEG_DASHES = ("solid", "10px 3px", "2px 2px", "8px 2px 2px 2px", "16px 4px", "5px 5px")
"""Dashes of the legs, so that lines differ without colour, too."""

PLOT_CONFIG = {
    "responsive": True, "scrollZoom": False, "displaylogo": False, "showSendToCloud": False, "plotlyServerURL": "",
}  # fmt: skip
"""Of every figure. plotly.js has a button that uploads the figure to a public server: no button, and no server."""


@dataclass(frozen=True)
class Detail:
    """How many elements of each kind the report shows at most; they bound the size of the page.

    poses: of the slider. margin_rows: rows of the program with margins. time_buckets, simulation_buckets,
    path_buckets: of a curve against time, of a simulation, of the path; each keeps four points. margin_curves: margins
    plotted. facets, edges: of a mesh in 3D. band_columns: of the band of margins. limits: rows of the table of limits.
    """

    poses: int = 240
    margin_rows: int = 40_000
    time_buckets: int = 600
    simulation_buckets: int = 1000
    path_buckets: int = 2500
    margin_curves: int = 6
    facets: int = 60_000
    edges: int = 5000
    band_columns: int = 480
    limits: int = 10


DETAIL = Detail()


def leg_dash(leg: int) -> str:
    """Return the dashes of a leg, counted from 0."""
    return LEG_DASHES[leg % len(LEG_DASHES)]


def curve(times: Floats, values: Floats, row: int, buckets: int, line: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return a curve against time, thinned with its extremes kept. row: of the figure, from 1; line: its look."""
    keep = keep_extremes(values, buckets)
    data = {"x": packed(times[keep], "f8"), "y": packed(values[keep]), "yaxis": _axis("y", row)}
    return {"type": "scatter", "mode": "lines", **data, "line": line, **more}


def rows_layout(titles: Sequence[str], height: int, gap: float, **axis: Any) -> dict[str, Any]:
    """Return the layout of rows that share the time axis. height: pixels; gap: share of it; axis: of each y axis."""
    count = len(titles)
    share = (1.0 - gap * (count - 1)) / count
    layout: dict[str, Any] = {
        "height": height,
        "margin": {"l": 72, "r": 16, "t": 44, "b": 48},
        "hovermode": "x",
        "xaxis": {"title": {"text": "time, s"}, "anchor": f"y{count}", "zeroline": False},
        "legend": {"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom"},
    }
    for row, title in enumerate(titles, start=1):
        top = 1.0 - (row - 1) * (share + gap)
        own = {"title": {"text": title}, "domain": [max(top - share, 0.0), top], "anchor": "x", "zeroline": False}
        layout[_axis("yaxis", row)] = own | axis
    return layout


def packed(values: ArrayLike, dtype: str = "f4") -> dict[str, str]:
    """Return an array (N,) as plotly.js takes it; f4 for floats, i4 for indices. NaN stays NaN (a gap)."""
    array = np.ascontiguousarray(values, dtype=f"<{dtype}")
    return {"dtype": dtype, "bdata": base64.b64encode(array.tobytes()).decode("ascii")}


def as_script(content: Any) -> str:
    """Return JSON for a <script> element."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    return text.replace("<", "\\u003c")


def _axis(name: str, row: int) -> str:
    return name if row == 1 else f"{name}{row}"
