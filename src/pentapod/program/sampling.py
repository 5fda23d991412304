"""Sampling of a trajectory at the controller's period, which gives the program."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.base.refusal import Refusal, stage
from pentapod.base.version import __version__, library_versions, processor_kind
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.robot import Branch
from pentapod.machine.machine import Machine
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.program.program import Program, Provenance
from pentapod.program.resolution import quantised
from pentapod.timing.time_law.trajectory import Trajectory

ROWS_AT_ONCE = 100_000


@stage
def sample(
    trajectory: Trajectory,
    machine: Machine,
    placement: RigidTransform | PlacedPath | Refusal,
    component: Branch | None = None,
    provenance: Provenance | None = None,
) -> Program:
    """Return the program: the trajectory at the controller's period, at the resolution of program files.

    The duration of trajectories of `retime` is a whole number of periods; of any other the last row is the end point,
    reached within the last period. placement: the result of `plan`; or workpiece → machine, together with the
    component. provenance: by default the machine and no job. Raises InputError where the component is missing.

    >>> program = sample(trajectory, machine, placed)
    >>> program.interpolation, program.period
    ('cubic', 0.001)
    """
    if not isinstance(placement, RigidTransform):
        placed = placement.unwrap()
        placement, component = placed.placement.transform, component or placed.component
    if component is None:
        raise InputError("a placement alone has no component", key="component", expected="a Component")
    period = machine.controller.period
    count = max(1, math.ceil(trajectory.duration / period - 1e-6))
    times = np.minimum(np.arange(count + 1) * period, trajectory.duration)
    times[-1] = trajectory.duration
    legs: list[Floats] = [trajectory(times[k : k + ROWS_AT_ONCE]) for k in range(0, len(times), ROWS_AT_ONCE)]
    made_on = (processor_kind(), library_versions())
    return Program(
        period=period,
        legs=quantised(np.concatenate(legs)),
        interpolation=machine.controller.interpolation,
        component=component,
        placement=placement,
        provenance=provenance
        or Provenance(
            machine.name, machine.digest, "", __version__, None, *made_on, calibration=machine.calibration_name
        ),
        rail_positions=None if machine.guides is None else tuple(machine.rail_positions.tolist()),
    )
