"""Calibration: the geometry of a machine from measured poses."""
