"""Set-up sheet for the operator: drawings of the placement, margins along the path, nearest limits."""

from __future__ import annotations

from html import escape

from pentapod.base.units import from_si
from pentapod.job.outcome import Outcome
from pentapod.planning.diagnosis import ActiveLimit, active_limits
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.report.drawings.planned_run import PlannedRun
from pentapod.report.drawings.touch_off import touch_off_points, touch_off_table
from pentapod.report.drawings.views import setup_drawings
from pentapod.report.figure import DETAIL
from pentapod.report.margin_band import margin_band
from pentapod.report.words import number


def setup_sheet(outcome: Outcome) -> tuple[str, str]:
    """Return drawings of the part in the machine and what stands below, as HTML; empty where it has no placement."""
    run = PlannedRun.of(outcome)
    if run is None:
        return "", ""
    points = touch_off_points(run)
    return setup_drawings(run, points), f"<p>{_standing(run)}</p>{touch_off_table(points)}"


def margins_along_path(outcome: Outcome) -> str:
    """Return the margins along the path and the nearest limits, as HTML; empty where no placement was found."""
    placed = outcome.find(PlacedPath)
    if placed is None:
        return ""
    rows = "".join(_row(limit) for limit in active_limits(placed)[: DETAIL.limits])
    return (
        f"<h3>Margins along the path</h3>{margin_band(placed.tips, placed.margins, placed.margin_names)}"
        '<p class="hint">Height: the smallest margin (0: a limit, about 1: comfortable). Colour: the nearest limit; '
        "point at it for its name.</p>"
        '<div class="scroll"><table><thead><tr><th>nearest limits</th><th class="n">smallest margin</th>'
        '<th class="n">room</th><th class="n">at waypoint</th><th class="n">nearest on</th></tr></thead>'
        f"<tbody>{rows}</tbody></table></div>"
    )


def _standing(run: PlannedRun) -> str:
    """Return where the table is, or where it would have to be."""
    if run.table is not None:
        return f"The part stands on the table, at z = {number(from_si(run.table, 'mm'), 'mm')}."
    return (
        f"The lowest point of the part is at z = {number(from_si(run.lowest, 'mm'), 'mm')}: a table must not be higher."
    )


def _row(limit: ActiveLimit) -> str:
    room = number(limit.room, limit.unit) if limit.unit else "–"
    return (
        f'<tr><td>{escape(limit.limit)}</td><td class="n">{number(limit.margin)}</td><td class="n">{room}</td>'
        f'<td class="n">{limit.worst}</td><td class="n">{100.0 * limit.share:.1f} %</td></tr>'
    )
