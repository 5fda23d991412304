"""Candidates: poses of the work volume that are clear of all limits, and what measuring each of them would tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.errors import InputError
from pentapod.base.values import Value
from pentapod.kinematics.robot import Branch
from pentapod.machine.calibration.record import geometry_digest
from pentapod.machine.identification.identification import believed, designed
from pentapod.machine.identification.measurements import Frame, Instrument, Measurements
from pentapod.machine.identification.observations import observations_of
from pentapod.machine.identification.sensitivity import tip_by_parameters
from pentapod.machine.machine import Machine
from pentapod.machine.work_volume import sample_work_volume
from pentapod.planning.limits.margins import Margins


@dataclass(frozen=True)
class Instruments(Value):
    """What measures, and how well. target: metres from p to the point that is seen; None: the tool's tip.

    leg_sigma, position_sigma: standard deviations of a reading and of a coordinate (or a distance), metres;
    direction_sigma: of an axis, radians. centre (3,): of a ball bar's fixed ball, machine frame, and reach: the bar's
    length from and to, metres.
    """

    instrument: Instrument = Instrument.POSE
    target: float | None = None
    leg_sigma: float = 2e-6
    position_sigma: float = 10e-6
    direction_sigma: float = 20e-6
    centre: tuple[float, float, float] | None = None
    reach: tuple[float, float] = (0.0, np.inf)


@dataclass(frozen=True)
class CandidateOptions:
    """drawn: poses of the work volume, beside those of its border. margin: smallest margin of a pose that is kept.

    rings, around, levels: of the poses at the border, and of those in which the tip shall be right
    (`sample_work_volume`).
    """

    drawn: int = 600
    margin: float = 0.05
    rings: int = 1
    around: int = 6
    levels: int = 2


@dataclass(frozen=True, eq=False)
class Candidates:
    """Tips and tool axes (N, 3), machine frame; columns (N, m, 30): what measuring them tells; tips_move (T, 3, 30)."""

    tips: Floats
    axes: Floats
    columns: Floats
    tips_move: Floats


def candidates(
    machine: Machine,
    branch: Branch,
    instruments: Instruments,
    seed: int = 0,
    options: CandidateOptions = CandidateOptions(),
) -> Candidates:
    """Return poses to choose from. Raises InputError where the instrument sees none that is clear of the limits."""
    tips, axes = _drawn(machine, seed, options)
    kept = Margins.of(machine, branch)(tips, axes).min(axis=-1) >= options.margin
    if instruments.centre is not None:
        distance = np.linalg.norm(tips - np.asarray(instruments.centre), axis=1)
        kept &= (distance >= instruments.reach[0]) & (distance <= instruments.reach[1])
    if not kept.any():
        raise InputError(
            "no pose of the work volume is clear of all limits and seen by the instrument",
            remedy='"pentapod machine check" names the limits; a ball bar needs a ball within its reach',
        )
    tips, axes = tips[kept], axes[kept]
    seen = measurements_in(machine, branch, instruments, tips, axes)
    design = believed(machine)
    observed = observations_of(seen, design)
    covariances = observed.instrument_covariances
    covariances = covariances + instruments.leg_sigma**2 * np.eye(covariances.shape[1])
    whitened = np.linalg.solve(np.linalg.cholesky(covariances), observed.columns(observed.start))
    where, along = sample_work_volume(machine.work, rings=options.rings, around=options.around, levels=options.levels)
    length = machine.tool_length
    moves = tip_by_parameters(design, where + length * along, -along, length)
    return Candidates(tips, axes, np.asarray(whitened[..., : moves.shape[-1]], dtype=np.float64), moves)


def measurements_in(
    machine: Machine, branch: Branch, instruments: Instruments, tips: Floats, axes: Floats
) -> Measurements:
    """Return what the instrument would see in poses, if the machine were as designed. Raises InputError."""
    target = machine.tool_length if instruments.target is None else instruments.target
    targets = tips + (machine.tool_length - target) * axes
    kind = instruments.instrument
    if kind is Instrument.BALLBAR:
        if instruments.centre is None:
            raise InputError("a ball bar needs its ball", key="--ball", expected="x y z of the ball's centre in mm")
        seen = np.linalg.norm(targets - np.asarray(instruments.centre), axis=1)[:, None]
    else:
        seen = np.hstack([targets, axes]) if kind.sees_axes else targets
    return Measurements(
        instrument=kind,
        legs=machine.robot.leg_lengths(tips + machine.tool_length * axes, -axes),
        seen=seen,
        target=target,
        component=branch,
        frame=Frame.MACHINE if kind is Instrument.DOCK else Frame.INSTRUMENT,
        machine=machine.name,
        digest=geometry_digest(designed(machine)),
        leg_sigma=None,
        position_sigma=instruments.position_sigma,
        direction_sigma=instruments.direction_sigma if kind.sees_axes else 0.0,
    )


def clear_way(margins: Margins, start: tuple[Floats, Floats], end: tuple[Floats, Floats], least: float) -> Bools:
    """Return for ways between poses (N, 3) whether the straight motion keeps every margin (N,)."""
    share = np.linspace(0.0, 1.0, 17)[:, None, None]
    tips, axes = (a + share * (b - a) for a, b in zip(start, end, strict=True))
    axes = axes / np.linalg.norm(axes, axis=-1, keepdims=True)
    values = margins(tips.reshape(-1, 3), axes.reshape(-1, 3)).min(axis=-1)
    return (values.reshape(len(share), -1) >= least).all(axis=0)


def _drawn(machine: Machine, seed: int, options: CandidateOptions) -> tuple[Floats, Floats]:
    """Return poses at the border of the work volume, and others in it, evenly."""
    work, rng, n = machine.work, np.random.default_rng(seed), options.drawn
    edge = sample_work_volume(work, rings=options.rings, around=options.around, levels=options.levels)
    radius, turn = 0.5 * work.diameter * np.sqrt(rng.random(n)), rng.uniform(0.0, 2.0 * np.pi, n)
    height = work.height * (rng.random(n) - 0.5)
    tips = work.centre + np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=-1)
    lean, side = work.tilt * np.sqrt(rng.random(n)), rng.uniform(0.0, 2.0 * np.pi, n)
    axes = np.stack([np.sin(lean) * np.cos(side), np.sin(lean) * np.sin(side), -np.cos(lean)], axis=-1)
    return np.vstack([edge[0], tips]), np.vstack([edge[1], axes])
