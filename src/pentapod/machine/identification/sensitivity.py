"""How readings and tips change with the thirty numbers of a machine, and poses from readings by Newton's method."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.jacobian import pose_jacobian
from pentapod.kinematics.tubes.leg_equations import Legs, length_scale, newton
from pentapod.machine.calibration.parameters import KINDS, LEGS, PARAMETERS


def machine_of(theta: Floats, nominal: AsBuiltPentapod | None = None) -> AsBuiltPentapod:
    """Return the machine of the thirty numbers, in the order of `PARAMETERS`. nominal: whose branches it has."""
    rows = theta[: len(PARAMETERS)].reshape(LEGS, len(KINDS))
    known = None if nominal is None else nominal.nominal
    offsets, radii, zeros = rows[:, 3:].T
    return AsBuiltPentapod(rows[:, :3], offsets, radii, zeros, known)


def numbers_of(machine: AsBuiltPentapod) -> Floats:
    """Return the thirty numbers (30,) of a machine, metres, in the order of `PARAMETERS`."""
    return np.c_[machine.base, machine.offsets, machine.radii, machine.zeros].ravel()


def by_parameters(machine: AsBuiltPentapod, position: Floats, direction: Floats) -> Floats:
    """Return ∂reading_k/∂(x, y, z, offset, radius, zero) of leg k (N, 5, 6) in poses (N, 3)."""
    d = machine.base - position[:, None]
    t = np.einsum("nkc,nc->nk", d, direction)
    rho = np.linalg.norm(d - t[..., None] * direction[:, None], axis=-1)
    along, across = t - machine.offsets, rho - machine.radii
    length = np.hypot(along, across)
    by_base = -machine.jacobian(position, direction)[..., :3]
    rest = np.stack([-along / length, -across / length, np.ones_like(length)], axis=-1)
    return np.concatenate([by_base, rest], axis=-1)


def spread(columns: Floats) -> Floats:
    """Return derivatives (N, 5, 30) by all parameters from those (N, 5, 6) of each leg by its own."""
    every = np.zeros((len(columns), LEGS, LEGS, len(KINDS)))
    every[:, range(LEGS), range(LEGS)] = columns
    return every.reshape(len(columns), LEGS, len(PARAMETERS))


def tip_by_legs(machine: AsBuiltPentapod, position: Floats, direction: Floats, length: float) -> Floats:
    """Return ∂(p + length · i)/∂readings (N, 3, 5) in poses (N, 3)."""
    by_legs = pose_jacobian(machine, position, direction)
    return by_legs[:, :3] + length * by_legs[:, 3:]


def tip_by_parameters(machine: AsBuiltPentapod, position: Floats, direction: Floats, length: float) -> Floats:
    """Return how the point p + length · i moves (N, 3, 30) with the parameters while the readings stay."""
    columns = spread(by_parameters(machine, position, direction))
    return -tip_by_legs(machine, position, direction, length) @ columns


def poses_near(machine: AsBuiltPentapod, legs: Floats, position: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """Return the poses (N, 3) with these readings (N, 5) near the given ones; NaN where Newton's method finds none."""
    geometry = Legs(
        machine.base.T[..., None],
        machine.offsets[:, None],
        machine.radii[:, None],
        (legs - machine.zeros).T,
        (machine.radii != 0.0)[:, None],
    )
    with np.errstate(all="ignore"):
        p, i, found = newton(position.T, direction.T, geometry, length_scale(machine))
    p, i = np.where(found, p, np.nan).T, np.where(found, i, np.nan).T
    return p, i / np.linalg.norm(i, axis=1, keepdims=True)
