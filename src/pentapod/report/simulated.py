"""The page on a simulation: every measure against time, one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.files import atomic_write
from pentapod.report.decimate import keep_extremes
from pentapod.report.figure import PLOT_CONFIG, Figure, as_script, leg_colour, leg_dash, packed
from pentapod.simulate import Tracking

_BUCKETS = 1000
_RUN_COLOURS = ("#2a78d6", "#c2417c")
_RUN_DASHES = ("solid", "6px 3px")
_ROW_PX = 210


def write_simulation(
    path: str | Path, title: str, engine: str, lines: Sequence[str], runs: Sequence[tuple[str, Tracking]]
) -> Path:
    """Write the page and return its path. runs: by name, of the same program. Raises InputError."""
    import jinja2  # noqa: PLC0415 - heavy, and only needed here
    import plotly.offline  # noqa: PLC0415

    folder = resources.files("pentapod.report")
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string((folder / "simulated.html.j2").read_text(encoding="utf-8"))
    text = template.render(
        title=title,
        engine=engine,
        lines=[line.strip() for line in lines],
        style=(folder / "style.css").read_text(encoding="utf-8"),
        plotly=plotly.offline.get_plotlyjs(),
        plot_config=as_script(PLOT_CONFIG),
        figure=as_script(simulation_figure(runs)),
    )
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def simulation_figure(runs: Sequence[tuple[str, Tracking]]) -> Figure:
    """Return the figure: a row for each measure, with each run; then error and drive's force of each leg, last run."""
    first = runs[0][1]
    times = np.arange(len(first.played.legs), dtype=np.float64) * float(first.reference.program.period)
    traces, titles = list[dict[str, Any]](), list[str]()
    for k, measure in enumerate(first.measures):
        titles.append(f"{measure.name}, {measure.unit}")
        for run, (name, tracking) in enumerate(runs):
            line = {"color": _RUN_COLOURS[run % 2], "dash": _RUN_DASHES[run % 2], "width": 1.3}
            shown = {"name": name, "legendgroup": name, "showlegend": k == 0 and len(runs) > 1}
            traces.append(_line(times, tracking.measures[k].values, len(titles), line) | shown)
    last = runs[-1][1]
    wanted = last.reference.program.legs
    for title, values in (
        ("error of each leg, mm", 1e3 * (last.played.legs - wanted)),
        ("force of each drive, N", last.played.forces),
    ):
        titles.append(title)
        for leg in range(values.shape[1]):
            line = {"color": leg_colour(leg), "dash": leg_dash(leg), "width": 1.2}
            name = f"leg {leg + 1}"
            shown = {"name": name, "legendgroup": name, "showlegend": values is last.played.forces}
            traces.append(_line(times, values[:, leg], len(titles), line) | shown)
    return {"data": traces, "layout": _layout(titles)}


def _line(times: Floats, values: Floats, row: int, line: dict[str, Any]) -> dict[str, Any]:
    keep = keep_extremes(values, _BUCKETS)
    where = "y" if row == 1 else f"y{row}"
    shape = {"type": "scatter", "mode": "lines", "yaxis": where, "line": line}
    return {"x": packed(times[keep], "f8"), "y": packed(values[keep]), **shape}


def _layout(titles: Sequence[str]) -> dict[str, Any]:
    count, gap = len(titles), 0.02
    height = (1.0 - gap * (count - 1)) / count
    layout: dict[str, Any] = {
        "height": _ROW_PX * count,
        "margin": {"l": 72, "r": 16, "t": 44, "b": 48},
        "hovermode": "x",
        "xaxis": {"title": {"text": "time, s"}, "anchor": f"y{count}", "zeroline": False},
        "legend": {"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom"},
    }
    for row, title in enumerate(titles, start=1):
        top = 1.0 - (row - 1) * (height + gap)
        axis = {"title": {"text": title}, "domain": [max(top - height, 0.0), top], "anchor": "x", "zeroline": False}
        axis["exponentformat"] = "e"  # "80µ" of a millimetre is nothing that anybody says
        layout["yaxis" if row == 1 else f"yaxis{row}"] = axis
    return layout
