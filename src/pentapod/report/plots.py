"""The plots against time: one figure whose rows share the time axis."""

from __future__ import annotations

from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.report.drawings.colours import LIMIT_COLOUR, QUIET_COLOUR, leg_colour
from pentapod.report.figure import DETAIL, Figure, curve, leg_dash, rows_layout
from pentapod.report.signals import Signals

TITLES = ("leg lengths, mm", "leg rates, mm/s", "leg accelerations, mm/s²", "speed, mm/min", "margins, 0 at a limit")
SPEED_ROW, MARGIN_ROW = 4, len(TITLES)
MARGIN_COLOURS = ("#c2417c", "#2a78d6", "#e08a00", "#1baa7a", "#7a5cd6", "#5f7d8c")
AT_LIMIT = {"dash": "dash", "width": 1.1}


def time_figure(signals: Signals, machine: Machine) -> Figure:
    """Return the figure of lengths, rates, accelerations, speed and margins against time."""
    limits, traces = machine.legs, list[dict[str, Any]]()
    quantities = (
        (signals.legs, limits.min_length, limits.max_length, "mm"),
        (signals.rates, -limits.max_velocity, limits.max_velocity, "mm/s"),
        (signals.accelerations, -limits.max_acceleration, limits.max_acceleration, "mm/s²"),
    )
    for row, (values, low, high, unit) in enumerate(quantities, start=1):
        for leg in range(values.shape[1]):
            traces.append(
                _line(
                    signals.times, 1e3 * values[:, leg], row, f"leg {leg + 1}", leg_colour(leg),
                    {"dash": leg_dash(leg)}, f"leg {leg + 1}: %{{y:.5g}} {unit}",
                    legendgroup=f"leg{leg}", showlegend=row == 1,
                )
            )  # fmt: skip
        traces += _limits(signals.times, 1e3 * low, row, unit) + _limits(signals.times, 1e3 * high, row, unit)
    return {"data": [*traces, *_speed_lines(signals), *_margin_lines(signals)], "layout": _layout()}


def _line(
    times: Floats, values: Floats, row: int, name: str, colour: str, look: dict[str, Any], hover: str, **more: Any
) -> dict[str, Any]:
    line = {"color": colour, "width": 1.3, **look}
    return curve(
        times, values, row, DETAIL.time_buckets, line, name=name, hovertemplate=f"{hover}<extra></extra>", **more
    )


def _limits(times: Floats, values: Floats, row: int, unit: str) -> list[dict[str, Any]]:
    """Return dashed lines at a limit: one where all legs share it."""
    ends, shared = times[[0, -1]], bool(np.ptp(values) == 0.0)
    lines: list[dict[str, Any]] = []
    for leg in range(1 if shared else len(values)):
        name = "limit" if shared else f"limit of leg {leg + 1}"
        colour = LIMIT_COLOUR if shared else leg_colour(leg)
        hover = f"{name}: %{{y:.5g}} {unit}"
        lines.append(_line(ends, np.full(2, values[leg]), row, name, colour, AT_LIMIT, hover, showlegend=False))
    return lines


def _speed_lines(signals: Signals) -> list[dict[str, Any]]:
    wanted = _line(
        signals.times, 6e4 * signals.speed_limits, SPEED_ROW, "feed or rapid rate", LIMIT_COLOUR,
        AT_LIMIT | {"shape": "hv"}, "allowed: %{y:.5g} mm/min", showlegend=False,
    )  # fmt: skip
    speed = _line(
        signals.times, 6e4 * signals.speeds, SPEED_ROW, "speed", "#5f7d8c", {}, "speed: %{y:.5g} mm/min",
        showlegend=False,
    )  # fmt: skip
    return [wanted, speed]


def _margin_lines(signals: Signals) -> list[dict[str, Any]]:
    """Return the smallest margin, and the margins that come nearest to their limits, by name."""
    times = signals.times[signals.margin_rows]
    order = np.argsort(signals.margins.min(axis=0), kind="stable")[: DETAIL.margin_curves]
    lines = [
        _line(
            times, signals.smallest_margins, MARGIN_ROW, "smallest margin", QUIET_COLOUR, {"width": 4},
            "smallest: %{y:.3f}", legend="legend2",
        )
    ]  # fmt: skip
    for n, (colour, k) in enumerate(zip(MARGIN_COLOURS, order, strict=False), start=1):
        name, look = signals.margin_names[k], {"dash": leg_dash(n)}
        values, hover = signals.margins[:, k], f"{name}: %{{y:.3f}}"
        lines.append(_line(times, values, MARGIN_ROW, name, colour, look, hover, legend="legend2"))
    ends = times[[0, -1]]
    zero = _line(ends, np.zeros(2), MARGIN_ROW, "limit", LIMIT_COLOUR, AT_LIMIT, "limit", showlegend=False)
    return [*lines, zero]


def _layout() -> dict[str, Any]:
    layout = rows_layout(TITLES, 1180, 0.035, fixedrange=False)
    layout["xaxis"] |= {
        "domain": [0.0, 1.0], "showspikes": True, "spikemode": "across", "spikethickness": 1, "spikedash": "dot",
    }  # fmt: skip
    now = {"type": "line", "xref": "x", "yref": "paper", "x0": 0, "x1": 0, "y0": 0, "y1": 1}
    layout["shapes"] = [now | {"line": {"color": QUIET_COLOUR, "width": 1.5}}]
    layout["legend"]["itemsizing"] = "constant"
    layout["legend2"] = {"orientation": "h", "x": 0.0, "y": -0.06, "yanchor": "top"}
    layout[f"yaxis{SPEED_ROW}"]["rangemode"] = "tozero"
    return layout
