"""Interval bounds of the controller's polynomials: extremes of the legs, poses, proofs between the rows.

One walk along the program, block by block: the polynomials of a long program would fill the memory, and a block of them
fits the processor's cache. What is kept is the worst value of each leg and its place, and a few numbers for each sample
and each chord between samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.interpolant import Interpolant, clamped_slopes
from pentapod.kinematics.proof_results import BranchProof, Chords
from pentapod.kinematics.robot import Poses
from pentapod.machine.machine import Machine
from pentapod.numerics.blocks import blocks
from pentapod.numerics.threads import in_threads
from pentapod.program.program import Program

LEG_MEASURES = 5
"""Measures of the legs: shortest, longest, rate, acceleration, jerk."""


class RunningMaximum:
    """The largest values (d,) of d measures over the program, and the places `at` (d,) where they are."""

    def __init__(self) -> None:
        self.values: Floats = np.array(-np.inf)
        self.at: Ints = np.array(0, dtype=np.intp)

    def update(self, measured: Floats, first: int | Ints) -> None:
        """Add values (n, d) at the places first, first + 1, …; of equal ones the first counts."""
        best = np.argmax(measured, axis=0)
        values = measured[best, np.arange(measured.shape[1])]
        better = values > self.values
        self.values, self.at = np.where(better, values, self.values), np.where(better, first + best, self.at)


@dataclass(eq=False)
class ComponentFindings:
    """What is proven of the component, over all intervals.

    lower: −`RunningMaximum` of the proven lower bounds of the robot's `proven_measures`. refuted, undecided: numbers of
    intervals. first_refuted, first_undecided: such an interval, and from where to where in [0, 1] it is in doubt.
    """

    lower: RunningMaximum = field(default_factory=RunningMaximum)
    refuted: int = 0
    undecided: int = 0
    first_refuted: tuple[int, float, float] | None = None
    first_undecided: tuple[int, float, float] | None = None

    def update(self, proof: BranchProof, first: int) -> None:
        """Add the proof of the intervals from `first` on."""
        self.lower.update(-proof.lower, first)
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
    """Poses at the samples, bounds on each chord between samples, and extremes over the program.

    position, direction (M, 3): the poses at the samples, NaN where there are none. Proven upper bounds on each chord,
    infinite where there is no proof: deviations (M − 1,) of the tilt centre from the chord, metres; axis_deviations
    (M − 1,) of the axis from it, radians; speeds (M − 1, 3) of the tip, the tilt centre and the faster end of the
    platform's line with the tool, or of joints beside it, m/s.
    shortest: of the negative leg lengths; longest, rates, jerks: of the legs on each interval; accelerations: at each
    row. Metres and seconds; exact on the controller's polynomials. base_widest, platform_closed, platform_open: proven,
    −cos of the largest angle at the base joint, cos of the smallest and −cos of the largest one at the platform joint.
    """

    position: Floats
    direction: Floats
    deviations: Floats
    axis_deviations: Floats
    speeds: Floats
    component: ComponentFindings = field(default_factory=ComponentFindings)
    shortest: RunningMaximum = field(default_factory=RunningMaximum)
    longest: RunningMaximum = field(default_factory=RunningMaximum)
    rates: RunningMaximum = field(default_factory=RunningMaximum)
    accelerations: RunningMaximum = field(default_factory=RunningMaximum)
    jerks: RunningMaximum = field(default_factory=RunningMaximum)
    base_widest: RunningMaximum = field(default_factory=RunningMaximum)
    platform_closed: RunningMaximum = field(default_factory=RunningMaximum)
    platform_open: RunningMaximum = field(default_factory=RunningMaximum)

    @property
    def of_legs(self) -> tuple[RunningMaximum, ...]:
        """The extremes of the legs' lengths and of their derivatives."""
        return self.shortest, self.longest, self.rates, self.accelerations, self.jerks

    @property
    def unproven(self) -> Ints:
        """The chords on which the motion is not proven."""
        return np.flatnonzero(~np.isfinite(self.deviations))


def interval_bounds(
    program: Program,
    machine: Machine,
    tilt_centre: float,
    leg_error: float,
    progress: Callable[[float], None],
    block: int = 4096,
    told: Floats | None = None,
) -> IntervalBounds:
    """Return the interval bounds of a program.

    told (N, n_legs): lengths that the drives are told in place of the rows; the extremes of the legs are theirs.
    tilt_centre: metres from the tip along the tool axis. leg_error: metres; the component must be kept even if each leg
    is off by so much, because legs that pass through a singularity look like legs that turn back just before it.
    progress: is called with the share that is done. block: intervals of a block.
    """
    count = len(program.legs) - 1
    cubic = program.interpolation == "cubic"
    slopes = clamped_slopes(program.legs) if cubic else None
    drives = None if told is None else (told, clamped_slopes(told) if cubic else None)
    found = IntervalBounds(
        position=np.empty((2 * count + 1, 3)),
        direction=np.empty((2 * count + 1, 3)),
        deviations=np.empty(2 * count),
        axis_deviations=np.empty(2 * count),
        speeds=np.empty((2 * count, 3)),
    )

    def proven(intervals: slice) -> _Block:
        return _Block.of(intervals, program, slopes, machine, tilt_centre, leg_error, drives)

    for part in in_threads(proven, blocks(count, block)):
        progress(part.intervals.start / count)
        part.add_to(found)
    return found


@dataclass(frozen=True, eq=False)
class _Block:
    """What is computed of the intervals of a block."""

    intervals: slice
    legs: tuple[Floats, Ints]
    pose: tuple[Floats, Floats]
    proof: BranchProof
    chords: Chords
    period: float

    @classmethod
    def of(
        cls,
        intervals: slice,
        program: Program,
        slopes: Floats | None,
        machine: Machine,
        tilt_centre: float,
        leg_error: float,
        drives: tuple[Floats, Floats | None] | None,
    ) -> _Block:
        from pentapod.verify.replay.leg_kernels import extremes, halve  # noqa: PLC0415  loads numba

        # One interval more on each side: accelerations and jerks look across the rows.
        low, high = max(intervals.start - 1, 0), min(intervals.stop + 1, len(program.legs) - 1)
        rows = slice(low, high + 1)

        def between(legs: Floats, slopes: Floats | None) -> Floats:
            return Interpolant.along(legs[rows], None if slopes is None else slopes[rows], program.period).bernstein

        wide = between(program.legs, slopes)
        inner = slice(intervals.start - low, intervals.stop - low)
        part, robot = wide[inner], machine.robot
        extents = (LEG_MEASURES, robot.n_legs)
        legs = np.full(extents, -np.inf), np.zeros(extents, dtype=np.intp)
        told = wide if drives is None else between(*drives)
        extremes(told, inner.start, inner.stop, intervals.start, program.period, *legs)
        halves, samples = np.empty((2 * len(part), *part.shape[1:])), np.empty((2 * len(part) + 1, part.shape[1]))
        halve(part, halves, samples)
        position, direction = robot.pose(samples, program.component)
        ends = position[::2], direction[::2]
        proof = robot.prove(part, ends, program.component, leg_error=leg_error)
        chords = _chords((position, direction), machine, program, halves, tilt_centre)
        return cls(intervals, legs, (position, direction), proof, chords, program.period)

    def add_to(self, found: IntervalBounds) -> None:
        """Add the block to what is found of all intervals."""
        first, last, chords = self.intervals.start, self.intervals.stop, self.chords
        for measure, values, at in zip(found.of_legs, *self.legs, strict=True):
            measure.update(values[None], at)
        samples, between = slice(2 * first, 2 * last + 1), slice(2 * first, 2 * last)
        found.position[samples], found.direction[samples] = self.pose
        found.component.update(self.proof, first)
        found.deviations[between], found.axis_deviations[between] = chords.deviations[:, 1], chords.angles
        found.speeds[between, :2] = chords.speeds[:, :2]
        # A joint beside the line gets no farther from its place at the start than at twice the speed in half a chord.
        found.speeds[between, 2] = np.maximum(chords.speeds[:, 2:].max(axis=1), 2.0 * chords.beside)
        found.speeds[between] /= 0.5 * self.period
        found.base_widest.update(-chords.base_cosines, 2 * first)
        found.platform_closed.update(chords.platform_cosines[..., 1], 2 * first)
        found.platform_open.update(-chords.platform_cosines[..., 0], 2 * first)


def _chords(pose: Poses, machine: Machine, program: Program, halves: Floats, tilt_centre: float) -> Chords:
    """Return the proofs about the chords (n,) between poses (n + 1, 3) that are known.

    The points are the tip, the tilt centre, and both ends of the platform's line with the tool.
    """
    tip, heights = machine.tool_length, machine.bars.offsets
    position, direction = pose
    return machine.robot.prove_chords(
        halves,
        (position[:-1], direction[:-1]),
        (position[1:], direction[1:]),
        program.component,
        offsets=np.array([tip, tip - tilt_centre, heights.min(), max(heights.max(), tip)]),
        base_axes=machine.joints.base_axes,
    )
