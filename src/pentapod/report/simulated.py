"""The pages on a simulation and on a recorded run: every measure against time, one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.report.drawings.colours import leg_colour
from pentapod.report.figure import DETAIL
from pentapod.report.pack import Packed
from pentapod.report.series import Curve, Row, bucket_places, extremes, packed_rows
from pentapod.report.template import write_page
from pentapod.simulate import Tracking
from pentapod.simulate.recorded.recorded_run import RecordedRun

RUNS = (("#296cb8", ()), ("#b64165", (6, 3)))
"""Colour and dash of each run."""


def write_simulation(
    path: str | Path, title: str, engine: str, lines: Sequence[str], runs: Sequence[tuple[str, Tracking]]
) -> Path:
    """Write the page and return its path. runs: by name, of the same program. Raises InputError."""
    packed = Packed()
    plots = simulation_plots(packed, runs)
    return write_page(
        path,
        "figures.html.j2",
        {"plots": plots},
        packed,
        title=title,
        about="simulation",
        kind=f"pentapod simulation, engine {engine}",
        summary="Measures",
        heading="Against time",
        lines=[line.strip() for line in lines],
        legs=[leg_colour(k) for k in range(runs[-1][1].played.legs.shape[1])],
    )


def write_recorded(path: str | Path, title: str, lines: Sequence[str], run: RecordedRun) -> Path:
    """Write the page on a recorded run and return its path. lines: its figures as text. Raises InputError."""
    packed, buckets = Packed(), DETAIL.buckets
    legs = [Curve(f"leg {k + 1}", leg_colour(k)) for k in range(run.legs.shape[1])]
    rows = [
        Row(f"{measure.name}, {measure.unit}", extremes(measure.values[:, None], buckets), [Curve("", RUNS[0][0])])
        for measure in run.measures
    ]
    rows.append(
        Row("pace, s of the program in a second", extremes(run.pace[:, None], buckets), [Curve("", RUNS[0][0])])
    )
    for name, values in (
        ("error of each leg, mm", 1e3 * run.legs),
        ("expected force of each drive, N", run.expected),
        ("measured force of each drive, N", run.measured),
    ):
        if values is not None:
            rows.append(Row(name, extremes(values, buckets), legs, grouped=True))
    return write_page(
        path,
        "figures.html.j2",
        {"plots": packed_rows(packed, bucket_places(run.times, buckets), rows, "time of the log, s", " s")},
        packed,
        title=title,
        about="recorded run",
        kind="pentapod monitor, a recorded run",
        summary="Figures",
        heading="Against time",
        lines=[line.strip() for line in lines],
        legs=[leg_colour(k) for k in range(run.legs.shape[1])],
    )


def simulation_plots(packed: Packed, runs: Sequence[tuple[str, Tracking]]) -> dict[str, Any]:
    """Return the plots: a row for each measure of all runs; then error and drive force of each leg of the last run."""
    first, last = runs[0][1], runs[-1][1]
    times = np.arange(len(first.played.legs), dtype=np.float64) * float(first.reference.program.period)
    rows = list[Row]()
    for k, measure in enumerate(first.measures):
        values = np.stack([tracking.measures[k].values for _, tracking in runs], axis=1)
        curves = [Curve(name, *RUNS[run % 2]) for run, (name, _) in enumerate(runs)]
        rows.append(Row(f"{measure.name}, {measure.unit}", extremes(values, DETAIL.buckets), curves))
    legs = [Curve(f"leg {k + 1}", leg_colour(k)) for k in range(last.played.legs.shape[1])]
    for title, values in (
        ("error of each leg, mm", 1e3 * (last.played.legs - last.reference.program.legs)),
        ("force of each drive, N", last.played.forces),
    ):
        rows.append(Row(title, extremes(values, DETAIL.buckets), legs, grouped=True))
    return packed_rows(packed, bucket_places(times, DETAIL.buckets), rows, "time, s", " s")
