"""The places where a program comes nearest to its limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.geometry.runs import marked_runs
from pentapod.machine.machine import Machine
from pentapod.numerics.blocks import blocks
from pentapod.report.signals import Signals
from pentapod.report.words import number
from pentapod.verify.replay.row_forces import ROWS_AT_ONCE

FULL_FEED = 0.98
"""Share of the programmed feed from which a cut counts as running at full feed."""


@dataclass(frozen=True)
class WorstPlace:
    """One line of the table. value: distance from the limit, as text; where: as text; row: of the program."""

    what: str
    value: str
    where: str
    row: int | None
    time: float | None


def worst_places(signals: Signals, machine: Machine) -> list[WorstPlace]:
    """Return where the program comes nearest to its limits."""
    limits = machine.legs
    least = int(signals.smallest_margins.argmin())
    name = signals.margin_names[int(signals.margins[least].argmin())]
    row = int(signals.margin_rows[least])
    places = [_place(signals, f"smallest margin: {name}", number(float(signals.smallest_margins[least])), row)]
    strokes: tuple[tuple[str, Callable[[Floats], Floats], str], ...] = (
        ("shortest", lambda legs: legs - limits.min_length, "mm above the shortest"),
        ("longest", lambda legs: limits.max_length - legs, "mm below the longest"),
    )
    for what, room, words in strokes:
        row, leg, least_room = _least(room, signals.legs)
        value = f"{1e3 * least_room:.2f} {words}"
        places.append(_place(signals, f"leg {leg + 1}, {what} against its stroke", value, row))
    motion = (
        ("rate", signals.rates, limits.max_velocity, "mm/s"),
        ("acceleration", signals.accelerations, limits.max_acceleration, "mm/s²"),
    )
    for what, values, limit, unit in motion:
        row, leg, share = _least(lambda values, limit=limit: -np.abs(values) / limit, values)
        value = f"{number(1e3 * abs(float(values[row, leg])), unit)}, {-share:.1%} of the limit"
        places.append(_place(signals, f"leg {leg + 1}, largest {what}", value, row))
    if signals.cutting.any():
        slow = signals.cutting & (signals.speeds < FULL_FEED * signals.speed_limits)
        share = float(slow.sum() / signals.cutting.sum())
        where, row = _longest(signals, slow)
        time = None if row is None else float(signals.times[row])
        value = f"{share:.1%} of the cutting time"
        places.append(WorstPlace("cutting below the programmed feed", value, where, row, time))
    return places


def _least(of: Callable[[Floats], Floats], values: Floats) -> tuple[int, int, float]:
    """Return row and column of the least number that is made of values (N, C), block by block, and that number."""
    found = 0, 0, np.inf
    for part in blocks(len(values), ROWS_AT_ONCE):
        made = of(values[part])
        row, column = np.unravel_index(int(made.argmin()), made.shape)
        if made[row, column] < found[2]:
            found = part.start + int(row), int(column), float(made[row, column])
    return found


def _place(signals: Signals, what: str, value: str, row: int) -> WorstPlace:
    return WorstPlace(what, value, _at(signals, row), row, float(signals.times[row]))


def _at(signals: Signals, row: int) -> str:
    x, y, z = 1e3 * signals.tips[row]
    return (
        f"{signals.times[row]:.3f} s, segment {signals.segments[row]}, tip at ({x:.1f}, {y:.1f}, {z:.1f}) mm".replace(
            "-", "−"
        )
    )


def _longest(signals: Signals, slow: Bools) -> tuple[str, int | None]:
    """Return the longest slow interval, as text and as the row in its middle."""
    if not slow.any():
        return "", None
    runs = marked_runs(slow)
    start, end = runs[np.diff(runs)[:, 0].argmax()].tolist()
    words = f"longest from {signals.times[start]:.3f} s to {signals.times[end - 1]:.3f} s"
    return words, (start + end) // 2
