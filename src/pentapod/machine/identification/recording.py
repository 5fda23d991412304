"""record_of: what a calibration found, as a record for a file."""

from __future__ import annotations

import datetime

from pentapod.kinematics.robot import Robot
from pentapod.machine.calibration.record import CalibrationFit, CalibrationRecord, MeasuredGeometry, geometry_digest
from pentapod.machine.identification.calibration import Calibration


def record_of(found: Calibration, machine: str, nominal: Robot, date: datetime.date) -> CalibrationRecord:
    """Return the record of a calibration. machine: name of the nominal one; date: of the measurement."""
    real = found.machine
    covariance = 0.5 * (found.covariance + found.covariance.T)
    return CalibrationRecord(
        machine,
        geometry_digest(nominal),
        date,
        MeasuredGeometry(real.base, real.offsets, real.radii, real.zeros),
        CalibrationFit(found.identified, found.leg_sigma, covariance, found.residuals),
    )
