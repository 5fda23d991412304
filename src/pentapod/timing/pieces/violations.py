"""Limit violations of interpolated setpoints, at several phases of the controller's period against the path."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.jerk.rows import Excess
from pentapod.timing.pieces.boundary_speeds import whole_periods
from pentapod.timing.pieces.piece import PieceProfile
from pentapod.timing.pieces.setpoints import EDGE, GOAL, ROWS_AT_ONCE, LimitShares, Setpoints
from pentapod.timing.time_law.motion_law import MotionLaw, SpeedNodes


@dataclass(frozen=True)
class ViolationOptions:
    """Where setpoints are looked at."""

    phases: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75)  # of the setpoints, in periods: slowing shifts all later ones
    rest_rows: int = 8  # rows near a rest that count at phase 0 alone: the motion begins and ends on a row
    joined_rows: int = 256  # rows between two stretches that are measured as one; each costs as much as so many rows
    jerk_reach: float = 1.5  # periods on either side of a setpoint whose path determines the controller's jerk there


DEFAULTS = ViolationOptions()


def excess(profile: PieceProfile, machine: Machine, nodes: SpeedNodes, between: Floats) -> Excess:
    """Return where the law of some nodes exceeds limits between stations (2, m), and by how much."""
    law = nodes.law()
    times, shares = violations(profile, law, machine, law_times(law, between))
    order = np.argsort(times, kind="stable")
    times, shares = times[order], shares.at(order)
    reach = DEFAULTS.jerk_reach * machine.controller.period * law(times, 1)
    return Excess(law(times), reach, shares.speed / GOAL, shares.acceleration / GOAL, shares.jerk / GOAL)


def law_times(law: MotionLaw, between: Floats) -> Floats:
    """Return the times (2, n) of a law at sorted stations (2, n)."""
    return np.interp(between, law.stations, law.times)


def violations(
    profile: PieceProfile,
    law: MotionLaw,
    machine: Machine,
    between: Floats | None,
    options: ViolationOptions = DEFAULTS,
) -> tuple[Floats, LimitShares]:
    """Return times (n,) when setpoints of a law exceed limits, and their shares; between (2, m): where it is looked."""
    period = machine.controller.period
    whole = np.array([[0.0], [law.duration]])
    spans = whole if between is None else np.clip(between + np.array([[-EDGE], [EDGE]]) * period, 0.0, law.duration)
    stretches = _stretches(spans.T, period, options.joined_rows) if spans.size else []
    found = [_violations(profile, law, machine, *stretch, options) for stretch in stretches]
    if not found:
        none = np.zeros(0)
        return none, LimitShares(none, none, none, none)
    return np.concatenate([times for times, _ in found]), LimitShares.joined([shares for _, shares in found])


def _violations(
    profile: PieceProfile, law: MotionLaw, machine: Machine, begin: float, end: float, options: ViolationOptions
) -> tuple[Floats, LimitShares]:
    """Return the violations between two times of the law."""
    period, moves = machine.controller.period, (float(law.speeds[0]) > 0.0, float(law.speeds[-1]) > 0.0)
    whole = law if any(moves) else law.stretched(whole_periods(law.duration, period))
    setpoints, ratio = Setpoints(profile, whole, True, period, 0, 0), law.duration / whole.duration
    last = int(np.ceil(whole.duration / period - 1e-9))
    low, high = max(int(begin / period) - EDGE, 0), min(int(np.ceil(end / period)) + EDGE, last)
    times: list[Floats] = []
    found: list[LimitShares] = []
    for phase in options.phases:
        rows = setpoints.rows(low, high, phase)
        shares = setpoints.shares(rows, machine, 0, len(rows) - 1)
        at_rest = options.rest_rows if phase > 0.0 else 0
        shares = shares.without_edges(
            EDGE if low > 0 or moves[0] else at_rest,
            EDGE if high < last or moves[1] else at_rest,
        )
        bad = np.flatnonzero(shares.slowing > 1.0)
        times.append(np.asarray(np.clip((low + bad + phase) * period * ratio, 0.0, law.duration), dtype=np.float64))
        found.append(shares.at(bad))
    return np.concatenate(times), LimitShares.joined(found)


def _stretches(spans: Floats, period: float, joined_rows: int) -> list[tuple[float, float]]:
    """Return times from and to (n, 2) as stretches that do not overlap, none of more than ROWS_AT_ONCE rows."""
    spans = spans[np.argsort(spans[:, 0], kind="stable")]
    until = np.maximum.accumulate(spans[:, 1])
    apart = np.flatnonzero(spans[1:, 0] > until[:-1] + joined_rows * period) + 1
    begins, ends = spans[np.append(0, apart), 0], until[np.append(apart - 1, len(spans) - 1)]
    cuts = (
        np.linspace(begin, end, int(np.ceil((end - begin) / (ROWS_AT_ONCE * period))) + 1).tolist()
        for begin, end in zip(begins.tolist(), ends.tolist(), strict=True)
    )
    return [stretch for cut in cuts for stretch in pairwise(cut)]
