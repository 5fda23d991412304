"""Clearances: distances between legs, spindle, tool and obstacles."""
