"""Rail positions of a reconfigurable machine, as unknowns of a placement problem."""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from pentapod.base.arrays import Floats
from pentapod.base.errors import MachineError
from pentapod.kinematics.families.reconfigurable import ReconfigurablePentapod
from pentapod.machine.machine import Machine
from pentapod.planning.limits.margins import Margins

DIGITS = 6
"""Rail positions are rounded to micrometres, so that people can read them and files hold them."""
STEP_M = 0.1
"""Unit of a step of a rail position, metres."""


def guides_of(machine: Machine) -> ReconfigurablePentapod:
    """Return the guides of a machine. Raises MachineError: it has none."""
    if machine.guides is None:
        raise MachineError("this machine has no guides", key="guides", value=machine.name)
    return machine.guides


def at_rail_positions(margins: Margins, positions: Floats) -> Margins | None:
    """Return the margins of the same machine with its guides at positions (n,), rounded and within their travel.

    None where it is architecturally singular there or on the way there.
    """
    guides = guides_of(margins.scene.machine)
    positions = np.clip(np.round(positions, DIGITS), *guides.travel.T)
    if not guides.stays_regular(np.zeros(len(positions)), positions):
        return None
    try:
        return margins.on(margins.scene.machine.at(positions))
    except MachineError:
        return None


def with_travel(machine: Machine, room: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Return the constraints (L,) of a placement and their derivatives (L, 6), with those of the travel appended."""
    positions, (least, greatest) = machine.rail_positions, guides_of(machine).travel.T
    each = np.eye(len(positions))
    left = np.concatenate([room[0], positions - least, greatest - positions])
    return left, with_guides(room[1], np.vstack([each, -each]))


def with_guides(by_step: Floats, by_guides: Floats) -> Floats:
    """Return the block diagonal matrix of derivatives by the placement and by the rail positions."""
    return np.asarray(block_diag(by_step, by_guides), dtype=np.float64)
