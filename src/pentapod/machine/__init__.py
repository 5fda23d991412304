"""Machines: geometry with limits and bodies, machine files, clearances, calibration, and the report on a machine.

The names below are imported when they are first used, so that a part of the package loads alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pentapod.base.registry import imported_when_used

if TYPE_CHECKING:
    from pentapod.machine.calibration.calibration_file import read_calibration as read_calibration
    from pentapod.machine.calibration.calibration_file import write_calibration as write_calibration
    from pentapod.machine.calibration.record import CalibrationFit as CalibrationFit
    from pentapod.machine.calibration.record import CalibrationRecord as CalibrationRecord
    from pentapod.machine.calibration.record import MeasuredGeometry as MeasuredGeometry
    from pentapod.machine.calibration.record import geometry_digest as geometry_digest
    from pentapod.machine.clearance.collision_world import NOTHING as NOTHING
    from pentapod.machine.clearance.collision_world import CollisionWorld as CollisionWorld
    from pentapod.machine.clearance.collision_world import Obstacle as Obstacle
    from pentapod.machine.clearance.leg_clearance import clearances as clearances
    from pentapod.machine.clearance.leg_clearance import pair_names as pair_names
    from pentapod.machine.clearance.leg_clearance import segment_distance as segment_distance
    from pentapod.machine.drives import DriveForces as DriveForces
    from pentapod.machine.drives import Drives as Drives
    from pentapod.machine.drives import Masses as Masses
    from pentapod.machine.dynamics.dynamics import Dynamics as Dynamics
    from pentapod.machine.dynamics.dynamics import ForceTerms as ForceTerms
    from pentapod.machine.identification.calibration import Calibration as Calibration
    from pentapod.machine.identification.calibration import calibrate as calibrate
    from pentapod.machine.identification.identification import Identified as Identified
    from pentapod.machine.identification.identification import identify as identify
    from pentapod.machine.identification.measurements import Frame as Frame
    from pentapod.machine.identification.measurements import Instrument as Instrument
    from pentapod.machine.identification.measurements import Measurements as Measurements
    from pentapod.machine.identification.measurements_file import read_measurements as read_measurements
    from pentapod.machine.identification.measurements_file import write_measurements as write_measurements
    from pentapod.machine.identification.recording import record_of as record_of
    from pentapod.machine.leg_model import LegModel as LegModel
    from pentapod.machine.machine import ARCHITECTURAL_LIMIT as ARCHITECTURAL_LIMIT
    from pentapod.machine.machine import Machine as Machine
    from pentapod.machine.machine import load_machine as load_machine
    from pentapod.machine.machine import read_machine as read_machine
    from pentapod.machine.parts import Bodies as Bodies
    from pentapod.machine.parts import ControllerSettings as ControllerSettings
    from pentapod.machine.parts import JointLimits as JointLimits
    from pentapod.machine.parts import LegLimits as LegLimits
    from pentapod.machine.parts import Stiffness as Stiffness
    from pentapod.machine.parts import ToolLimits as ToolLimits
    from pentapod.machine.parts import WorkVolume as WorkVolume
    from pentapod.machine.reader import shipped_machines as shipped_machines
    from pentapod.machine.report.drift import Drift as Drift
    from pentapod.machine.report.drift import drift as drift
    from pentapod.machine.report.findings import MachineFinding as MachineFinding
    from pentapod.machine.report.modes import AssemblyPose as AssemblyPose
    from pentapod.machine.report.modes import AssemblyPoses as AssemblyPoses
    from pentapod.machine.report.modes import admissible_modes as admissible_modes
    from pentapod.machine.report.report import AMPLIFICATION_LIMIT as AMPLIFICATION_LIMIT
    from pentapod.machine.report.report import MachineReport as MachineReport
    from pentapod.machine.report.report import check as check
    from pentapod.machine.report.report import explain as explain
    from pentapod.machine.rigid_bodies.mjcf import mjcf as mjcf
    from pentapod.machine.rigid_bodies.sdf import sdf as sdf
    from pentapod.machine.work_volume import sample_work_volume as sample_work_volume

_HOMES = {
    "machine.calibration.calibration_file": "read_calibration write_calibration",
    "machine.calibration.record": "CalibrationFit CalibrationRecord MeasuredGeometry geometry_digest",
    "machine.clearance.collision_world": "NOTHING CollisionWorld Obstacle",
    "machine.clearance.leg_clearance": "clearances pair_names segment_distance",
    "machine.drives": "DriveForces Drives Masses",
    "machine.dynamics.dynamics": "Dynamics ForceTerms",
    "machine.identification.calibration": "Calibration calibrate",
    "machine.identification.identification": "Identified identify",
    "machine.identification.measurements": "Frame Instrument Measurements",
    "machine.identification.measurements_file": "read_measurements write_measurements",
    "machine.identification.recording": "record_of",
    "machine.leg_model": "LegModel",
    "machine.machine": "ARCHITECTURAL_LIMIT Machine load_machine read_machine",
    "machine.parts": "Bodies ControllerSettings JointLimits LegLimits Stiffness ToolLimits WorkVolume",
    "machine.reader": "shipped_machines",
    "machine.report.drift": "Drift drift",
    "machine.report.modes": "AssemblyPose AssemblyPoses admissible_modes",
    "machine.report.findings": "MachineFinding",
    "machine.report.report": "AMPLIFICATION_LIMIT MachineReport check explain",
    "machine.rigid_bodies.mjcf": "mjcf",
    "machine.rigid_bodies.sdf": "sdf",
    "machine.work_volume": "sample_work_volume",
}

if not TYPE_CHECKING:  # type checkers read the imports above
    __getattr__, __dir__, __all__ = imported_when_used(__name__, _HOMES)
