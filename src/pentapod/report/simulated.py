"""The page on a simulation: every measure against time, one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.report.drawings.colours import leg_colour
from pentapod.report.figure import DETAIL, Figure, as_script, curve, leg_dash, rows_layout
from pentapod.report.template import write_page
from pentapod.simulate import Tracking

RUN_COLOURS = ("#2a78d6", "#c2417c")
RUN_DASHES = ("solid", "6px 3px")
ROW_PX = 210


def write_simulation(
    path: str | Path, title: str, engine: str, lines: Sequence[str], runs: Sequence[tuple[str, Tracking]]
) -> Path:
    """Write the page and return its path. runs: by name, of the same program. Raises InputError."""
    return write_page(
        path,
        "figures.html.j2",
        title=title,
        about="simulation",
        kind=f"pentapod simulation, engine {engine}",
        summary="Measures",
        heading="Against time",
        lines=[line.strip() for line in lines],
        figure=as_script(simulation_figure(runs)),
    )


def simulation_figure(runs: Sequence[tuple[str, Tracking]]) -> Figure:
    """Return the figure: a row for each measure of all runs; then error and drive force of each leg of the last run."""
    first, last = runs[0][1], runs[-1][1]
    times = np.arange(len(first.played.legs), dtype=np.float64) * float(first.reference.program.period)
    traces, titles, buckets = list[dict[str, Any]](), list[str](), DETAIL.simulation_buckets
    for k, measure in enumerate(first.measures):
        titles.append(f"{measure.name}, {measure.unit}")
        for run, (name, tracking) in enumerate(runs):
            line = {"color": RUN_COLOURS[run % 2], "dash": RUN_DASHES[run % 2], "width": 1.3}
            shown = {"name": name, "legendgroup": name, "showlegend": k == 0 and len(runs) > 1}
            traces.append(curve(times, tracking.measures[k].values, len(titles), buckets, line, **shown))
    for title, values in (
        ("error of each leg, mm", 1e3 * (last.played.legs - last.reference.program.legs)),
        ("force of each drive, N", last.played.forces),
    ):
        titles.append(title)
        for leg in range(values.shape[1]):
            line = {"color": leg_colour(leg), "dash": leg_dash(leg), "width": 1.2}
            name = f"leg {leg + 1}"
            shown = {"name": name, "legendgroup": name, "showlegend": values is last.played.forces}
            traces.append(curve(times, values[:, leg], len(titles), buckets, line, **shown))
    # With exponents: by default plotly.js writes 80µ of a millimetre.
    return {"data": traces, "layout": rows_layout(titles, ROW_PX * len(titles), 0.02, exponentformat="e")}
