"""Colours of drawings and figures, legible on a light and on a dark background."""

from __future__ import annotations

LEG_COLOURS = ("#2a78d6", "#1baa7a", "#e08a00", "#c2417c", "#7a5cd6", "#3b9ab2")
"""Colours of the legs, the same in every figure."""

LIMIT_COLOUR = "#d2413a"
QUIET_COLOUR = "#8a8f98"
HELD_COLOUR = "#a08a6a"


def leg_colour(leg: int) -> str:
    """Return the colour of a leg, counted from 0; they repeat where there are more legs than colours."""
    return LEG_COLOURS[leg % len(LEG_COLOURS)]
