"""What is wrong with measurements as a whole: units, order of the legs, component, reversed axes, another machine."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ArrayError, InputError, MachineError
from pentapod.base.units import from_si
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.machine.calibration.parameters import LEGS
from pentapod.machine.identification.alignment import FEWEST, ball_centre, rigid_motion
from pentapod.machine.identification.measurements import Frame, Instrument, Measurements
from pentapod.machine.identification.sensitivity import poses_near
from pentapod.machine.parts import LegLimits


@dataclass(frozen=True)
class SuspicionOptions:
    """largest_error: of the tip, metres, that errors of building may cause; beyond it something else is wrong.

    better: share of the error to which another reading of the file must bring it to be named where no geometry fits.
    slack: share of a leg's longest length by which readings may be beyond the strokes. units: what a number would be in
    millimetres.
    """

    largest_error: float = 0.015
    better: float = 0.5
    slack: float = 0.25
    units: tuple[tuple[str, float], ...] = (("metres", 1e3), ("micrometres", 1e-3), ("inches", 25.4))


def check_measurements(
    measured: Measurements,
    machine: AsBuiltPentapod,
    legs: LegLimits,
    file: str | Path | None = None,
    options: SuspicionOptions = SuspicionOptions(),
) -> None:
    """Raise MachineError where measurements cannot be of this machine as they stand: what is wrong, and the remedy.

    Tried are other units, swapped legs, another component, reversed tool axes. Single wrong poses are no reason: half
    of them must be wrong.
    """
    _check_lengths(measured, legs, file, options)
    if _mismatch(measured, machine) <= options.largest_error:
        return
    for what, remedy, other in _hypotheses(measured, machine, options):
        if _mismatch(other(), machine) <= options.largest_error:
            raise MachineError(what, file=file, remedy=remedy)
    off = _mismatch(measured, machine)
    raise MachineError(
        "the measurements do not fit this machine: half of the poses are farther off than the machine's file says",
        file=file,
        value=f"{float(from_si(off, 'mm')):.4g} mm" if np.isfinite(off) else "no such poses",
        expected=f"at most {float(from_si(options.largest_error, 'mm')):.4g} mm",
        remedy="check machine, component, target_mm, frame, and which leg is which",
    )


def name_better_reading(
    measured: Measurements,
    machine: AsBuiltPentapod,
    file: str | Path | None = None,
    options: SuspicionOptions = SuspicionOptions(),
) -> None:
    """Raise MachineError where another reading of measurements that no geometry fits comes much nearer to the machine.

    Distances alone may seem to fit in a wrong component, to within the errors of building.
    """
    hypotheses = _hypotheses(measured, machine, options)
    errors = [_mismatch(other(), machine) for _, _, other in hypotheses]
    if min(errors) > options.better * _mismatch(measured, machine):
        return
    # To distances a pose and its mirror image are alike: both are named.
    best = [hypothesis for hypothesis, error in zip(hypotheses, errors, strict=True) if error <= 1.001 * min(errors)]
    raise MachineError(best[0][0], file=file, remedy=", or ".join(remedy for _, remedy, _ in best))


def _check_lengths(measured: Measurements, legs: LegLimits, file: str | Path | None, options: SuspicionOptions) -> None:
    """Raise MachineError where half of the readings are far beyond the strokes."""
    low, high = float(legs.min_length.min()), float(legs.max_length.max())
    slack, middle = options.slack * high, float(np.median(measured.legs))
    if low - slack <= middle <= high + slack:
        return
    value = f"{float(from_si(middle, 'mm')):.6g} mm for most legs"
    expected = f"{float(from_si(low, 'mm')):.4g} to {float(from_si(high, 'mm')):.4g} mm"
    details: dict[str, Any] = {"file": file, "key": "leg1_mm", "value": value, "expected": expected}
    for unit, size in options.units:
        if low - slack <= middle * size <= high + slack:
            raise MachineError(f"the legs look like {unit}", **details, remedy="write millimetres")
    raise MachineError("the legs are not those of this machine", **details)


_Hypothesis = tuple[str, str, Callable[[], Measurements]]


def _hypotheses(measured: Measurements, machine: AsBuiltPentapod, options: SuspicionOptions) -> list[_Hypothesis]:
    """Return other readings of the same file: what it would mean, the remedy, and the measurements so read."""
    seen, found = measured.seen, list[_Hypothesis]()
    column = "x_mm" if measured.instrument.sees_positions else "distance_mm"
    for unit, size in options.units:
        scale = np.ones(seen.shape[1])
        scale[:3] = size
        found.append(
            (
                f"{column}: what the instrument saw looks like {unit}",
                "write millimetres",
                _other(measured, seen * scale),
            )
        )
    if measured.instrument.sees_axes:
        turned = np.hstack([seen[:, :3], -seen[:, 3:]])
        what = "the tool axes point the wrong way"
        found.append((what, "i, j, k point from the tip to the spindle: change their signs", _other(measured, turned)))
    for order in sorted(permutations(range(LEGS)), key=lambda order: sum(k != o for k, o in enumerate(order))):
        moved = [k for k, other in enumerate(order) if k != other]
        if moved:
            names = " and ".join(str(k + 1) for k in moved) if len(moved) == 2 else ", ".join(str(k + 1) for k in moved)
            right = ", ".join(f"leg{k + 1}_mm holds leg {order.index(k) + 1}" for k in moved)
            other = measured.legs[:, list(order)]
            found.append((f"legs {names} are swapped", right, lambda other=other: measured.with_legs(other)))
    for branch in machine.nominal.branches if machine.nominal is not None else ():
        if branch != measured.component:
            what = f'the poses are in component "{branch}", the file says "{measured.component}"'
            other_branch = dataclasses.replace(measured, component=branch)
            found.append((what, f'write component = "{branch}"', lambda other=other_branch: other))
    return found


def _other(measured: Measurements, seen: Floats) -> Callable[[], Measurements]:
    return lambda: dataclasses.replace(measured, seen=seen)


def _mismatch(measured: Measurements, machine: AsBuiltPentapod) -> float:
    """Return the median distance between what was seen and the nominal poses of the readings, metres; infinite if none.

    A frame of the instrument's own and the place of a ball are fitted; of axes the angle counts, at the target's lever.
    """
    if machine.nominal is None:
        return np.inf
    try:
        p, i = machine.nominal.pose(np.maximum(measured.legs - machine.zeros, 1e-3), measured.component)
    except InputError:
        return np.inf
    if machine.radii.any():  # else the nominal pose is near enough to compare
        p, i = poses_near(machine, measured.legs, p, i)
    off = np.full(len(measured), np.inf)
    targets = p + measured.target * i
    for setup in np.unique(measured.setups):
        rows = (measured.setups == setup) & np.isfinite(targets).all(axis=1)
        if rows.sum() <= (0 if measured.instrument.sees_axes else FEWEST):
            continue
        off[rows] = _off(measured.some(rows), targets[rows], i[rows], first=setup == 0)
    return float(np.median(off))


def _off(measured: Measurements, targets: Floats, direction: Floats, *, first: bool) -> Floats:
    """Return how far poses (n,) of one set-up are from the nominal ones, metres."""
    if measured.instrument is Instrument.BALLBAR:
        try:
            centre = ball_centre(targets, measured.seen[:, 0])
        except ArrayError:
            return np.full(len(measured), np.inf)
        return np.abs(np.linalg.norm(targets - centre, axis=1) - measured.seen[:, 0])
    positions, axes = measured.seen[:, :3], measured.seen[:, 3:]
    if (measured.frame is Frame.INSTRUMENT or not first) and len(positions) >= FEWEST:
        motion = rigid_motion(positions, targets)
        positions, axes = motion.apply(positions), motion.rotate(axes) if axes.size else axes
    off = np.linalg.norm(positions - targets, axis=1)
    if axes.size:
        off = np.maximum(off, measured.target * np.linalg.norm(axes + direction, axis=1))
    return off
