"""Figures as plotly.js reads them: plain dictionaries, arrays packed as base64 of 32-bit floats."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

Figure = dict[str, Any]

LEG_COLOURS = ("#2a78d6", "#1baa7a", "#e08a00", "#c2417c", "#7a5cd6")
"""Colours of the legs, the same in every figure, legible on a light and on a dark background."""

LEG_DASHES = ("solid", "10px 3px", "2px 2px", "8px 2px 2px 2px", "16px 4px")
"""Dashes of the legs, so that lines differ without colour, too."""

LIMIT_COLOUR = "#d2413a"
QUIET_COLOUR = "#8a8f98"
HELD_COLOUR = "#a08a6a"

PLOT_CONFIG = {
    "responsive": True, "scrollZoom": False, "displaylogo": False, "showSendToCloud": False, "plotlyServerURL": "",
}  # fmt: skip
"""Of every figure. plotly.js has a button that uploads the figure to a public server: no button, and no server."""


def leg_colour(leg: int) -> str:
    """Return the colour of a leg, counted from 0; they repeat where there are more legs than colours."""
    return LEG_COLOURS[leg % len(LEG_COLOURS)]


def leg_dash(leg: int) -> str:
    """Return the dashes of a leg, counted from 0."""
    return LEG_DASHES[leg % len(LEG_DASHES)]


def packed(values: ArrayLike, dtype: str = "f4") -> dict[str, str]:
    """Return an array (N,) as plotly.js takes it; f4 for floats, i4 for indices. NaN stays NaN (a gap)."""
    array = np.ascontiguousarray(values, dtype=f"<{dtype}")
    return {"dtype": dtype, "bdata": base64.b64encode(array.tobytes()).decode("ascii")}


def as_script(content: Any) -> str:
    """Return JSON that may stand within a <script> element."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    return text.replace("<", "\\u003c")
