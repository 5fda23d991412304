"""PARAMETERS: the numbers of a machine's geometry that a calibration finds, by name."""

from __future__ import annotations

from pentapod.kinematics.five_legs import FiveLegs

LEGS = FiveLegs.n_legs
KINDS = ("x", "y", "z", "offset", "radius", "zero")
"""Of each leg: base joint, offset of the platform joint, radius of its ring, zero of the scale."""

PARAMETERS = tuple(f"leg {leg} {kind}" for leg in range(1, LEGS + 1) for kind in KINDS)
"""The parameters in the order of `Calibration.covariance` and of calibration files."""
