"""The page on a calibration."""
