"""Table of the nearest limits of a plan, or of the exceeded limits of a refusal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pentapod.base.refusal import Refusal
    from pentapod.planning.diagnosis import ActiveLimit

MOST_RANGES = 6
"""Ranges of waypoints that a row shows."""
MOST_LIMITS = 12
"""Limits of a plan that are shown, besides those that are the nearest one somewhere."""


def limits_text(found: Sequence[ActiveLimit]) -> str:
    """Return the table of a plan: the nearest limits with their smallest margins, the nearest first."""
    titles = f"{'what must not happen':<46} {'margin':>8} {'room':>12} {'waypoint':>9} {'of path':>10}"
    lines = [f"{titles}  waypoints where it is nearest"]
    shown = [limit for k, limit in enumerate(found) if k < MOST_LIMITS or limit.share]
    for limit in shown:
        room = f"{limit.room:.3g} {limit.unit}" if limit.unit else ""
        share = f"{100.0 * limit.share:.1f} %" if limit.share else "–"
        where = _ranges(limit.waypoints)
        lines.append(
            f"{limit.limit:<46} {limit.margin:>8.4f} {room:>12} {limit.worst:>9} {share:>10}  {where}".rstrip()
        )
    rest = len(found) - len(shown)
    return "\n".join([*lines, *([f"{rest} more limits have larger margins"] if rest else [])])


def shortfalls_text(refusal: Refusal) -> str:
    """Return the table of a refusal: every limit that is exceeded, the worst first."""
    lines = [f"{'limit exceeded':<46} {'by':>14}  waypoints"]
    for shortfall in refusal.diagnosis:
        amount = f"{shortfall.shortfall:.3g} {shortfall.unit}" if shortfall.shortfall else "–"
        lines.append(f"{shortfall.constraint:<46} {amount:>14}  {_ranges(shortfall.waypoints)}".rstrip())
    return "\n".join([*lines, *([refusal.remedy] if refusal.remedy else [])])


def _ranges(waypoints: Sequence[tuple[int, int]]) -> str:
    """Return the longest ranges as text, in the order of the path."""
    longest = sorted(sorted(waypoints, key=lambda pair: pair[0] - pair[1])[:MOST_RANGES])
    text = ", ".join(f"{a}-{b}" if b > a else f"{a}" for a, b in longest)
    more = len(waypoints) - len(longest)
    return text + (f" and {more} shorter" if more > 0 else "")
