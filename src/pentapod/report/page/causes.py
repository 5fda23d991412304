"""Kinds of limits on the motion, how long each holds, and a sentence on the cycle time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.report.drawings.colours import KIND_COLOURS, OTHER_COLOUR
from pentapod.report.signals import Signals
from pentapod.report.words import duration
from pentapod.timing.explain import Explanation

KINDS = ("feed, rapid rate", "leg rate", "leg acceleration", "leg jerk", "tool tip", "tool axis")
"""Kinds of limits: the first is what the job asks for, the others are what machine and tool bear."""

OTHER = "other limits"

MOSTLY = 0.8
"""Share of the cycle time from which one kind of limit decides it."""


@dataclass(frozen=True)
class Kind:
    """A kind of limits. seconds: how long it is the active one; saved: seconds without it, at most; causes: by name."""

    name: str
    colour: str
    seconds: float
    saved: float
    causes: tuple[str, ...]


def kind_of(cause: str) -> int:
    """Return the kind of a limit on the motion by its name: an index into `KINDS`; their number for others."""
    if cause in ("feed", "rapid rate"):
        return 0
    words = cause.split()
    if words[0] == "leg" and len(words) == 3 and words[2] in ("velocity", "acceleration", "jerk"):
        return 1 + ("velocity", "acceleration", "jerk").index(words[2])
    if len(words) == 2 and words[1] in ("velocity", "acceleration", "jerk") and words[0] in ("tip", "axis"):
        return KINDS.index("tool tip" if words[0] == "tip" else "tool axis")
    return len(KINDS)


def kinds_of(signals: Signals, story: Explanation | None) -> list[Kind]:
    """Return all kinds in their order, those of other limits last."""
    if story is None:  # a run that was read back: by the rows
        period = float(signals.times[-1]) / max(len(signals.times) - 1, 1)
        counts = np.bincount(signals.causes[:-1], minlength=len(signals.cause_names))
        times = dict(zip(signals.cause_names, (period * counts).tolist(), strict=True))
    else:
        times = {cause.name: cause.time for cause in story.causes}
    saved = {} if story is None else {cause.name: cause.cost for cause in story.causes}
    found: list[Kind] = []
    for k, (name, colour) in enumerate(zip((*KINDS, OTHER), (*KIND_COLOURS, OTHER_COLOUR), strict=True)):
        names = tuple(cause for cause in times if kind_of(cause) == k)
        seconds = sum(times[cause] for cause in names)
        found.append(Kind(name, colour, seconds, sum(saved.get(cause, 0.0) for cause in names), names))
    return found


def sentence(kinds: list[Kind], total: float) -> str:
    """Return a sentence on what decides the cycle time: the kind with the most time first."""
    longest = max(kinds, key=lambda kind: kind.seconds)
    others = [kind for kind in kinds if kind is not longest and kind.seconds > 0.0]
    second = max(others, key=lambda kind: kind.seconds, default=None)
    who = "The feed and the rapid rate limit" if longest.name == KINDS[0] else f"The {longest.name} limits"
    told = f"{who} the motion for {duration(longest.seconds)} of {duration(total)}"
    if longest.seconds < MOSTLY * total and second is not None:
        return f"{told}, {second.name} for {duration(second.seconds)}."
    if longest.name == KINDS[0]:
        return f"{told}: a higher feed would shorten it, a faster machine hardly."
    return f"{told}: a higher feed would hardly shorten it."
