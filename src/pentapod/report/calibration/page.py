"""The page on a calibration: what was found, and the residuals pose by pose, one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.units import from_si
from pentapod.machine.calibration.parameters import KINDS, PARAMETERS
from pentapod.machine.identification.identification import Identified, believed
from pentapod.machine.identification.sensitivity import numbers_of
from pentapod.machine.machine import Machine
from pentapod.report.drawings.colours import QUIET_COLOUR, leg_colour
from pentapod.report.figure import Figure, as_script, packed, rows_layout
from pentapod.report.template import write_page

ROW_PX = 260


def write_calibration_report(path: str | Path, found: Identified, machine: Machine, lines: Sequence[str]) -> Path:
    """Write the page and return its path. lines: what is said of the fit. Raises InputError."""
    return write_page(
        path,
        "figures.html.j2",
        title=machine.name,
        about="calibration",
        kind=f"pentapod calibration, {found.measured.instrument}",
        summary="What was found",
        lines=[*lines, "", *numbers_table(found, machine)],
        heading="Residuals",
        figure=as_script(residual_figure(found)),
    )


def numbers_table(found: Identified, machine: Machine) -> list[str]:
    """Return the thirty numbers as lines of text: as in the machine's file, as found, and their standard deviations."""
    before, built = (from_si(numbers_of(m), "mm") for m in (believed(machine), found.calibration.machine))
    sigmas = from_si(np.sqrt(np.diagonal(found.calibration.covariance)), "mm")
    lines = [f"{'':<14} {'file, mm':>14} {'found, mm':>14} {'change, mm':>12} {'sigma, mm':>11}"]
    for k, name in enumerate(PARAMETERS):
        sigma = "held" if name in found.calibration.held else f"{sigmas[k]:.4f}"
        lines.append(f"{name:<14} {before[k]:14.4f} {built[k]:14.4f} {built[k] - before[k]:+12.4f} {sigma:>11}")
        if (k + 1) % len(KINDS) == 0 and name != PARAMETERS[-1]:
            lines.append("")
    return lines


def residual_figure(found: Identified) -> Figure:
    """Return the figure: residuals of the legs, and errors of poses that the fit did not see, by line of the file."""
    lines = np.asarray(found.measured.lines, dtype=np.float64)
    residuals = from_si(found.calibration.residuals, "um")
    traces = list[dict[str, Any]]()
    for leg in range(residuals.shape[1]):
        look = {"color": leg_colour(leg), "size": 7}
        data = {"x": packed(lines, "f8"), "y": packed(residuals[:, leg]), "yaxis": "y"}
        traces.append({"type": "scatter", "mode": "markers", "name": f"leg {leg + 1}", "marker": look, **data})
    errors = {"x": packed(lines, "f8"), "y": packed(from_si(found.held_out, "um")), "yaxis": "y2"}
    look = {"color": QUIET_COLOUR}
    traces.append({"type": "bar", "name": "held out", "marker": look, "showlegend": False, **errors})
    titles = ["residual of the legs, um", "error of a pose held out, um"]
    layout = rows_layout(titles, ROW_PX * len(titles), 0.08)
    layout["xaxis"] = {**layout["xaxis"], "title": {"text": "line of the measurements file"}}
    return {"data": traces, "layout": {**layout, "hovermode": "closest"}}
