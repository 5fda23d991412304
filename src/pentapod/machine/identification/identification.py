"""identify: a machine's geometry from the measurements of an instrument, with held-out errors and outliers."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ArrayError, InputError, MachineError
from pentapod.base.values import Value
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.families.as_built_forward import Nominal
from pentapod.machine.calibration.parameters import PARAMETERS
from pentapod.machine.calibration.record import geometry_digest
from pentapod.machine.identification.alignment import in_base_frame, rigid_motions
from pentapod.machine.identification.calibration import Calibration, calibration_of, checked_groups
from pentapod.machine.identification.least_squares import GROUPS, Solution, solved
from pentapod.machine.identification.measurements import Frame, Instrument, Measurements
from pentapod.machine.identification.observations import Observations, in_machine_frame, observations_of
from pentapod.machine.identification.outliers import Outlier, without_outliers
from pentapod.machine.identification.pose_choice import Tolerances
from pentapod.machine.identification.sensitivity import tip_by_parameters
from pentapod.machine.identification.suspicions import check_measurements, name_better_reading
from pentapod.machine.machine import Machine
from pentapod.machine.work_volume import sample_work_volume

FREE_MOTIONS = 6
"""A ball bar cannot tell how the machine stands to the ball: so many numbers define the frame."""


@dataclass(frozen=True)
class IdentifyOptions:
    """limit: metres; a parameter that is known no better stays nominal. folds: parts that are held out in turn.

    spare: numbers that must be measured beyond those that are to be found. few_docks: docks up to which only zeros are
    looked for unless more is asked for. tolerances: of building, for what is not found.
    """

    limit: float = 5e-3
    folds: int = 5
    spare: int = 3
    few_docks: int = 9
    tolerances: Tolerances = field(default_factory=Tolerances)


@dataclass(frozen=True, eq=False)
class Identified(Value):
    """The outcome of `identify`.

    measured: the poses that were used. outliers: those that were left out. held_out (N,): error of each used pose when
    it is predicted from a fit without it: at the tip, metres, of a ball bar in the distance; NaN where too few poses
    are left for that. tip_sigma: root mean square over the work volume of the tip's error that is to be expected: from
    the covariance, and from the tolerances of building of what was not found; metres.
    """

    calibration: Calibration
    measured: Measurements
    outliers: tuple[Outlier, ...]
    held_out: Floats
    tip_sigma: float


def identify(
    measured: Measurements,
    machine: Machine,
    *,
    groups: Collection[str] = (),
    keep_outliers: bool = False,
    file: str | Path | None = None,
    options: IdentifyOptions = IdentifyOptions(),
) -> Identified:
    """Return the geometry that fits measurements of a machine best, how well it is known, and what was left out.

    groups: of parameters to find, from "base", "offsets", "zeros", "radii"; by default all, of a few docks the zeros.
    keep_outliers: whether poses that contradict all others are used, too. file: of the measurements, for messages.

    Raises MachineError where the measurements are of another machine, in other units, with swapped legs or reversed
    axes, or fewer than the unknowns; also for unknown groups.
    """
    design = believed(machine)
    digest = geometry_digest(designed(machine))
    if measured.digest != digest:
        raise MachineError(
            f'the measurements are of another geometry: "{measured.machine}" as it was designed then', key="nominal",
            value=measured.digest, expected=digest, remedy="name the machine whose poses were measured", file=file,
        )  # fmt: skip
    try:
        return _identified(measured, machine, design, groups, file, options, keep_outliers=keep_outliers)
    except ArrayError as error:
        with suppress(ArrayError):  # poses in which no other reading can be tried
            name_better_reading(measured, design, file)
        raise MachineError(
            error.what, file=file, key=error.key, value=error.value, expected=error.expected, remedy=error.remedy
        ) from error


def _identified(
    measured: Measurements,
    machine: Machine,
    design: AsBuiltPentapod,
    groups: Collection[str],
    file: str | Path | None,
    options: IdentifyOptions,
    *,
    keep_outliers: bool,
) -> Identified:
    """Return what `identify` does. Raises MachineError, and ArrayError that names no file."""
    check_measurements(measured, design, machine.legs, file)
    free_frame = measured.frame is Frame.INSTRUMENT or measured.instrument is Instrument.BALLBAR
    measured = in_machine_frame(measured, design)
    few = measured.instrument is Instrument.DOCK and len(measured) <= options.few_docks
    wanted = checked_groups(groups or (("zeros",) if few else GROUPS))
    _check_count(measured, design, wanted, options, file)

    def fit(some: Measurements) -> tuple[Observations, Solution]:
        seen = observations_of(some, design)
        return seen, solved(seen, wanted, measured.leg_sigma, options.limit)

    used, outliers = (measured, ()) if keep_outliers else without_outliers(measured, fit)
    seen, solution = fit(used)
    found = calibration_of(seen, design, solution)
    held_out = _held_out(used, design, wanted, found.leg_sigma, options)
    covariance = with_tolerances(seen, solution, options.tolerances)
    tip_sigma = predicted_tip_sigma(found.machine, covariance, machine, free_frame=free_frame)
    found = _in_base_frame(found, design) if free_frame else found
    return Identified(found, used, outliers, held_out, tip_sigma)


def believed(machine: Machine) -> AsBuiltPentapod:
    """Return the geometry that a machine's file gives, as designed or as calibrated before: where a fit starts.

    Raises MachineError: it is no linear pentapod.
    """
    design = designed(machine)
    return machine.robot if isinstance(machine.robot, AsBuiltPentapod) else AsBuiltPentapod.of(design)


def designed(machine: Machine) -> Nominal:
    """Return a machine's geometry as designed. Raises MachineError: it is no linear pentapod."""
    robot = machine.robot.nominal if isinstance(machine.robot, AsBuiltPentapod) else machine.robot
    if not isinstance(robot, Nominal):
        family = type(machine.robot).__name__
        raise MachineError("calibration is for linear pentapods", key="geometry.family", value=family)
    if machine.guides is not None:
        raise MachineError("a machine with guides cannot be calibrated", key="guides", expected="fixed base joints")
    return robot


def _in_base_frame(found: Calibration, design: AsBuiltPentapod) -> Calibration:
    """Return a calibration with a free frame as the base joints define it best.

    A ball bar leaves six of their coordinates open, which the frame alone decides: then these are no ambiguity. Where
    more is open it stays as it is.
    """
    base = [name for name in PARAMETERS if name[-1] in "xyz"]
    held = [name for name in found.held if name in base]
    if design.nominal is None or len(held) not in (0, FREE_MOTIONS) or len(held) == len(base):
        return found
    frame = [f"{': '.join(name.rsplit(' ', 1))} +1" for name in held]
    machine, covariance = in_base_frame(found.machine, found.covariance, design.nominal.base_joints)
    return dataclasses.replace(
        found,
        machine=machine,
        covariance=covariance,
        identified=tuple(name for name in PARAMETERS if name in found.identified or name in held),
        held=tuple(name for name in found.held if name not in held),
        gauges=tuple(gauge for gauge in found.gauges if not gauge.startswith(tuple(frame))),
    )


def with_tolerances(seen: Observations, found: Solution, tolerances: Tolerances) -> Floats:
    """Return the covariance (30, 30) of a machine whose numbers that were not found are only built within tolerances.

    Errors of these are taken up by the numbers that were found: as far as poses cannot tell them apart, they cancel.
    """
    count = len(PARAMETERS)
    held = [k for k in range(count) if k not in found.inner and k not in found.bound]
    covariances = seen.instrument_covariances + found.leg_sigma**2 * np.eye(found.residuals.shape[1])
    whitened = np.linalg.solve(np.linalg.cholesky(covariances), seen.columns(found.theta))
    a = whitened.reshape(-1, whitened.shape[-1])
    taken = (found.covariance @ (a.T @ a[:, held]))[:count]
    taken[held] -= np.eye(len(held))
    return found.covariance[:count, :count] + (taken * tolerances.sigmas[held] ** 2) @ taken.T


def predicted_tip_sigma(
    built: AsBuiltPentapod, covariance: Floats, machine: Machine, *, free_frame: bool = False
) -> float:
    """Return the root mean square over the work volume of the tip's error that the covariance predicts, metres.

    free_frame: a rigid motion of all tips is no error, as the instrument does not know the machine's frame.
    """
    tips, axes = sample_work_volume(machine.work, rings=2, around=8, levels=3)
    moves = tip_by_parameters(built, tips + machine.tool_length * axes, -axes, machine.tool_length)
    moves = moves.reshape(-1, moves.shape[-1])
    if free_frame:
        rigid = np.linalg.qr(rigid_motions(tips))[0]
        moves = moves - rigid @ (rigid.T @ moves)
    return float(np.sqrt(np.einsum("aj,jk,ak->", moves, covariance, moves) / len(tips)))


def _check_count(
    measured: Measurements,
    design: AsBuiltPentapod,
    wanted: tuple[str, ...],
    options: IdentifyOptions,
    file: str | Path | None = None,
) -> None:
    """Raise MachineError where fewer numbers were measured than are to be found."""
    kinds = [kind for group in wanted for kind in GROUPS[group]]
    unknowns = sum(name.split()[-1] in kinds for name in PARAMETERS) + len(observations_of(measured, design).extras)
    unknowns -= FREE_MOTIONS if measured.instrument is Instrument.BALLBAR and "base" in wanted else 0
    if measured.equations >= unknowns + options.spare:
        return
    each = measured.equations // len(measured)
    needed = -(-(unknowns + options.spare) // each)
    raise MachineError(
        f"{len(measured)} poses tell {measured.equations} numbers, {unknowns} are to be found",
        file=file,
        expected=f"at least {needed} poses",
        remedy='measure more poses, or find less, as "--find zeros" does',
    )


def _held_out(
    measured: Measurements,
    design: AsBuiltPentapod,
    wanted: tuple[str, ...],
    leg_sigma: float,
    options: IdentifyOptions,
) -> Floats:
    """Return the errors (N,) of poses that are predicted from a fit to those of the other folds, metres."""
    errors = np.full(len(measured), np.nan)
    seen = observations_of(measured, design)
    fold = np.arange(len(measured)) % options.folds
    for k in range(min(options.folds, len(measured))):
        rest = measured.some(fold != k)
        if set(rest.setups) != set(measured.setups):
            continue
        try:
            _check_count(rest, design, wanted, options)
            found = solved(observations_of(rest, design), wanted, leg_sigma, options.limit)
        except InputError:
            continue
        residuals = seen.residuals(found.theta)
        for pose in np.flatnonzero(fold == k):
            errors[pose] = seen.off(residuals[pose], int(pose))
    return errors
