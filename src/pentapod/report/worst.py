"""The worst places by name."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.report.signals import Signals
from pentapod.report.words import number

FULL_FEED = 0.98
"""Share of the feed asked for from which a cut counts as running at full feed."""


@dataclass(frozen=True)
class WorstPlace:
    """One line of the table. what: the quantity; value: how near to its limit, in words; where: in words."""

    what: str
    value: str
    where: str


def worst_places(signals: Signals, machine: Machine) -> list[WorstPlace]:
    """Return where the program comes nearest to its limits."""
    limits = machine.legs
    least = int(signals.smallest_margins.argmin())
    name = signals.margin_names[int(signals.margins[least].argmin())]
    row = int(signals.margin_rows[least])
    places = [WorstPlace(f"smallest margin: {name}", number(float(signals.smallest_margins[least])), _at(signals, row))]
    rows = (
        ("shortest against its stroke", (signals.legs - limits.min_length), "mm above the shortest"),
        ("longest against its stroke", (limits.max_length - signals.legs), "mm below the longest"),
    )
    for what, room, words in rows:
        row, leg = _argmin(room)
        places.append(WorstPlace(f"leg {leg + 1}, {what}", f"{1e3 * room[row, leg]:.2f} {words}", _at(signals, row)))
    shares = (
        ("rate", np.abs(signals.rates) / limits.max_velocity, 1e3 * signals.rates, "mm/s"),
        ("acceleration", np.abs(signals.accelerations) / limits.max_acceleration, 1e3 * signals.accelerations, "mm/s²"),
    )
    for what, share, values, unit in shares:
        row, leg = _argmin(-share)
        value = f"{number(abs(float(values[row, leg])), unit)}, {share[row, leg]:.1%} of the limit"
        places.append(WorstPlace(f"leg {leg + 1}, largest {what}", value, _at(signals, row)))
    if signals.cutting.any():
        slow = signals.cutting & (signals.speeds < FULL_FEED * signals.speed_limits)
        share = float(slow.sum() / signals.cutting.sum())
        places.append(
            WorstPlace("cutting below the feed asked for", f"{share:.1%} of the cutting time", _longest(signals, slow))
        )
    return places


def _argmin(values: Floats) -> tuple[int, int]:
    row, leg = np.unravel_index(int(values.argmin()), values.shape)
    return int(row), int(leg)


def _at(signals: Signals, row: int) -> str:
    x, y, z = 1e3 * signals.tips[row]
    return (
        f"{signals.times[row]:.3f} s, segment {signals.segments[row]}, tip at ({x:.1f}, {y:.1f}, {z:.1f}) mm".replace(
            "-", "−"
        )
    )


def _longest(signals: Signals, slow: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> str:
    """Return where the longest slow run is."""
    if not slow.any():
        return ""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], slow, [False]]).astype(np.int8)))
    starts, ends = edges[::2], edges[1::2]
    k = int((ends - starts).argmax())
    return f"longest from {signals.times[starts[k]]:.3f} s to {signals.times[ends[k] - 1]:.3f} s"
