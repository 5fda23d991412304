"""IntervalBounds: one walk along the program, block by block, for all that needs the controller's polynomials.

The polynomials of a long program would fill the memory; a block of them fits the processor's cache. What stays is the
worst value of each leg and its place, and for each sample and each chord between samples a few numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.interpolant import Interpolant, clamped_slopes
from pentapod.kinematics.proof_results import BranchProof, Chords
from pentapod.machine.machine import Machine
from pentapod.numerics.bernstein import split
from pentapod.program.program import Program

_BLOCK = 4096  # intervals


class RunningMaximum:
    """The largest of a measure over the program, for each column: values (d,), and the places (d,) where they are."""

    def __init__(self, columns: int) -> None:
        self.values: Floats = np.full(columns, -np.inf)
        self.at: Ints = np.zeros(columns, dtype=np.intp)

    def see(self, measured: Floats, first: int) -> None:
        """Take in what was measured (n, d) at the places first, first + 1, …; of equals the earliest counts."""
        best = np.argmax(measured, axis=0)
        values = measured[best, np.arange(measured.shape[1])]
        better = values > self.values
        self.values, self.at = np.where(better, values, self.values), np.where(better, first + best, self.at)


@dataclass(eq=False)
class ComponentFindings:
    """What is proven of the component, over all intervals.

    lower: the least values that are proven of the robot's `proven_measures`, as −`RunningMaximum`. refuted, undecided:
    how many intervals; their first ones, and the doubtful part of those in [0, 1].
    """

    lower: RunningMaximum
    refuted: int = 0
    undecided: int = 0
    first_refuted: tuple[int, float, float] | None = None
    first_undecided: tuple[int, float, float] | None = None

    def see(self, proof: BranchProof, first: int) -> None:
        """Take in the proof of the intervals from `first` on."""
        self.lower.see(-proof.lower, first)
        self.refuted += int(proof.refuted.sum())
        self.undecided += int(proof.undecided.sum())
        self.first_refuted = self.first_refuted or _first(proof, proof.refuted, first)
        self.first_undecided = self.first_undecided or _first(proof, proof.undecided, first)


def _first(proof: BranchProof, which: Bools, first: int) -> tuple[int, float, float] | None:
    if not which.any():
        return None
    k = int(np.argmax(which))
    start, stop = proof.doubt[k]
    return first + k, float(start), float(stop)


@dataclass(eq=False)
class IntervalBounds:
    """What the walk found.

    shortest: −`RunningMaximum` of the legs' least lengths on each interval; longest, rates, jerks: `RunningMaximum` on
    each interval; accelerations: at each row. Metres and seconds; exact on the controller's polynomials.
    component: see there. position, direction (M, 3): the poses at the samples, NaN where there are none.
    away (M − 1,) metres, turned (M − 1,) radians, speeds (M − 1, 3) m/s: proven of each chord between samples: how far
    the tilt centre strays from it, how far the axis turns off it, how fast are the tip, the tilt centre and the faster
    end of the platform's line with the tool. Infinite where not proven.
    base_widest, platform_closed, platform_open: proven of each chord: −cos of the largest angle at the base joint, cos
    of the least and −cos of the largest one at the platform joint.
    """

    shortest: RunningMaximum
    longest: RunningMaximum
    rates: RunningMaximum
    accelerations: RunningMaximum
    jerks: RunningMaximum
    component: ComponentFindings
    position: Floats
    direction: Floats
    away: Floats
    turned: Floats
    speeds: Floats
    base_widest: RunningMaximum
    platform_closed: RunningMaximum
    platform_open: RunningMaximum

    @property
    def unproven(self) -> Ints:
        """The chords of whose motion nothing is proven."""
        return np.flatnonzero(~np.isfinite(self.away))


def interval_bounds(
    program: Program, machine: Machine, tilt_centre: float, leg_error: float, progress: Callable[[float], None]
) -> IntervalBounds:
    """Walk along a program.

    tilt_centre: metres from the tip along the tool axis. leg_error: metres by which each leg may be off for the
    component to be kept all the same: legs that pass through a singularity look like legs that turn back just before
    it.
    """
    count = len(program.legs) - 1
    slopes = clamped_slopes(program.legs) if program.interpolation == "cubic" else None
    found = _empty(count, machine.robot.n_legs, len(machine.robot.proven_measures))
    for first in range(0, count, _BLOCK):
        last = min(first + _BLOCK, count)
        progress(first / count)
        # One interval more on each side: accelerations and jerks look across the rows.
        low, high = max(first - 1, 0), min(last + 1, count)
        rows = slice(low, high + 1)
        wide = Interpolant.along(program.legs[rows], None if slopes is None else slopes[rows], program.period)
        _legs(found, wide, first, slice(first - low, last - low))
        part = Interpolant(wide.bernstein[first - low : last - low], program.period)
        samples = slice(2 * first, 2 * last + 1)
        found.position[samples], found.direction[samples] = machine.robot.pose(part.halves, program.component)
        ends = found.position[samples][::2], found.direction[samples][::2]
        found.component.see(machine.robot.prove(part.bernstein, ends, program.component, leg_error=leg_error), first)
        between = slice(2 * first, 2 * last)
        chords = _chords(found, machine, program, part, between, tilt_centre)
        found.away[between], found.turned[between] = chords.deviations[:, 1], chords.angles
        found.speeds[between, :2] = chords.speeds[:, :2]
        found.speeds[between, 2] = chords.speeds[:, 2:].max(axis=1)
        found.speeds[between] /= 0.5 * program.period
        found.base_widest.see(-chords.base_cosines, 2 * first)
        found.platform_closed.see(chords.platform_cosines[..., 1], 2 * first)
        found.platform_open.see(-chords.platform_cosines[..., 0], 2 * first)
    return found


def _empty(count: int, legs: int, measures: int) -> IntervalBounds:
    """Return a survey of `count` intervals of which nothing is known yet."""
    return IntervalBounds(
        shortest=RunningMaximum(legs),
        longest=RunningMaximum(legs),
        rates=RunningMaximum(legs),
        accelerations=RunningMaximum(legs),
        jerks=RunningMaximum(legs),
        component=ComponentFindings(RunningMaximum(measures)),
        position=np.empty((2 * count + 1, 3)),
        direction=np.empty((2 * count + 1, 3)),
        away=np.empty(2 * count),
        turned=np.empty(2 * count),
        speeds=np.empty((2 * count, 3)),
        base_widest=RunningMaximum(legs),
        platform_closed=RunningMaximum(legs),
        platform_open=RunningMaximum(legs),
    )


def _legs(found: IntervalBounds, wide: Interpolant, first: int, inner: slice) -> None:
    """Take in the legs of the inner intervals of a block, which begin at the interval `first`."""
    low, high = wide.ranges
    found.shortest.see(-low[inner], first)
    found.longest.see(high[inner], first)
    found.rates.see(wide.rates[inner], first)
    found.accelerations.see(wide.accelerations[inner.start : inner.stop + 1], first)
    found.jerks.see(wide.jerks[inner], first)


def _chords(
    found: IntervalBounds, machine: Machine, program: Program, part: Interpolant, between: slice, tilt_centre: float
) -> Chords:
    """Return what is proven of the two chords of each interval, between poses that are known already.

    Of the tip, the tilt centre, and both ends of what the platform's line carries.
    """
    tip, heights = machine.tool_length, machine.robot.offsets
    halves = split(part.bernstein)
    legs = np.stack(halves, axis=1).reshape(-1, *part.bernstein.shape[1:])
    start, end = between, slice(between.start + 1, between.stop + 1)
    return machine.robot.prove_chords(
        legs,
        (found.position[start], found.direction[start]),
        (found.position[end], found.direction[end]),
        program.component,
        offsets=np.array([tip, tip - tilt_centre, heights.min(), max(heights.max(), tip)]),
        base_axes=machine.joints.base_axes,
    )
