"""Machines that were built: geometry with limits and bodies, their files, and what can be said about them."""

from pentapod.machine.check import AMPLIFICATION_LIMIT, Finding, MachineReport, check
from pentapod.machine.clearance import clearances, pair_names
from pentapod.machine.drives import Drives, Masses
from pentapod.machine.explain import explain
from pentapod.machine.machine import ARCHITECTURAL_LIMIT, Machine, load_machine, read_machine
from pentapod.machine.parts import Bodies, ControllerSettings, JointLimits, LegLimits, WorkVolume
from pentapod.machine.reader import shipped_machines
from pentapod.machine.segments import segment_distance
from pentapod.machine.surroundings import NOTHING, Obstacle, Surroundings
from pentapod.machine.tool_limits import ToolLimits
from pentapod.machine.work_volume import sample_work_volume

__all__ = [
    "AMPLIFICATION_LIMIT",
    "ARCHITECTURAL_LIMIT",
    "NOTHING",
    "Bodies",
    "ControllerSettings",
    "Drives",
    "Finding",
    "JointLimits",
    "LegLimits",
    "Machine",
    "MachineReport",
    "Masses",
    "Obstacle",
    "Surroundings",
    "ToolLimits",
    "WorkVolume",
    "check",
    "clearances",
    "explain",
    "load_machine",
    "pair_names",
    "read_machine",
    "sample_work_volume",
    "segment_distance",
    "shipped_machines",
]
