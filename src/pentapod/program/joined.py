"""Programs one after the other: the way in, the program, and the way out as one stream of rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ProgramError
from pentapod.program.program import ProcessForce, Program, Switch

REST_ROWS = 24
"""Periods of rest where two programs meet.

A controller's spline then knows nothing of what is beyond: its waves fade to a quarter from row to row.
"""

SAME_ROW = 2e-11
"""Metres by which the last row of one and the first of the next may differ: two units of the last digit."""


def joined(first: Program, second: Program) -> Program:
    """Return two programs as one, with a rest between them, and the header of the one that switches, or of the second.

    Raises ProgramError where the second does not begin where the first ends, or is of another period or component.
    """
    off = (
        float(np.abs(first.legs[-1] - second.legs[0]).max()) if first.legs.shape[1] == second.legs.shape[1] else np.inf
    )
    if off > SAME_ROW:
        raise ProgramError("the programs do not meet", key="legs", value=f"{1e3 * off:.6g} mm apart", expected="0 mm")
    if (first.period, first.interpolation, first.component) != (second.period, second.interpolation, second.component):
        raise ProgramError("the programs have another period, interpolation or component", key="period_s")
    rest = np.tile(second.legs[0], (REST_ROWS, 1))
    before = len(first.legs) - 1 + REST_ROWS
    powers = None
    if first.laser_power is not None or second.laser_power is not None:
        powers = np.concatenate([_powers(first)[:-1], np.zeros(REST_ROWS), _powers(second)])
    moved = tuple(Switch(switch.row + before, switch.words) for switch in second.switches)
    force = None
    if (pushed := first.process_force or second.process_force) is not None:
        cuts = (*_cuts(first), *((a + before, b + before) for a, b in _cuts(second)))
        force = ProcessForce(pushed.newtons, cuts)
    return replace(
        first if first.switches else second,
        process_force=force,
        legs=np.concatenate([first.legs[:-1], rest, second.legs]),
        switches=(*first.switches, *moved),
        laser_power=powers,
    )


def _cuts(program: Program) -> tuple[tuple[int, int], ...]:
    return () if program.process_force is None else program.process_force.cuts


def _powers(program: Program) -> Floats:
    return np.zeros(len(program.legs)) if program.laser_power is None else program.laser_power
