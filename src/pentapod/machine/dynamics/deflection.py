"""Deflection: how far the tip moves because legs and joints yield along the legs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.kinematics.forces import leg_force_map
from pentapod.kinematics.robot import Branch
from pentapod.machine.dynamics.dynamics import Dynamics
from pentapod.machine.machine import Machine

ROUNDS = 4
"""Rounds of the fixed point from what drives count to the pose."""


@dataclass(frozen=True, eq=False)
class Yielding(Value):
    """How far the tip moves in N poses, to first order, passive limbs rigid; infinite on a singularity.

    shift (N, 3): by the legs' forces, metres, machine frame. softest (N,): by 1 N on the tip in the direction in which
    it yields most, m/N; ways (N, 3): that direction, of either sign.
    """

    shift: Floats
    softest: Floats
    ways: Floats

    @classmethod
    def of(cls, machine: Machine, position: Floats, direction: Floats, push: Floats | None = None) -> Yielding:
        """Return it for poses (N, 3). push (N, n_legs): forces of the legs on the platform, newtons; None for none."""
        loads = leg_force_map(machine.robot, position, direction, machine.tool_length)
        firm = np.asarray(np.isfinite(loads).all(axis=(-1, -2)), dtype=np.bool_)
        loads = np.where(firm[:, None, None], loads, 0.0)
        lengths = np.linalg.norm(machine.robot.leg_vectors(position, direction), axis=-1)
        by_newton = machine.stiffness.yielding(lengths)
        turned = np.swapaxes(loads, -1, -2)
        most, ways = np.linalg.eigh(turned @ (by_newton[..., None] * loads))
        # A leg that pushes gets shorter. Virtual work: shift = -loads^T (change of length).
        shorter = np.zeros_like(by_newton) if push is None else by_newton * push
        shift = np.einsum("nac,nc->na", turned, shorter)
        return cls(
            np.where(firm[:, None], shift, np.inf), np.where(firm, np.maximum(most[:, -1], 0.0), np.inf), ways[..., -1]
        )


def tip_shift(machine: Machine, position: Floats, direction: Floats, shorter: Floats) -> Floats:
    """Return how far the tip moves (N, 3), metres, to first order, as legs get shorter (N, n_legs), metres."""
    loads = leg_force_map(machine.robot, position, direction, machine.tool_length)
    # Virtual work: shift = -loads^T (change of length).
    return np.einsum("nac,na->nc", loads, shorter)


def weight_yields(machine: Machine, position: Floats, direction: Floats) -> Floats:
    """Return how much shorter legs get by the weight (N, n_legs) in poses (N, 3) at rest, metres; less than 0: longer.

    Not finite where there is no pose, or on a singularity.
    """
    lengths = np.linalg.norm(machine.robot.leg_vectors(position, direction), axis=-1)
    still = np.zeros_like(lengths)
    return leg_pushes(machine, position, direction, still, still) * machine.stiffness.yielding(lengths)


def loaded_poses(machine: Machine, counted: Floats, branch: Branch) -> tuple[Floats, Floats]:
    """Return the poses (N, 3) of a machine at rest whose drives count `counted` (N, n_legs): its weight is on its legs.

    NaN where there is none. What a leg yields changes by less than a thousandth of its length's change: a few rounds.
    """
    position, direction = machine.robot.pose(counted, np.array(branch))
    for _ in range(ROUNDS):
        legs = counted - weight_yields(machine, position, direction)
        position, direction = machine.robot.pose(legs, np.array(branch))
    return position, direction


def leg_pushes(
    machine: Machine, position: Floats, direction: Floats, rates: Floats, accelerations: Floats, *, weight: bool = True
) -> Floats:
    """Return the forces (N, n_legs) with which legs hold and move platform and rods, newtons; a push is positive.

    rates, accelerations: of the legs, m/s and m/s². weight: whether it is in them; else only what moves. What a drive
    needs to move itself is not in it: that does not go through the leg. No friction.
    """
    terms = Dynamics.of(machine).of_rows(position, direction, rates, accelerations, reach=False)
    through = terms.quadratic + terms.weight if weight else terms.quadratic
    return through - machine.drives.moving_mass * accelerations
