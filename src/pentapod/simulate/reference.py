"""Reference motion of legs and tool that a program defines, and the simulated motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import ProgramError
from pentapod.base.values import Result, Value
from pentapod.geometry.interpolant import Interpolant
from pentapod.machine.machine import Machine
from pentapod.program.program import Program


@dataclass(frozen=True, eq=False)
class Reference(Value):
    """A program on its machine. Samples are the rows and the times halfway between them: M = 2N − 1.

    Raises ProgramError where the program's leg lengths have no pose on this machine.

    >>> reference = Reference(program, machine)
    >>> reference.tips.shape == (2 * len(program.legs) - 1, 3)
    True
    """

    program: Program
    machine: Machine

    def __post_init__(self) -> None:
        lost = np.flatnonzero(~np.isfinite(self.tips).all(axis=1))
        if len(lost):
            raise ProgramError(
                "these leg lengths have no pose on this machine",
                key=f"row {lost[0] // 2}",
                value=np.round(1e3 * self._motion.halves[lost[0]], 6).tolist(),
                remedy="`pentapod verify` shows what is wrong with the program",
            )

    @cached_property
    def lengths(self) -> Floats:
        """Coefficients (N − 1, n, 4) of the leg lengths between rows, by powers of the period's fraction, metres."""
        b = self._motion.bernstein
        coefficients = np.zeros((*b.shape[:2], 4))
        coefficients[..., 0], coefficients[..., 1] = b[..., 0], self._motion.degree * (b[..., 1] - b[..., 0])
        if self._motion.degree == 3:
            coefficients[..., 2] = 3.0 * (b[..., 0] - 2.0 * b[..., 1] + b[..., 2])
            coefficients[..., 3] = b[..., 3] - b[..., 0] + 3.0 * (b[..., 1] - b[..., 2])
        return coefficients

    @cached_property
    def accelerations(self) -> Floats:
        """Coefficients (N − 1, n_legs, 2) of the accelerations for the drives' feed-forward, m/s².

        With linear interpolation the second difference of the rows, held over the period.
        """
        coefficients = np.zeros((len(self.program.legs) - 1, self.program.legs.shape[1], 2))
        second = self._motion.second
        coefficients[..., 0] = second[:-1]
        if self._motion.degree == 3:
            coefficients[..., 1] = np.diff(second, axis=0)
        return coefficients

    @cached_property
    def tips(self) -> Floats:
        """Tool tips (M, 3) at the samples, metres, machine frame."""
        position, direction = self._pose
        return position + self.machine.tool_length * direction

    @property
    def directions(self) -> Floats:
        """Directions (M, 3) of the platform at the samples, machine frame."""
        return self._pose[1]

    def at(self, parts: int) -> tuple[Floats, Floats, Floats]:
        """Return leg lengths, rates and accelerations (parts · (N − 1) + 1, n_legs), `parts` samples in a period."""
        t = np.arange(parts) / parts
        c, a, period = self.lengths, self.accelerations, self.program.period
        lengths = c[..., :1] + t * (c[..., 1:2] + t * (c[..., 2:3] + t * c[..., 3:]))
        rates = (c[..., 1:2] + t * (2.0 * c[..., 2:3] + 3.0 * t * c[..., 3:])) / period
        ends = self.program.legs[-1:], np.zeros_like(self.program.legs[-1:]), a[-1:, :, 0] + a[-1:, :, 1]
        inner = (
            values.transpose(0, 2, 1).reshape(-1, self.program.legs.shape[1])
            for values in (lengths, rates, a[..., :1] + t * a[..., 1:])
        )
        found = [np.concatenate([values, end]) for values, end in zip(inner, ends, strict=True)]
        return found[0], found[1], found[2]

    @cached_property
    def _motion(self) -> Interpolant:
        return Interpolant.through(self.program.legs, self.program.period, self.program.interpolation)

    @cached_property
    def _pose(self) -> tuple[Floats, Floats]:
        return self.machine.robot.pose(self._motion.halves, self.program.component)


@dataclass(frozen=True, eq=False)
class Played(Result):
    """Simulated motion at each row of the program, machine frame.

    legs (N, n): leg lengths; tips (N, 3), metres; directions (N, 3) of the platform. forces (N, n): of the drives,
    newtons.

    >>> played.legs.shape[1]
    5
    """

    legs: Floats
    tips: Floats
    directions: Floats
    forces: Floats

    def __post_init__(self) -> None:
        set_frozen(
            self,
            legs=frozen(self.legs, "legs", (None, None)),
            tips=frozen(self.tips, "tips", (None, 3)),
            directions=frozen(self.directions, "directions", (None, 3)),
            forces=frozen(self.forces, "forces", (None, None)),
        )
