"""The text of `pentapod calibrate fit`: what was found, how well, and what could not be told."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.units import from_si
from pentapod.machine.calibration.parameters import KINDS, PARAMETERS
from pentapod.machine.identification.identification import Identified, believed
from pentapod.machine.identification.sensitivity import numbers_of
from pentapod.machine.machine import Machine

LOUD = 1.5
"""Residuals so many times as large as the given errors say are told: something is not in the model."""


def identified_lines(found: Identified, machine: Machine) -> list[str]:
    """Return the lines of the text."""
    used, made = found.measured, found.calibration
    lines = [f"machine {machine.name}, {used.instrument}: {len(used)} poses used, {len(found.outliers)} left out"]
    lines += [f"  left out: {outlier}" for outlier in found.outliers]
    lines.append(
        f"  {len(made.identified)} of {len(PARAMETERS)} numbers found; leg readings are good to {_um(made.leg_sigma)}"
    )
    if made.freedom > 0:
        loud = float(np.sqrt(made.chi_square / made.freedom))
        if loud > LOUD:
            lines.append(
                f"  the residuals are {loud:.1f} times as large as the given errors say: "
                "these are larger than given, or the machine does what the model does not hold"
            )
    lines += [f"  not told: {gauge}" for gauge in made.gauges]
    lines += [f"  held at 0: {name}" for name in made.at_bound]
    lines.append("  away from the machine's file: " + _away(found, machine))
    lines.append(f"  tip error to be expected: {_um(found.tip_sigma)} (root mean square over the work volume)")
    known = found.held_out[np.isfinite(found.held_out)]
    if known.size:
        rms = float(np.sqrt(np.square(known).mean()))
        what = f"poses that the fit did not see: {_um(rms)} off (root mean square), {_um(float(known.max()))} at worst"
        lines.append(f"  {what}; errors of the instrument are in it")
    else:
        lines.append("  poses that the fit did not see: too few poses to hold some out")
    if not made.converged:
        lines.append("  the iteration did not settle: do not use this calibration")
    return lines


def _away(found: Identified, machine: Machine) -> str:
    """Return by how much numbers differ from those of the machine's file, by kind."""
    off = np.abs(numbers_of(found.calibration.machine) - numbers_of(believed(machine))).reshape(-1, len(KINDS))
    joints: Floats = np.linalg.norm(off[:, :3], axis=1)
    offsets, rings, zeros = off[:, 3:].T
    parts = {"base joints": joints, "offsets": offsets, "rings": rings, "zeros": zeros}
    return ", ".join(f"{name} up to {float(from_si(values.max(), 'mm')):.3f} mm" for name, values in parts.items())


def _um(metres: float) -> str:
    """Return a length in micrometres, as text."""
    return f"{float(from_si(metres, 'um')):.3g} um"
