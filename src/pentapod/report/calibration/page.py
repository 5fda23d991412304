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
from pentapod.report.pack import Packed
from pentapod.report.series import Curve, Row, packed_rows
from pentapod.report.template import write_page


def write_calibration_report(path: str | Path, found: Identified, machine: Machine, lines: Sequence[str]) -> Path:
    """Write the page and return its path. lines: what is said of the fit. Raises InputError."""
    packed = Packed()
    plots = residual_plots(packed, found)
    return write_page(
        path,
        "figures.html.j2",
        {"plots": plots},
        packed,
        title=machine.name,
        about="calibration",
        kind=f"pentapod calibration, {found.measured.instrument}",
        summary="What was found",
        lines=[*lines, "", *numbers_table(found, machine)],
        heading="Residuals",
        legs=[leg_colour(k) for k in range(found.calibration.residuals.shape[1])],
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


def residual_plots(packed: Packed, found: Identified) -> dict[str, Any]:
    """Return the plots: residuals of the legs, and errors of poses that the fit did not see, by line of the file."""
    residuals = from_si(found.calibration.residuals, "um")
    legs = [Curve(f"leg {k + 1}", leg_colour(k), style="points") for k in range(residuals.shape[1])]
    held_out = from_si(found.held_out, "um")[:, None]
    rows = [
        Row("residual of the legs, um", residuals, legs, grouped=True),
        Row("error of a pose held out, um", held_out, [Curve("held out", QUIET_COLOUR, style="bars")], low=0.0),
    ]
    return packed_rows(
        packed, np.asarray(found.measured.lines, dtype=np.float64), rows, "line of the measurements file"
    )
