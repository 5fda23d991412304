"""Forces of the drives at a program's rows, from the poses of its legs and the controller's polynomials."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.values import Value
from pentapod.geometry.interpolant import Interpolant
from pentapod.machine.dynamics.dynamics import Dynamics
from pentapod.machine.machine import Machine
from pentapod.numerics.blocks import blocks
from pentapod.program.program import Program

ROWS_AT_ONCE = 1 << 15
"""Rows that are computed together, so that memory grows by no more than four numbers a leg and row."""


def motion_of_rows(program: Program, slopes: Floats | None) -> Iterator[tuple[slice, Floats, Floats]]:
    """Yield slices of a program's rows with the rates and accelerations (N, n_legs) of the legs there, m/s and m/s².

    slopes: of the spline, as `Interpolant.along`.
    """
    last = len(program.legs) - 1
    for part in blocks(last + 1, ROWS_AT_ONCE):
        low, high = max(part.start - 1, 0), min(part.stop, last)  # one row more on each side
        near, own = slice(low, high + 1), slice(part.start - low, part.stop - low)
        legs = Interpolant.along(program.legs[near], None if slopes is None else slopes[near], program.period)
        rates = legs.first
        if slopes is None:  # the rate jumps at the row: the mean of both sides
            rates = 0.5 * (rates + np.append(rates[1:], np.zeros_like(rates[:1]), axis=0))
        yield part, rates[own], legs.second[own]


@dataclass(frozen=True, eq=False)
class RowForces(Value):
    """Forces (N, n_legs) at the rows, newtons.

    push: what a drive gives, friction against its motion included; a push is positive. motion: the part that
    accelerations and velocities ask for. asked: |push| at most, friction counted against the drive, and what the
    cutting force may ask for, `cutting`. available: what the drive has at that velocity.
    """

    push: Floats
    motion: Floats
    asked: Floats
    cutting: Floats
    available: Floats

    @classmethod
    def of(
        cls, program: Program, machine: Machine, slopes: Floats | None, poses: tuple[Floats, Floats], cuts: Bools
    ) -> RowForces:
        """Return the forces of a program whose rows have poses (N, 3); slopes: of the spline, as `Interpolant.along`.

        cuts (N,): the rows that cut.
        """
        found = cls(*(np.empty(program.legs.shape) for _ in fields(cls)))
        for part, rates, accelerations in motion_of_rows(program, slopes):
            here = cls.at(machine, (poses[0][part], poses[1][part]), rates, accelerations, cuts[part])
            for item in fields(cls):
                getattr(found, item.name)[part] = getattr(here, item.name)
        return found

    @classmethod
    def at(
        cls, machine: Machine, poses: tuple[Floats, Floats], rates: Floats, accelerations: Floats, cuts: Bools
    ) -> RowForces:
        """Return the forces of legs that move so, m/s and m/s² (N, n_legs), in poses (N, 3)."""
        force, forces = machine.cutting_force, machine.drive_forces
        terms = Dynamics.of(machine).of_rows(*poses, rates, accelerations, reach=force > 0.0)
        needed, friction = terms.quadratic + terms.weight, forces.friction(rates)
        cutting = force * terms.reach * cuts[:, None] if force > 0.0 else np.zeros_like(needed)
        return cls(
            needed + np.sign(rates) * friction, terms.quadratic, np.abs(needed) + friction + cutting, cutting,
            np.maximum(forces.available(rates), np.finfo(float).tiny),
        )  # fmt: skip

    @property
    def motion_shares(self) -> Floats:
        """The share (N, n_legs) that the motion uses of what all else leaves of a drive's force."""
        else_ = self.asked - np.abs(self.motion)
        return np.abs(self.motion) / np.maximum(self.available - else_, np.finfo(float).tiny)
