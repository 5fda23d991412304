"""Limit violations of interpolated setpoints, at any phase of the controller's period against the path."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.jerk.rows import Over, Run
from pentapod.timing.pieces.boundary_speeds import whole_periods
from pentapod.timing.pieces.piece import PieceProfile
from pentapod.timing.pieces.setpoints import EDGE, GOAL, Setpoints, Use
from pentapod.timing.time_law.motion_law import MotionLaw

_PHASES = (0.0, 0.25, 0.5, 0.75)
"""Of the setpoints, in periods: what is slower at one place shifts all later ones against the path."""

_NEAR = 8
"""Rows near a rest that are measured where they are alone, not at other phases."""

_AT_ONCE = 1 << 16
"""Rows measured at once."""

_TOGETHER = 256
"""Rows between two stretches below which these are measured as one: each costs as much as so many rows."""

_WIDE = 1.5
"""Periods on either side of a setpoint in which the path's jerks say what the controller's jerk is there."""


def over_limits(profile: PieceProfile, machine: Machine, run: Run, between: Floats) -> Over:
    """Return where a law through these stations, x and x′ exceeds between stations (2, m), and by how much."""
    law = MotionLaw.through(*run)
    times, use = exceeding(profile, law, machine, law_times(law, between))
    order = np.argsort(times, kind="stable")
    times, use = times[order], use.at(order)
    reach = _WIDE * machine.controller.period * law(times, 1)
    return Over(law(times), reach, use.speed / GOAL, use.acceleration / GOAL, use.jerk / GOAL)


def law_times(law: MotionLaw, between: Floats) -> Floats:
    """Return the times (2, n) of a law at sorted stations (2, n)."""
    return np.interp(between, law.stations, law.times)


def exceeding(profile: PieceProfile, law: MotionLaw, machine: Machine, between: Floats | None) -> tuple[Floats, Use]:
    """Return times (n,) of a law at which setpoints exceed, and what they use; between (2, m): times looked at."""
    period = machine.controller.period
    whole = np.array([[0.0], [law.duration]])
    spans = whole if between is None else np.clip(between + np.array([[-EDGE], [EDGE]]) * period, 0.0, law.duration)
    found = [_between(profile, law, machine, *span) for span in _apart(spans.T, period)] if spans.size else []
    if not found:
        none = np.zeros(0)
        return none, Use(none, none, none, none)
    return np.concatenate([times for times, _ in found]), Use.joined([use for _, use in found])


def _between(profile: PieceProfile, law: MotionLaw, machine: Machine, begin: float, end: float) -> tuple[Floats, Use]:
    period, moves = machine.controller.period, (float(law.speeds[0]) > 0.0, float(law.speeds[-1]) > 0.0)
    # The motion begins and ends on a row: at other phases there is nothing to say about rows near rests.
    whole = law if any(moves) else law.stretched(whole_periods(law.duration, period))
    setpoints, ratio = Setpoints(profile, whole, True, period, 0, 0), law.duration / whole.duration
    last = int(np.ceil(whole.duration / period - 1e-9))
    low, high = max(int(begin / period) - EDGE, 0), min(int(np.ceil(end / period)) + EDGE, last)
    times: list[Floats] = []
    uses: list[Use] = []
    for phase in _PHASES:
        rows = setpoints.rows(low, high, phase)
        use = setpoints.use(rows, machine, 0, len(rows) - 1)
        at_ends = _NEAR if phase > 0.0 else 0
        use = use.without_edges(
            EDGE if low > 0 or moves[0] else at_ends,
            EDGE if high < last or moves[1] else at_ends,
        )
        bad = np.flatnonzero(use.slowing > 1.0)
        times.append(np.asarray(np.clip((low + bad + phase) * period * ratio, 0.0, law.duration), dtype=np.float64))
        uses.append(use.at(bad))
    return np.concatenate(times), Use.joined(uses)


def _apart(spans: Floats, period: float) -> list[tuple[float, float]]:
    """Return times from and to (n, 2) as stretches that do not overlap; none is too long, nor hardly any between."""
    spans = spans[np.argsort(spans[:, 0], kind="stable")]
    until = np.maximum.accumulate(spans[:, 1])
    apart = np.flatnonzero(spans[1:, 0] > until[:-1] + _TOGETHER * period) + 1
    begins, ends = spans[np.append(0, apart), 0], until[np.append(apart - 1, len(spans) - 1)]
    cuts = (
        np.linspace(begin, end, int(np.ceil((end - begin) / (_AT_ONCE * period))) + 1).tolist()
        for begin, end in zip(begins.tolist(), ends.tolist(), strict=True)
    )
    return [span for cut in cuts for span in pairwise(cut)]
