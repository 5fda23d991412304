"""Kinematic calibration: the geometry of a machine from measured poses and the leg readings at them.

Each leg has six unknowns: its base joint (x, y, z), the offset of its platform joint, the radius of its ring and the
zero of its scale. The instrument defines the frame: a common error of its frame shows as moved base joints, one of the
point p on the line as equal changes of all offsets. Parameters that the measured poses cannot distinguish stay at their
nominal values, and are named.

The fit is generalised least squares: errors of a measured pose enter all readings, so they are weighted by the
readings' covariance Σ = σ_l² 1 + σ_p² J_p J_pᵀ + σ_i² J_i J_iᵀ at each pose, J = `jacobian` of the nominal machine with
J_i restricted to changes of a unit direction. Where σ_l is not given, `leg_noise` estimates it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats
from pentapod.base.errors import ArrayError, nearest
from pentapod.base.values import Value
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.machine.calibration.parameters import LEGS, PARAMETERS
from pentapod.machine.identification.least_squares import GROUPS, Solution, solved
from pentapod.machine.identification.observations import Observations, PoseObservations
from pentapod.machine.identification.sensitivity import machine_of


@dataclass(frozen=True, eq=False)
class Calibration(Value):
    """The result of a calibration.

    machine: the geometry; parameters that could not be identified are nominal. covariance (30, 30): of the
    `PARAMETERS`, m²; rows of held ones are zero. identified, held: their names. gauges: for each parameter that the
    poses cannot distinguish from others, which changes together change no reading. at_bound: radii that the fit would
    make negative, held at 0. residuals (N, 5): readings minus those of the machine, metres; of partial measurements the
    smallest errors of the readings that would explain them. leg_sigma: metres, as given or as estimated from the
    residuals. chi_square: sum of squares of the whitened residuals; freedom: its expected value. converged: whether the
    iteration has converged. extras: the further unknowns of partial measurements (`Observations.extras`), metres and
    radians: where the balls stand, how later set-ups stand to the first.
    """

    machine: AsBuiltPentapod
    covariance: Floats
    identified: tuple[str, ...]
    held: tuple[str, ...]
    gauges: tuple[str, ...]
    at_bound: tuple[str, ...]
    residuals: Floats
    leg_sigma: float
    chi_square: float
    freedom: int
    converged: bool
    extras: Floats = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        for array in (self.covariance, self.residuals, self.extras):
            array.flags.writeable = False

    def sigma(self, parameter: str) -> float:
        """Return the standard deviation of one of the `PARAMETERS`, metres; 0 where it is held. Raises ArrayError."""
        if parameter not in PARAMETERS:
            raise ArrayError("unknown parameter", value=parameter, remedy=nearest(parameter, PARAMETERS))
        k = PARAMETERS.index(parameter)
        return float(np.sqrt(self.covariance[k, k]))


def calibrate(
    position: ArrayLike,
    direction: ArrayLike,
    legs: ArrayLike,
    nominal: AsBuiltPentapod | FiveLegs,
    *,
    leg_sigma: float | None = None,
    position_sigma: float = 0.0,
    direction_sigma: float = 0.0,
    identify: Collection[str] = ("base", "offsets", "radii", "zeros"),
    limit: float = 5e-3,
) -> Calibration:
    """Return the machine that fits measured poses (N, 3), unit directions (N, 3) and leg readings (N, 5) best.

    Metres, machine frame. The sigmas are standard deviations: of each reading (metres; estimated from the residuals
    where None), of each coordinate of a measured position (metres), of a direction to either side (radians). identify:
    groups of parameters; the others are nominal. limit: metres; a parameter whose standard deviation, with those before
    it known, exceeds this is not identified.

    Raises ArrayError: wrong shapes, numbers that are not finite, directions that are not unit vectors, sigmas that are
    negative or all zero, unknown groups, too few readings to estimate leg_sigma from.
    """
    p, i, readings = _measured(position, direction, legs)
    sigmas = {"leg_sigma": leg_sigma, "position_sigma": position_sigma, "direction_sigma": direction_sigma}
    for name, value in sigmas.items():
        if value is not None and not (np.isfinite(value) and value >= 0.0):
            raise ArrayError(f"{name} must not be negative", value=value)
    if leg_sigma == 0.0 and (position_sigma == 0.0 or direction_sigma == 0.0):
        raise ArrayError("without errors of the legs, both those of positions and directions must be given")
    start = nominal if isinstance(nominal, AsBuiltPentapod) else AsBuiltPentapod.of(nominal)
    seen = PoseObservations(p, i, readings, start, position_sigma, direction_sigma)
    return calibration_of(seen, start, solved(seen, checked_groups(identify), leg_sigma, limit))


def checked_groups(identify: Collection[str]) -> tuple[str, ...]:
    """Return the groups of parameters in the order of identification. Raises ArrayError for unknown ones."""
    for group in identify:
        if group not in GROUPS:
            raise ArrayError("unknown group of parameters", value=group, remedy=nearest(group, GROUPS))
    return tuple(group for group in GROUPS if group in identify)


def calibration_of(seen: Observations, start: AsBuiltPentapod, found: Solution) -> Calibration:
    """Return the calibration that a solution stands for; start: the machine from which it was found."""
    count = len(PARAMETERS)
    return Calibration(
        machine=machine_of(found.theta, start),
        covariance=found.covariance[:count, :count].copy(),
        identified=tuple(PARAMETERS[k] for k in sorted(found.inner) if k < count),
        held=tuple(name for k, name in enumerate(PARAMETERS) if k not in found.inner),
        gauges=found.gauges,
        at_bound=tuple(PARAMETERS[k] for k in found.bound),
        residuals=seen.in_legs(found.residuals),
        leg_sigma=found.leg_sigma,
        chi_square=found.chi_square,
        freedom=found.freedom,
        converged=found.converged,
        extras=found.theta[count:].copy(),
    )


def _measured(position: ArrayLike, direction: ArrayLike, legs: ArrayLike) -> tuple[Floats, Floats, Floats]:
    p, i = as_floats(position, "position", (None, 3)), as_floats(direction, "direction", (None, 3))
    readings = as_floats(legs, "legs", (None, LEGS))
    for name, array, width in (("position", p, 3), ("direction", i, 3), ("legs", readings, LEGS)):
        if array.shape != (len(p), width):
            expected = f"shape ({len(p)}, {width}): one row for each pose"
            raise ArrayError(f"{name} has shape {array.shape}", expected=expected)
    if len(p) == 0:
        raise ArrayError("there are no poses to calibrate from", key="position", expected="one row for each pose")
    lengths = np.linalg.norm(i, axis=1)
    worst = int(np.abs(lengths - 1.0).argmax())
    if abs(lengths[worst] - 1.0) > 1e-6:
        what = f"direction {worst} is not a unit vector"
        raise ArrayError(what, key="direction", value=float(lengths[worst]), expected="length 1")
    return p, i / lengths[:, None], readings
