"""drift: what has moved on a machine between two calibrations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import MachineError
from pentapod.base.units import from_si
from pentapod.base.values import Value
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.machine.calibration.parameters import PARAMETERS
from pentapod.machine.calibration.record import CalibrationRecord
from pentapod.machine.identification.alignment import rigid_motion
from pentapod.machine.identification.identification import predicted_tip_sigma
from pentapod.machine.identification.sensitivity import numbers_of, poses_near
from pentapod.machine.machine import Machine
from pentapod.machine.work_volume import sample_work_volume


@dataclass(frozen=True)
class DriftOptions:
    """chance: below which changes are no chance. explained_by: numbers at most that explain them.

    regular: share of a covariance's largest variance below which one is rounding. rings, around, levels: of the poses
    in which tips are compared (`sample_work_volume`).
    """

    chance: float = 1e-3
    explained_by: int = 8
    regular: float = 1e-11
    rings: int = 2
    around: int = 8
    levels: int = 3


@dataclass(frozen=True)
class Moved(Value):
    """A number that has moved: its name, by how much, and the standard deviation of that; metres."""

    name: str
    change: float
    sigma: float

    def __str__(self) -> str:
        change, sigma = (float(from_si(value, "mm")) for value in (self.change, self.sigma))
        return f"{self.name:<14} {change:+9.4f} mm  {abs(change) / sigma:8.1f} sigma"


@dataclass(frozen=True, eq=False)
class Drift(Value):
    """The changes from one calibration to another.

    changes, sigmas (30,): of the `PARAMETERS`, metres; sigmas are NaN where one of the calibrations does not know a
    number. chance: probability of changes as large as all of these together if nothing has moved; NaN without
    covariances. moved: the fewest numbers whose changes explain it, as errors of numbers hang together: a change of one
    of them shows in many. left: probability of what they leave. tips (T, 3): of the work volume, metres; tip_changes
    (T, 3): how far the tip is from there now if the legs are set by the first calibration; tip_sigma: root mean square
    that errors of both calibrations explain. apart_from_frame (T, 3): tip_changes without the rigid motion common to
    all, which may be the instrument's frame; bent_sigma: what errors explain of it.
    """

    first: CalibrationRecord
    second: CalibrationRecord
    changes: Floats
    sigmas: Floats
    chance: float
    moved: tuple[Moved, ...]
    left: float
    tips: Floats
    tip_changes: Floats
    tip_sigma: float
    apart_from_frame: Floats
    bent_sigma: float

    @property
    def largest(self) -> float:
        """The largest change of a tip, metres."""
        return float(np.linalg.norm(self.tip_changes, axis=1).max())


def drift(
    first: CalibrationRecord, second: CalibrationRecord, machine: Machine, options: DriftOptions | None = None
) -> Drift:
    """Return what has moved from the first calibration to the second. machine: of both, for its work volume.

    Raises MachineError where the calibrations are of two machines, or of another one than `machine`.
    """
    options = options or DriftOptions()
    if (first.machine, first.nominal) != (second.machine, second.nominal):
        raise MachineError(
            "the calibrations are of two machines", value=f"{first.machine} {first.nominal}",
            expected=f"{second.machine} {second.nominal}", remedy="compare two calibrations of one machine",
        )  # fmt: skip
    design = machine.robot.nominal if isinstance(machine.robot, AsBuiltPentapod) else machine.robot
    if design is None:
        raise MachineError("a machine as built has poses only beside its nominal geometry", key="nominal")
    one, other = first.as_built(design), second.as_built(design)
    changes = numbers_of(other) - numbers_of(one)
    covariance, known = np.zeros((len(PARAMETERS), len(PARAMETERS))), np.zeros(len(PARAMETERS), dtype=bool)
    if first.fit is not None and second.fit is not None:
        covariance = first.fit.covariance + second.fit.covariance
        both = set(first.fit.identified) & set(second.fit.identified)
        known = np.array([name in both for name in PARAMETERS])
    chance, moved, left = _explained(changes, covariance, np.flatnonzero(known), options)
    tips, axes = sample_work_volume(machine.work, rings=options.rings, around=options.around, levels=options.levels)
    p, i, length = tips + machine.tool_length * axes, -axes, machine.tool_length
    now = poses_near(other, one.leg_lengths(p, i), p, i)
    reached = now[0] + length * now[1]
    sigmas = [predicted_tip_sigma(one, covariance, machine, free_frame=free) for free in (False, True)]
    tip_sigma, bent_sigma = sigmas if known.any() else (float("nan"), float("nan"))
    return Drift(
        first=first,
        second=second,
        changes=changes,
        sigmas=np.where(known, np.sqrt(np.diagonal(covariance)), np.nan),
        chance=chance,
        moved=moved,
        left=left,
        tips=tips,
        tip_changes=reached - tips,
        tip_sigma=tip_sigma,
        bent_sigma=bent_sigma,
        apart_from_frame=rigid_motion(reached, tips).apply(reached) - tips,
    )


def _explained(
    changes: Floats, covariance: Floats, known: Ints, options: DriftOptions
) -> tuple[float, tuple[Moved, ...], float]:
    """Return the chance of the changes, the fewest numbers that explain them, one after the other, and what is left."""
    if not known.size:
        return float("nan"), (), float("nan")
    information, count = _information(covariance[np.ix_(known, known)], options)
    pull, change = information @ changes[known], changes[known]
    total = float(change @ pull)
    chance = left = float(chdtrc(count, total))
    chosen: list[int] = []
    found: tuple[Moved, ...] = ()
    while left < options.chance and len(chosen) < min(options.explained_by, count - 1):
        trials = [[*chosen, k] for k in range(len(known)) if k not in chosen]
        gains = [float(pull[some] @ np.linalg.solve(information[np.ix_(some, some)], pull[some])) for some in trials]
        chosen = trials[int(np.argmax(gains))]
        spread = np.linalg.inv(information[np.ix_(chosen, chosen)])
        steps, sigmas = spread @ pull[chosen], np.sqrt(np.diagonal(spread))
        found = tuple(
            Moved(PARAMETERS[known[k]], float(step), float(sigma))
            for k, step, sigma in zip(chosen, steps, sigmas, strict=True)
        )
        left = float(chdtrc(count - len(chosen), max(total - max(gains), 0.0)))
    return chance, found, left


def _information(covariance: Floats, options: DriftOptions) -> tuple[Floats, int]:
    """Return the pseudo-inverse of a covariance, and its rank: a frame that is defined by the machine has no errors."""
    scale = 1.0 / np.sqrt(np.diagonal(covariance))
    values, vectors = np.linalg.eigh(scale[:, None] * covariance * scale)
    some = values > options.regular * values[-1]
    half = (vectors[:, some] / np.sqrt(values[some])) * scale[:, None]
    return half @ half.T, int(some.sum())


def drift_text(found: Drift) -> str:
    """Return the text of `pentapod machine drift`."""

    def mm(metres: float) -> float:
        return float(from_si(metres, "mm"))

    def root_mean_square(vectors: Floats) -> float:
        return mm(float(np.sqrt(np.square(vectors).sum(axis=1).mean())))

    lines = [f"machine {found.first.machine}: {found.first.date} to {found.second.date}"]
    order = np.argsort(-np.abs(found.changes), kind="stable")
    if np.isnan(found.chance):
        lines.append("  what moved is not said: the files hold no covariances of the same numbers")
    elif not found.moved:
        lines.append(f"  nothing has moved that errors of measuring do not explain (chance {found.chance:.2g})")
    else:
        lines += ["  something has moved; the fewest numbers that explain it:", *(f"    {one}" for one in found.moved)]
        if found.left < DriftOptions().chance:
            lines.append("    they do not explain all: many numbers have changed, as after assembly")
    unknown = [k for k in order if np.isnan(found.sigmas[k]) and found.changes[k] != 0.0]
    if unknown:
        names = ", ".join(f"{PARAMETERS[k]} {mm(float(found.changes[k])):+.4f} mm" for k in unknown[:6])
        lines.append(f"  changed, but not known in both: {names}{', ...' if len(unknown) > 6 else ''}")
    worst = int(np.argmax(np.linalg.norm(found.tip_changes, axis=1)))
    where = ", ".join(f"{x:.0f}" for x in from_si(found.tips[worst], "mm"))
    explained, bent = (
        "" if np.isnan(sigma) else f"; errors of measuring explain {mm(sigma):.4f} mm"
        for sigma in (found.tip_sigma, found.bent_sigma)
    )
    lines += [
        f"  tip, with the legs of the first: {root_mean_square(found.tip_changes):.4f} mm off "
        f"(root mean square){explained}",
        f"    worst {mm(found.largest):.4f} mm at ({where}) mm",
        "    without what moves the work volume as a whole, as another frame would: "
        f"{root_mean_square(found.apart_from_frame):.4f} mm{bent}",
    ]
    return "\n".join(lines)
