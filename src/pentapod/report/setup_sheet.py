"""Set-up sheet for the operator: drawings of the placement, margins along the path, nearest limits."""

from __future__ import annotations

from html import escape

from pentapod.job.outcome import Outcome
from pentapod.mesh.mesh import Mesh
from pentapod.planning.diagnosis import ActiveLimit, active_limits
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.report.figure import DETAIL
from pentapod.report.held import held_mesh
from pentapod.report.margin_band import margin_band
from pentapod.report.placement_views import placement_views
from pentapod.report.words import number


def setup_sheet(outcome: Outcome) -> str:
    """Return the sheet as HTML, for the section on the placement; empty where no placement was found."""
    placed = outcome.find(PlacedPath)
    if placed is None:
        return ""
    table = outcome.job.placement
    height = table.table_z_mm if table.mode == "table" else None
    surface = None if height is None else 1e-3 * height
    on_table = "" if height is None else f"<p>The part stands on the table, at z = {number(height, 'mm')}.</p>"
    held = held_mesh(outcome, placed)
    views = placement_views(outcome.find(Mesh), placed, outcome.machine, surface, held)
    rows = "".join(_row(limit) for limit in active_limits(placed)[: DETAIL.limits])
    return (
        f'{on_table}<div class="views">{views}</div>'
        f"<h3>Margins along the path</h3>{margin_band(placed.tips, placed.margins, placed.margin_names)}"
        '<p class="hint">Height: the smallest margin (0: a limit, about 1: comfortable). Colour: the nearest limit; '
        "point at it for its name.</p>"
        '<div class="scroll"><table><thead><tr><th>nearest limits</th><th class="n">smallest margin</th>'
        '<th class="n">room</th><th class="n">at waypoint</th><th class="n">nearest on</th></tr></thead>'
        f"<tbody>{rows}</tbody></table></div>"
    )


def _row(limit: ActiveLimit) -> str:
    room = number(limit.room, limit.unit) if limit.unit else "–"
    return (
        f'<tr><td>{escape(limit.limit)}</td><td class="n">{number(limit.margin)}</td><td class="n">{room}</td>'
        f'<td class="n">{limit.worst}</td><td class="n">{100.0 * limit.share:.1f} %</td></tr>'
    )
