"""The setpoints of a piece's law, and how much of the limits a controller uses that joins them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.interpolant import Interpolant
from pentapod.machine.machine import Machine
from pentapod.timing.law.time_law import MotionLaw
from pentapod.timing.pieces.piece import PieceProfile
from pentapod.timing.pieces.spline_padding import spline_padding
from pentapod.timing.pieces.use import Use
from pentapod.timing.topp.stages import Failure

EDGE = 32
"""Rows beyond which the spline through all rows has forgotten a row: 0.27 of its say is left from each to the next."""


@dataclass(frozen=True, eq=False)
class Setpoints:
    """A piece with its law, which lasts whole periods, or why there is none.

    before, after: periods for which the machine stands at its ends; between two pieces they count with the first.
    smooth: whether jerks are limited.
    """

    profile: PieceProfile
    found: MotionLaw | Failure
    smooth: bool
    period: float
    before: int
    after: int

    @property
    def law(self) -> MotionLaw:
        """The law, where it was found."""
        return cast("MotionLaw", self.found)

    @property
    def count(self) -> int:
        """Intervals between its rows."""
        return self.before + round(self.law.duration / self.period) + self.after

    def rows(self, low: int, high: int, phase: float = 0.0) -> Floats:
        """Return the rows (n, 6 or 12) from `low` to `high`, both included, as if they came `phase` periods later.

        Legs and station, metres, and where they count tip and axis.
        """
        s = self.law((np.arange(low, high + 1) - self.before + phase) * self.period)
        if high == self.count and phase == 0.0:
            s[-1] = self.law.length
        return self.rows_at(s)

    def rows_at(self, s: Floats) -> Floats:
        """Return the rows (n, 6 or 12) at stations s (n,)."""
        piece = self.profile.piece
        tool = piece.pose(s) if self.profile.limits.tool.given() else ()
        return np.column_stack([piece(s, 0), s, *tool])

    def spline_padding(self, *, start: bool) -> Floats:
        """Return rows (n, 6 or 12) that come to the start, or leave the end, at the speed that is given there."""
        profile = self.profile
        speed = (profile.x_start if start else profile.x_end) ** 0.5
        return spline_padding(profile.piece, speed, self.period, start=start, tool=bool(profile.limits.tool.given()))

    def use(self, rows: Floats, machine: Machine, first: int, count: int) -> Use:
        """Return what the piece uses of the limits in `count` intervals from `first` on of rows (n, 6 or 12)."""
        interpolation, smooth = machine.controller.interpolation, float(self.smooth)
        motion = Interpolant.through(rows[:, :6], machine.controller.period, interpolation)
        here, legs, limits = slice(first, first + count), machine.legs, self.profile.limits
        hard = (motion.accelerations[first : first + count + 1, :5] / legs.max_acceleration).max(axis=1)
        rates = motion.rates[here]
        fast = (rates[:, :5] / legs.max_velocity).max(axis=1)
        # The limits themselves, less what rounding the rows adds.
        jolt = (motion.jerks[here, :5] / (limits.jerk / limits.jerk_fraction)).max(axis=1) * smooth
        # Against the feeds themselves: the plan's margin is there to be used up.
        speed = limits.tip_speed(self.profile.piece, rows[first : first + count + 1, 5])[0] / limits.feed_fraction
        fast = np.maximum(fast, rates[:, 5] / np.minimum(speed[:-1], speed[1:]))
        if limits.tool.given():
            tool = machine.tool_limits
            tip, axis = (Interpolant.through(rows[:, k : k + 3], motion.period, interpolation) for k in (6, 9))
            pushes = np.linalg.norm(tip.second, axis=1) / tool.max_tip_acceleration
            pushes = np.maximum(pushes, axis.turn_accelerations / tool.max_axis_acceleration)
            hard = np.maximum(hard, pushes[first : first + count + 1])
            # A bound, by the hull of the coefficients.
            fast = np.maximum(fast, np.linalg.norm(axis.steps, axis=1).max(axis=1)[here] / tool.max_axis_velocity)
            room = limits.tool.max_tip_jerk / limits.jerk_fraction
            jolt = np.maximum(jolt, tip.jerk_lengths[here] / room * smooth)
        reach = np.sqrt((rates[:, :5] / legs.max_jerk).max(axis=1))
        return Use(_at_rows(fast), hard, _at_rows(jolt), _at_rows(reach))


def _at_rows(shares: Floats) -> Floats:
    """Return for each row the larger share of the intervals that it ends."""
    return np.maximum(np.append(shares, 0.0), np.append(0.0, shares))
