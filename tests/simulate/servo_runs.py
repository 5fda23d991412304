"""Short runs of the servo simulation on the shipped machine."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from pentapod.simulate import Reference, contour_errors, simulate_servo

sys.path.append(str(Path(__file__).parents[1]))
from short_motion import motion

LINEAR = {"encoder_step": 0.0, "ripple_force": 0.0, "dead_time": 0.0}


def played(duration=1.2, interpolation="cubic", correct=False, seed=0, **drives):
    """Play the short motion, or a program that is given in place of its duration."""
    program, machine = motion(duration, interpolation) if isinstance(duration, float) else (duration, motion(0.1)[1])
    reference = Reference(program, replace(machine, drives=replace(machine.drives, **drives)))
    return simulate_servo(reference, seed=seed, correct=correct), reference


def contour(result, reference):
    """Contour errors of tip and axis at the rows."""
    rows = 2 * np.arange(len(result.tips))
    return contour_errors(result.tips, result.directions, reference.tips, reference.directions, rows, 60)
