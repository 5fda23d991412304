"""Laws limited in jerk, slower about the places where their setpoints would exceed a limit, whatever their phase."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from pentapod.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.given_speeds import whole_periods
from pentapod.timing.law import MotionLaw
from pentapod.timing.local_stretch import Stretchable
from pentapod.timing.piece import PieceProfile
from pentapod.timing.setpoints import EDGE, Setpoints, Use

if TYPE_CHECKING:
    from pentapod.timing.jerk import SmoothProfile

_ROUNDS = 30
_PHASES = (0.0, 0.25, 0.5, 0.75)
"""Of the setpoints, in periods: what is slower at one place shifts all later ones against the path."""

_EXTRA = 0.002
"""Share by which a place is slower than it would have to be: the spline through setpoints rings where it is not."""

_REACHES = 4.0
"""A law is slower about a place over so many times the seconds in which a jerk at its limit would change velocities by
what they are: over fewer, slowing down would itself take jerks beyond the limit."""

_LEAST_WIDTH = 12
"""Periods on either side over which a law is slower about a place, at least."""

_NEAR = 8
"""Rows near a rest that are measured where they are alone, not at other phases."""

_AT_ONCE = 1 << 16
"""Rows measured at once."""


def mended(profile: PieceProfile, smooth: SmoothProfile, machine: Machine) -> Stretchable:
    """Return the law of a piece with setpoints that keep the limits at any phase; ends that move are left as they are.

    Places that exceed are run slower, round after round, and what was found before stays. Running the whole slower
    is taken where it costs less.
    """
    nodes, period = Stretchable(smooth.s, smooth.x, smooth.slope), machine.controller.period
    law = nodes.law()
    spans, uniform, first = _spans(np.array([[0.0, law.duration]]), period), 1.0, law
    for _ in range(_ROUNDS):
        found = [_exceeding(profile, law, machine, *span) for span in spans]
        at, slowing, reach = (np.concatenate([part[k] for part in found]) for k in range(3))
        if not len(at):
            break
        uniform = uniform if uniform > 1.0 else float(slowing.max())
        places = worst_places(at, slowing, reach, period)
        nodes, changed = about(nodes, law, profile, *places, period)
        law = nodes.law()
        ends = np.interp(changed, law.stations, law.times) + np.array([[-EDGE], [EDGE]]) * period
        spans = _spans(np.clip(ends.T, 0.0, law.duration), period)
    if not profile.moving and law.duration > first.duration * uniform * (1.0 + _EXTRA):
        slower = 1.0 / (uniform * (1.0 + _EXTRA)) ** 2
        return Stretchable(smooth.s, smooth.x * slower, smooth.slope * slower)
    return nodes


def worst_places(at: Floats, slowing: Floats, reach: Floats, period: float) -> tuple[Floats, Floats, Floats]:
    """Return times, depths and widths of places to run slower, from times (n,) of rows that exceed, and by what.

    Of rows near to each other the worst counts: what is left beside it is for the next round.
    """
    order = np.argsort(at, kind="stable")
    at, slowing = at[order], slowing[order]
    widths = np.maximum(_REACHES * reach[order], _LEAST_WIDTH * period)
    near = float(np.median(widths))
    cell = np.floor(at / near)
    first = np.concatenate([[0], np.flatnonzero(np.diff(cell)) + 1])
    most = np.maximum.reduceat(slowing, first)
    own = np.repeat(most, np.diff(np.append(first, len(at))))
    peak = np.flatnonzero(slowing == own)
    peak = peak[np.concatenate([[True], np.diff(cell[peak]) > 0.0])]
    # A cell beside one that is worse waits.
    beside = np.diff(cell[peak]) == 1.0
    level = slowing[peak]
    waits = np.append(False, beside & (level[1:] < level[:-1])) | np.append(beside & (level[:-1] <= level[1:]), False)
    peak = peak[~waits]
    return at[peak], 1.0 - 1.0 / (slowing[peak] * (1.0 + _EXTRA)), widths[peak]


def about(
    nodes: Stretchable, law: MotionLaw, profile: PieceProfile, at: Floats, depths: Floats, widths: Floats, period: float
) -> tuple[Stretchable, Floats]:
    """Return a law slower about times (n,), and the stations (2, n) between which it is another one.

    Ends that move keep their speeds.
    """
    for moves, room in ((profile.x_start > 0.0, at), (profile.x_end > 0.0, law.duration - at)):
        if moves:
            widths = np.minimum(widths, np.maximum(room, period))
    return nodes.slower(at, depths, widths), law(np.stack([at - widths, at + widths]))


def _exceeding(
    profile: PieceProfile, law: MotionLaw, machine: Machine, begin: float, end: float
) -> tuple[Floats, Floats, Floats]:
    """Return times (n,) between two of a law at which rows exceed, and the slowing and reach that `Use` says."""
    period = machine.controller.period
    # The motion begins and ends on a row: at other phases there is nothing to say about rows near rests.
    whole = law if profile.moving else law.stretched(whole_periods(law.duration, period))
    setpoints, ratio = Setpoints(profile, whole, True, period, 0, 0), law.duration / whole.duration
    last = int(np.ceil(whole.duration / period - 1e-9))
    low, high = max(int(begin / period) - EDGE, 0), min(int(np.ceil(end / period)) + EDGE, last)
    found: list[Floats] = []
    for phase in _PHASES:
        rows = setpoints.rows(low, high, phase)
        use: Use = setpoints.use(rows, machine, 0, len(rows) - 1)
        at_ends = _NEAR if phase > 0.0 else 0
        use = use.without_edges(
            EDGE if low > 0 or profile.x_start > 0.0 else at_ends,
            EDGE if high < last or profile.x_end > 0.0 else at_ends,
        )
        bad = np.flatnonzero(use.slowing > 1.0)
        times = np.clip((low + bad + phase) * period * ratio, 0.0, law.duration)
        found.append(np.asarray(np.stack([times, use.slowing[bad], use.reach[bad]]), dtype=np.float64))
    at, slowing, reach = np.concatenate(found, axis=1)
    return at, slowing, reach


def _spans(spans: Floats, period: float) -> list[tuple[float, float]]:
    """Return times from and to (n, 2), sorted by where they begin, as stretches that do not overlap, none too long."""
    until = np.maximum.accumulate(spans[:, 1])
    apart = np.flatnonzero(spans[1:, 0] > until[:-1]) + 1
    begins, ends = spans[np.append(0, apart), 0], until[np.append(apart - 1, len(spans) - 1)]
    cuts = (
        np.linspace(begin, end, int(np.ceil((end - begin) / (_AT_ONCE * period))) + 1).tolist()
        for begin, end in zip(begins.tolist(), ends.tolist(), strict=True)
    )
    return [span for cut in cuts for span in pairwise(cut)]
