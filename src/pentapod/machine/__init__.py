"""Machines that were built: geometry with limits and bodies, their files, and what can be said about them."""

from pentapod.machine.clearance import clearances, pair_names
from pentapod.machine.machine import (
    ARCHITECTURAL_LIMIT,
    Bodies,
    ControllerSettings,
    JointLimits,
    LegLimits,
    Machine,
    WorkVolume,
)
from pentapod.machine.reader import load_machine, read_machine, shipped_machines
from pentapod.machine.segments import segment_distance

__all__ = [
    "ARCHITECTURAL_LIMIT",
    "Bodies",
    "ControllerSettings",
    "JointLimits",
    "LegLimits",
    "Machine",
    "WorkVolume",
    "clearances",
    "load_machine",
    "pair_names",
    "read_machine",
    "segment_distance",
    "shipped_machines",
]
