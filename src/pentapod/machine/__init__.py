"""Machines: geometry with limits and bodies, machine files, clearances, calibration, and the report on a machine."""

from pentapod.machine.calibration.calibration_file import read_calibration, write_calibration
from pentapod.machine.calibration.record import CalibrationFit, CalibrationRecord, MeasuredGeometry, geometry_digest
from pentapod.machine.clearance.collision_world import NOTHING, CollisionWorld, Obstacle
from pentapod.machine.clearance.leg_clearance import clearances, pair_names, segment_distance
from pentapod.machine.drives import Drives, Masses
from pentapod.machine.identification.calibration import Calibration, calibrate
from pentapod.machine.identification.identification import Identified, identify
from pentapod.machine.identification.measurements import Frame, Instrument, Measurements
from pentapod.machine.identification.measurements_file import read_measurements, write_measurements
from pentapod.machine.identification.recording import record_of
from pentapod.machine.leg_model import LegModel
from pentapod.machine.machine import ARCHITECTURAL_LIMIT, Machine, load_machine, read_machine
from pentapod.machine.parts import Bodies, ControllerSettings, JointLimits, LegLimits, ToolLimits, WorkVolume
from pentapod.machine.reader import shipped_machines
from pentapod.machine.report.drift import Drift, drift
from pentapod.machine.report.modes import AssemblyPose, AssemblyPoses, admissible_modes
from pentapod.machine.report.report import (
    AMPLIFICATION_LIMIT,
    MachineFinding,
    MachineReport,
    check,
    explain,
)
from pentapod.machine.work_volume import sample_work_volume

__all__ = [
    "AMPLIFICATION_LIMIT",
    "ARCHITECTURAL_LIMIT",
    "NOTHING",
    "AssemblyPose",
    "AssemblyPoses",
    "Bodies",
    "Calibration",
    "CalibrationFit",
    "CalibrationRecord",
    "CollisionWorld",
    "ControllerSettings",
    "Drift",
    "Drives",
    "Frame",
    "Identified",
    "Instrument",
    "JointLimits",
    "LegLimits",
    "LegModel",
    "Machine",
    "MachineFinding",
    "MachineReport",
    "Masses",
    "MeasuredGeometry",
    "Measurements",
    "Obstacle",
    "ToolLimits",
    "WorkVolume",
    "admissible_modes",
    "calibrate",
    "check",
    "clearances",
    "drift",
    "explain",
    "geometry_digest",
    "identify",
    "load_machine",
    "pair_names",
    "read_calibration",
    "read_machine",
    "read_measurements",
    "record_of",
    "sample_work_volume",
    "segment_distance",
    "shipped_machines",
    "write_calibration",
    "write_measurements",
]
