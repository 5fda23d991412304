"""Limit of the drives' forces: |A s̈ + B ṡ² + G| + friction + what cutting may need ≤ what a drive has at its velocity.

Both the viscous friction and the fall of a drive's force beyond its knee are linear in the velocity |q′| ṡ, which is
not linear in ṡ². Its tangent at one velocity is, and it lies above: rows with it are on the safe side at all others.
That velocity is the largest that feeds, rapids and legs allow at a place; there most of a program is run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, row_maxima
from pentapod.machine.drives import DriveForces
from pentapod.machine.dynamics.dynamics import Dynamics, ForceTerms
from pentapod.machine.machine import Machine
from pentapod.timing.limits.feed import Feed
from pentapod.timing.limits.limit import AccelerationRows, MachineLimit, Motion, Reserve, share_of_room
from pentapod.timing.path.path import PathDerivatives, PieceLike
from pentapod.timing.path.setpoints import InterpolatedSetpoints
from pentapod.toolpath.toolpath import SegmentKind

LEAST_ROOM = 1e-3
"""Share of a drive's force that counts as left to the motion, at least, so that rows are finite; they refuse there."""

LEAST_VELOCITY = 1e-6
"""Velocity of a leg, m/s, whose tangent is taken at least."""


@dataclass(frozen=True, eq=False)
class LegForce(MachineLimit):
    """limit, bound (legs,) N: the peak forces; kept: share that is planned with; feed: what bounds the velocity."""

    quantity = "leg force"
    unit = "N"
    group = "acceleration"
    of_legs = True
    of_tool = True
    of_path = True

    kept: float
    dynamics: Dynamics
    feed: Feed

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> LegForce | None:
        """Return the machine's limit, None where it sets none."""
        if not machine.drive_forces.limited:
            return None
        peak, kept = machine.drive_forces.peak_force, reserve.softer
        return cls(peak * kept, peak, kept, Dynamics.of(machine), Feed.of(machine, reserve))

    def acceleration_rows(self, path: PathDerivatives) -> AccelerationRows:
        """Return the rows (n, k legs): one for each leg, more where what a drive has depends on its velocity."""
        terms, forces = self._along(path), self._forces
        cutting = self._cutting(path.piece, path.s, terms)
        room, fall = self.limit - forces.coulomb_friction - cutting, self.kept * forces.fall
        rows = [self._rows(path, terms, room, forces.viscous_friction)]
        if fall.any():
            rows.append(self._rows(path, terms, room + fall * forces.knee_velocity, forces.viscous_friction + fall))
        return AccelerationRows(*(np.concatenate(parts, axis=1) for parts in zip(*rows, strict=True)))

    def _rows(self, path: PathDerivatives, terms: ForceTerms, room: Floats, slope: Floats) -> tuple[Floats, ...]:
        """Return first, second and offset of rows |force| ≤ room (n, legs) − slope (legs,) · velocity."""
        room = np.maximum(room, LEAST_ROOM * self.limit)
        first, second, offset = terms.inertia / room, terms.quadratic / room, terms.weight / room
        if not slope.any():
            return first, second, offset
        rates = np.abs(path.legs[0])
        fastest = np.minimum(self.feed.speeds(path.piece, path.s), self.feed.rapid)[:, None]
        with np.errstate(divide="ignore"):
            legs = (self._machine.legs.max_velocity / rates).min(axis=1, keepdims=True)
            # No leg is ever faster than where its weight takes all that is left.
            held = np.maximum(room - np.abs(terms.weight), 0.0) / slope
        at = np.maximum(np.minimum(rates * np.minimum(fastest, legs), held), LEAST_VELOCITY)
        constant, by_square = 0.5 * slope * at / room, 0.5 * slope * rates**2 / (at * room)
        return (
            np.concatenate([first, first], axis=1),
            np.concatenate([second + by_square, second - by_square], axis=1),
            np.concatenate([offset + constant, offset - constant], axis=1),
        )

    def share(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the shares (n, legs) of what weight, friction and cutting leave of the drives' forces."""
        terms, rates = self._along(path), path.legs[0] * motion.v[:, None]
        room = self._room(rates, self._cutting(path.piece, path.s, terms), self.kept)
        pushes = terms.inertia * motion.u[:, None] + terms.quadratic * motion.x[:, None]
        return share_of_room(pushes / room, terms.weight / room)

    def measured(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the force (rows, legs) that setpoints ask of drives, friction and cutting included, newtons.

        Where a drive has less than its peak force, it is larger in the same proportion.
        """
        terms, rates, cutting = self._of_rows(setpoints)
        taken = self._forces.friction(rates) + cutting
        has = np.maximum(self._forces.available(rates), LEAST_ROOM * self.bound)
        return (np.abs(terms.quadratic + terms.weight) + taken) * self.bound / has

    def used(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the largest share (rows,) that the motion uses of what weight, friction and cutting leave."""
        terms, rates, cutting = self._of_rows(setpoints)
        room = self._room(rates, cutting, 1.0)
        return row_maxima(share_of_room(terms.quadratic / room, terms.weight / room))

    def at_rest(self, path: PathDerivatives, index: int, row: int) -> str:
        """Return what a leg must hold at rest at a station, in words."""
        terms, leg = self._along(path), row % len(self.limit)
        cutting = self._cutting(path.piece, path.s, terms)
        weight, parts = float(np.abs(terms.weight[index, leg])), [f"{abs(terms.weight[index, leg]):.4g} N of weight"]
        friction = float(self._forces.coulomb_friction[leg])
        parts += [f"{friction:.4g} N of friction"] if friction else []
        parts += [f"{cutting[index, leg]:.4g} N for cutting"] if cutting[index, leg] else []
        total = weight + friction + float(cutting[index, leg])
        return f"{' + '.join(parts)} = {total:.4g} N of {self.limit[leg]:.4g} N that the plan may use"

    @property
    def _machine(self) -> Machine:
        return self.dynamics.machine

    @property
    def _forces(self) -> DriveForces:
        return self._machine.drive_forces

    def _along(self, path: PathDerivatives) -> ForceTerms:
        return path.force_terms(self.dynamics, reach=self._machine.cutting_force > 0.0)

    def _of_rows(self, setpoints: InterpolatedSetpoints) -> tuple[ForceTerms, Floats, Floats]:
        """Return the terms by time at the rows, the legs' rates (rows, legs), and what cutting needs of them."""
        rows, own, legs = setpoints.rows, setpoints.own_rows, setpoints.legs
        rates = legs.first
        if setpoints.interpolation == "linear":  # the rate jumps at the row: the mean of both sides
            rates = 0.5 * (rates + np.append(rates[1:], np.zeros_like(rates[:1]), axis=0))
        tips, axes = np.asarray(rows.tips)[own], np.asarray(rows.axes)[own]
        position = tips + self._machine.tool_length * axes
        reach = self._machine.cutting_force > 0.0
        terms = self.dynamics.of_rows(position, -axes, rates[own], legs.second[own], reach=reach)
        return terms, rates[own], self._cutting(setpoints.piece, rows.stations[own], terms)

    def _room(self, rates: Floats, cutting: Floats, kept: float) -> Floats:
        """Return what the drives have for weight and motion (n, legs) at rates of the legs (n, legs), newtons."""
        left = kept * self._forces.available(rates) - self._forces.friction(rates) - cutting
        return np.maximum(left, LEAST_ROOM * self.limit)

    def _cutting(self, piece: PieceLike, s: Floats, terms: ForceTerms) -> Floats:
        """Return the force (n, legs) that the cutting force may ask of the drives at stations, on cuts and at ends."""
        force = self._machine.cutting_force
        if force == 0.0:
            return np.zeros_like(terms.weight)
        cuts = np.append([kind == SegmentKind.CUT for kind in piece.section_kinds], False)
        ends = np.asarray(piece.section_ends)
        here: Bools = cuts[np.searchsorted(ends, s, "left")] | cuts[np.searchsorted(ends, s, "right")]
        return force * terms.reach * here[:, None]
