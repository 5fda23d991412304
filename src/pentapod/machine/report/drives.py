"""What the drives of a machine can do anywhere in its work volume: weights, forces, accelerations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.kinematics.jacobian import tip_jacobian
from pentapod.machine.dynamics.dynamics import Dynamics
from pentapod.machine.machine import Machine

WAYS = tuple(way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way))
"""Directions of the tip at its rapid rate for which forces are computed."""


@dataclass(frozen=True, eq=False)
class DriveReport(Value):
    """The worst values of the drives over all sampled poses.

    weight (n_legs,): largest force at rest, friction included; needed (n_legs,): force with which every leg can have
    its largest acceleration in any combination, at rest and at the rapid rate in any direction, newtons. share: of the
    legs' acceleration limits that the drives can keep so everywhere, and where the least is.
    """

    weight: Floats
    needed: Floats
    share: float
    leg: int
    where: str

    @classmethod
    def of(cls, machine: Machine, position: Floats, direction: Floats, where: Callable[[int], str]) -> DriveReport:
        """Return the worst values over poses (N, 3); where: the place of one of them in words."""
        dynamics, forces, limits = Dynamics.of(machine), machine.drive_forces, machine.legs
        count, still = machine.robot.n_legs, np.zeros((len(position), machine.robot.n_legs))
        weight = np.abs(dynamics.of_rows(position, direction, still, still).weight)
        for_accelerations = np.zeros_like(still)
        for leg in range(count):
            alone = still.copy()
            alone[:, leg] = limits.max_acceleration[leg]
            for_accelerations += np.abs(dynamics.of_rows(position, direction, still, alone).quadratic)
        rates_by_tip = tip_jacobian(machine.robot, position, direction, machine.tool_length)[..., :3]
        share, needed = np.full(still.shape, np.inf), np.zeros_like(still)
        for way in ((0.0, 0.0, 0.0), *WAYS):
            tip = machine.rapid_velocity * np.array(way) / max(float(np.linalg.norm(way)), 1.0)
            rates = rates_by_tip @ tip
            # Accelerations are those of legs; what a motion at constant rates of the legs asks for comes on top.
            steady = np.abs(dynamics.of_rows(position, direction, rates, still).quadratic)
            other = weight + steady + forces.friction(rates)
            needed = np.maximum(needed, for_accelerations + other + forces.peak_force - forces.available(rates))
            share = np.minimum(share, (forces.available(rates) - other) / for_accelerations)
        pose, leg = np.unravel_index(int(share.argmin()), share.shape)
        return cls(
            (weight + forces.coulomb_friction).max(axis=0), needed.max(axis=0), float(share[pose, leg]), int(leg),
            where(int(pose)),
        )  # fmt: skip

    def lines(self, machine: Machine) -> list[str]:
        """Return the lines of `pentapod machine check`."""
        forces, limit = machine.drive_forces, machine.legs.max_acceleration
        found = ["", "  drive   weight at most (N)   force for its acceleration limit (N)   peak force (N)"]
        for k, peak in enumerate(forces.peak_force):
            found.append(f"  {k + 1}       {self.weight[k]:10.0f}           {self.needed[k]:14.0f}   {peak:28.0f}")
        kept = max(min(self.share, 1.0), 0.0)
        accelerations = sorted({round(float(1e3 * kept * a)) for a in limit})
        told = " to ".join(f"{a}" for a in accelerations[:: max(len(accelerations) - 1, 1)])
        found.append(
            f"  everywhere the drives can keep leg accelerations of {told} mm/s², {kept:.0%} of the limits, in all "
            "combinations,"
        )
        found.append(f"    at rest and at the rapid rate; the least: drive {self.leg + 1}, {self.where}")
        if self.share < 0.0:
            found.append("    there the drive cannot move the machine at the rapid rate, or not hold its weight")
        elif self.share < 1.0:
            found.append("    where the limits ask for more, plans are slower: `explain` names the leg's force")
        return found
