"""Replay: a program as the controller would run it, beside the toolpath it should follow."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.geometry.interpolant import Interpolant
from pentapod.kinematics.certificate import ComponentProof, certify_component
from pentapod.machine.machine import Machine
from pentapod.program.program import Program
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify.matching import Match, match
from pentapod.verify.verdict import Place
from pentapod.verify.visits import Course


@dataclass(frozen=True, eq=False)
class Replay:
    """What the claims look at. Derived values are computed when first asked for, and kept.

    tilt and axis_tolerance in radians, path_tolerance in metres. job_digest: of the job that the program
    should belong to, None where that is not asked. *Samples* are the rows and the moments halfway between
    them: M = 2N − 1, sample 2k is row k.
    """

    program: Program
    machine: Machine
    toolpath: Toolpath
    tilt: float
    path_tolerance: float
    axis_tolerance: float
    job_digest: str | None = None

    @cached_property
    def motion(self) -> Interpolant:
        """The polynomials that the legs follow between the rows, metres."""
        return Interpolant.through(self.program.legs, self.program.period, self.program.interpolation)

    @cached_property
    def proof(self) -> ComponentProof:
        """What is proven about the component on each interval between rows.

        For the program and for every motion whose legs stay within the path tolerance of it: legs that pass
        through a singularity look like legs that turn back just before it.
        """
        return certify_component(
            self.machine.pentapod,
            self.motion.bernstein,
            self.program.component,
            leg_error=self.path_tolerance,
        )

    @cached_property
    def pose(self) -> tuple[Floats, Floats]:
        """Positions and directions (M, 3) at the samples, machine frame, in the component of the header.

        By the closed-form forward kinematics; NaN where these leg lengths have no pose.
        """
        return self.machine.pentapod.pose(self.motion.halves, self.program.component)

    @cached_property
    def unposed(self) -> Ints:
        """The samples where the leg lengths have no pose."""
        position, direction = self.pose
        return np.flatnonzero(~np.isfinite(position).all(axis=1) | ~np.isfinite(direction).all(axis=1))

    @cached_property
    def tips(self) -> Floats:
        """Tool tips (M, 3) at the samples, metres, workpiece frame by the header's placement."""
        position, direction = self.pose
        return self.program.placement.inverse().apply(position + self.machine.tool_length * direction)

    @cached_property
    def axes(self) -> Floats:
        """Tool axes (M, 3) at the samples, tip → spindle, workpiece frame."""
        return self.program.placement.inverse().rotate(-self.pose[1])

    @cached_property
    def pivots(self) -> Floats:
        """The points (M, 3) about which the tool may tilt, workpiece frame, metres."""
        return self.tips + self.toolpath.pivot * self.axes

    @cached_property
    def match(self) -> Match:
        """Which place of the toolpath each sample belongs to. Needs a pose at every sample."""
        program, path = Course(self.pivots, self.axes), Course(self.toolpath.pivots, self.toolpath.axes)
        return match(program, path, self.path_tolerance)

    def place(self, sample: float) -> Place:
        """Return the place of a sample (or of a moment between samples)."""
        if not len(self.unposed):
            waypoint = int(self.match.places[int(sample)])
            segment = int(self.toolpath.segment_of_interval[min(waypoint, len(self.toolpath) - 2)])
        else:
            segment = None
        return Place(round(float(sample) * 0.5 * self.program.period, 9), int(sample) // 2, segment)


def excursion(values: Floats) -> Floats:
    """Return how far (N − 1, ...) a quantity may stray between the samples from straight lines through them.

    values (2N − 1, ...) at the samples. Over half an interval a function strays from its chord by at most an
    eighth of (largest second derivative · time²); the second difference over the interval estimates that
    product, and is doubled for how the second derivative may vary within one interval. An estimate with a
    margin, not a proof. It stays within intervals, since linear interpolation has corners at the rows.
    """
    return np.abs(values[:-1:2] - 2.0 * values[1::2] + values[2::2]) / 4.0


def at_samples(between: Floats) -> Floats:
    """Return for each sample (2N − 1,) the larger value of the intervals (N − 1,) it belongs to."""
    rows = np.zeros(len(between) + 1)
    rows[:-1] = between
    rows[1:] = np.maximum(rows[1:], between)
    samples = np.empty(2 * len(between) + 1)
    samples[::2], samples[1::2] = rows, between
    return samples
