"""Colours of drawings and figures, legible on a light and on a dark background."""

from __future__ import annotations

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


def leg_colour(leg: int) -> str:
    """Return the colour of a leg, counted from 0; they repeat where there are more legs than colours."""
    return LEG_COLOURS[leg % len(LEG_COLOURS)]
