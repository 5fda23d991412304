"""The part where it is clamped: found by touches, planned again, and jobs with its placement."""
