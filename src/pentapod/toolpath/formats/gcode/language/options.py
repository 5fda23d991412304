"""Options of the reader of G-code."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class GCodeOptions:
    """Lengths in millimetres.

    axis_tolerance: radians by which the tool axis between two waypoints may differ from what the rotary axes do.
    part_turn: degrees; the way between two waypoints is looked at in parts over which no rotary axis turns further.
    clearance: height above the cuts at which a rapid that the file sends to the home position passes over the part.
    peck: distance from the last depth at which a drilling cycle with pecks goes back to the feed. arc_mismatch,
    arc_mismatch_share: difference, and share of the radius, by which start and end of an arc may be at different
    distances from its centre (the radius changes evenly then). rollover: degrees; to an angle within a turn that is
    farther off, a rotary axis turns the short way. farthest: largest coordinate. chords: most of one move.
    waypoints: most of a file. problems: most of a file that are listed, each with all its lines.
    """

    axis_tolerance: float = math.radians(0.02)
    part_turn: float = 90.0
    clearance: float = 10.0
    peck: float = 0.5
    arc_mismatch: float = 0.05
    arc_mismatch_share: float = 1e-3
    rollover: float = 300.0
    farthest: float = 1e6
    chords: int = 20_000
    waypoints: int = 5_000_000
    problems: int = 50


OPTIONS = GCodeOptions()
