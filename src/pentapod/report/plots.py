"""The plots against time: one figure whose rows share the time axis."""

from __future__ import annotations

from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.report.decimate import keep_extremes
from pentapod.report.figure import LIMIT_COLOUR, QUIET_COLOUR, Figure, leg_colour, leg_dash, packed
from pentapod.report.signals import Signals

_BUCKETS = 600
_SHOWN_MARGINS = 6
_TITLES = (
    "leg lengths, mm",
    "leg rates, mm/s",
    "leg accelerations, mm/s²",
    "speed, mm/min",
    "margins, 0 at a limit",
)
_MARGIN_ROW = len(_TITLES)
_MARGIN_COLOURS = ("#c2417c", "#2a78d6", "#e08a00", "#1baa7a", "#7a5cd6", "#5f7d8c")


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
            traces.append(_leg_line(signals.times, 1e3 * values[:, leg], leg, row, unit))
        traces += _limits(signals.times, 1e3 * low, row, unit) + _limits(signals.times, 1e3 * high, row, unit)
    traces += _speed_lines(signals)
    traces += _margin_lines(signals)
    return {"data": traces, "layout": _layout()}


def _line(times: Floats, values: Floats, row: int, name: str, colour: str, **more: Any) -> dict[str, Any]:
    keep = keep_extremes(values, _BUCKETS)
    return {
        "type": "scatter",
        "mode": "lines",
        "x": packed(times[keep], "f8"),
        "y": packed(values[keep]),
        "yaxis": "y" if row == 1 else f"y{row}",
        "name": name,
        "line": {"color": colour, "width": 1.3},
        **more,
    }


def _leg_line(times: Floats, values: Floats, leg: int, row: int, unit: str) -> dict[str, Any]:
    hover = f"leg {leg + 1}: %{{y:.5g}} {unit}<extra></extra>"
    line = _line(
        times, values, row, f"leg {leg + 1}", leg_colour(leg), legendgroup=f"leg{leg}", showlegend=row == 1,
        hovertemplate=hover,
    )  # fmt: skip
    line["line"] = line["line"] | {"dash": leg_dash(leg)}
    return line


def _limits(times: Floats, values: Floats, row: int, unit: str) -> list[dict[str, Any]]:
    """Return dashed lines at a limit: one where all legs share it."""
    ends, shared = times[[0, -1]], bool(np.ptp(values) == 0.0)
    lines: list[dict[str, Any]] = []
    for leg in range(1 if shared else len(values)):
        whose = "limit" if shared else f"limit of leg {leg + 1}"
        line = _line(ends, np.full(2, values[leg]), row, whose, LIMIT_COLOUR if shared else leg_colour(leg))
        line |= {"showlegend": False, "hovertemplate": f"{whose}: %{{y:.5g}} {unit}<extra></extra>"}
        line["line"] = line["line"] | {"dash": "dash", "width": 1.1}
        lines.append(line)
    return lines


def _speed_lines(signals: Signals) -> list[dict[str, Any]]:
    wanted = _line(
        signals.times, 6e4 * signals.speed_limits, 4, "feed asked for, rapid rate", LIMIT_COLOUR, showlegend=False,
        hovertemplate="allowed: %{y:.5g} mm/min<extra></extra>",
    )  # fmt: skip
    wanted["line"] = wanted["line"] | {"dash": "dash", "width": 1.1, "shape": "hv"}
    speed = _line(
        signals.times, 6e4 * signals.speeds, 4, "speed", "#5f7d8c", showlegend=False,
        hovertemplate="moves: %{y:.5g} mm/min<extra></extra>",
    )  # fmt: skip
    return [wanted, speed]


def _margin_lines(signals: Signals) -> list[dict[str, Any]]:
    """Return the smallest margin, and those that come nearest to their limits, by name."""
    times = signals.times[signals.margin_rows]
    order = np.argsort(signals.margins.min(axis=0), kind="stable")[:_SHOWN_MARGINS]
    smallest = _line(
        times, signals.smallest_margins, _MARGIN_ROW, "smallest margin", QUIET_COLOUR, legend="legend2",
        hovertemplate="smallest: %{y:.3f}<extra></extra>",
    )  # fmt: skip
    smallest["line"] = {"color": QUIET_COLOUR, "width": 4}
    lines = [smallest]
    for colour, k in zip(_MARGIN_COLOURS, order, strict=False):
        name = signals.margin_names[k]
        hover = f"{name}: %{{y:.3f}}<extra></extra>"
        line = _line(times, signals.margins[:, k], _MARGIN_ROW, name, colour, legend="legend2", hovertemplate=hover)
        line["line"] = line["line"] | {"dash": leg_dash(len(lines))}
        lines.append(line)
    zero = _line(times[[0, -1]], np.zeros(2), _MARGIN_ROW, "limit", LIMIT_COLOUR, showlegend=False, hoverinfo="skip")
    zero["line"] = zero["line"] | {"dash": "dash", "width": 1.1}
    return [*lines, zero]


def _layout() -> dict[str, Any]:
    count, gap = len(_TITLES), 0.035
    height = (1.0 - gap * (count - 1)) / count
    layout: dict[str, Any] = {
        "height": 1180,
        "margin": {"l": 72, "r": 16, "t": 44, "b": 48},
        "hovermode": "x",
        "xaxis": {"title": {"text": "time, s"}, "anchor": f"y{count}", "domain": [0.0, 1.0], "showspikes": True,
                  "spikemode": "across", "spikethickness": 1, "spikedash": "dot", "zeroline": False},
        "shapes": [{"type": "line", "xref": "x", "yref": "paper", "x0": 0, "x1": 0, "y0": 0, "y1": 1,
                    "line": {"color": QUIET_COLOUR, "width": 1.5}}],
        "legend": {"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom", "itemsizing": "constant"},
        "legend2": {"orientation": "h", "x": 0.0, "y": -0.06, "yanchor": "top"},
    }  # fmt: skip
    for row, title in enumerate(_TITLES, start=1):
        top = 1.0 - (row - 1) * (height + gap)
        axis: dict[str, Any] = {"title": {"text": title}, "domain": [max(top - height, 0.0), top], "anchor": "x"}
        layout["yaxis" if row == 1 else f"yaxis{row}"] = axis | {"zeroline": False, "fixedrange": False}
    layout["yaxis4"]["rangemode"] = "tozero"
    return layout
