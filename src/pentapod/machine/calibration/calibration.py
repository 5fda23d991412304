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
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats
from pentapod.base.errors import ArrayError, nearest
from pentapod.base.values import Value
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.machine.calibration.leg_noise import restricted_sigma
from pentapod.machine.calibration.parameters import KINDS, LEGS, PARAMETERS

_EACH, _RADIUS, _ZERO = len(KINDS), KINDS.index("radius"), KINDS.index("zero")
"""Numbers of each leg; the places of radius and zero among them."""

_GROUPS = {"base": (0, 1, 2), "offsets": (3,), "zeros": (_ZERO,), "radii": (_RADIUS,)}  # in order of identification


@dataclass(frozen=True)
class CalibrationOptions:
    """When the iterations end.

    rounds: Gauss-Newton steps at most. settled: relative change of the parameters below which they end. noise_rounds:
    fits at most while leg_sigma is estimated; same_noise: its relative change below which they end. first_sigma: the
    first leg_sigma, metres. dependent: share of a column's length left beside the other columns that counts as rounding
    and curvature. negligible: smaller coefficients are not named in a gauge.
    """

    rounds: int = 50
    settled: float = 1e-13
    noise_rounds: int = 12
    same_noise: float = 1e-3
    first_sigma: float = 1e-6
    dependent: float = 1e-7
    negligible: float = 5e-3


OPTIONS = CalibrationOptions()


@dataclass(frozen=True, eq=False)
class Calibration(Value):
    """The result of a calibration.

    machine: the geometry; parameters that could not be identified are nominal. covariance (30, 30): of the
    `PARAMETERS`, m²; rows of held ones are zero. identified, held: their names. gauges: for each parameter that the
    poses cannot distinguish from others, which changes together change no reading. at_bound: radii that the fit would
    make negative, held at 0. residuals (N, 5): readings minus those of the machine, metres. leg_sigma: metres, as given
    or as estimated from the residuals. chi_square: sum of squares of the whitened residuals; freedom: its expected
    value. converged: whether the iteration has converged.
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

    def __post_init__(self) -> None:
        self.covariance.flags.writeable = False
        self.residuals.flags.writeable = False

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
    for group in identify:
        if group not in _GROUPS:
            raise ArrayError("unknown group of parameters", value=group, remedy=nearest(group, _GROUPS))
    wanted = [k for group, kinds in _GROUPS.items() if group in identify for k in kinds]
    start = nominal if isinstance(nominal, AsBuiltPentapod) else AsBuiltPentapod.of(nominal)
    fit = _Fit(p, i, readings, start, position_sigma, direction_sigma)
    if leg_sigma is not None:
        return fit.run(wanted, leg_sigma, limit, known=True)
    guess = last = OPTIONS.first_sigma
    for _ in range(OPTIONS.noise_rounds):  # the estimate decides what is identified, and that changes the estimate
        guess, last = fit.run(wanted, guess, limit, known=False).leg_sigma, guess
        if abs(guess - last) <= OPTIONS.same_noise * guess:
            break
    else:
        guess = max(guess, last)
    return fit.run(wanted, guess, limit, known=True)


class _Fit:
    """The measurements, and least squares on them."""

    def __init__(self, p: Floats, i: Floats, readings: Floats, start: AsBuiltPentapod, s_p: float, s_i: float) -> None:
        self.p, self.i, self.readings, self.start = p, i, readings, start
        jacobian = start.jacobian(p, i)
        by_p, by_i = jacobian[..., :3], jacobian[..., 3:]
        by_i = by_i - np.einsum("nkc,nc->nk", by_i, i)[..., None] * i[:, None]
        # Covariances (N, 5, 5) of the readings that the errors of the measured poses alone would give.
        self.pose_covariances = s_p**2 * by_p @ by_p.swapaxes(1, 2) + s_i**2 * by_i @ by_i.swapaxes(1, 2)

    def run(self, wanted: list[int], leg_sigma: float, limit: float, *, known: bool) -> Calibration:
        """Fit the wanted kinds of parameters. known: whether leg_sigma is given, not estimated."""
        start = self.start
        theta = np.c_[start.base, start.offsets, start.radii, start.zeros].ravel()
        covariances = self.pose_covariances + leg_sigma**2 * np.eye(LEGS)
        weights = np.asarray(np.linalg.inv(np.linalg.cholesky(covariances)), dtype=np.float64)  # W Σ Wᵀ = 1
        sigmas = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
        free, gauges = _identifiable(self._jacobian(theta), sigmas, wanted, limit)
        bound: list[int] = []
        residual, converged = self._residuals(theta), False
        for _ in range(OPTIONS.rounds):
            a, b = _whitened(self._jacobian(theta), weights), (weights @ residual[..., None]).ravel()
            step, bound = _bounded_step(a, b, theta, free)
            change = np.zeros(len(PARAMETERS))
            change[[k for k in free if k not in bound]] = step
            converged = bool(np.abs(change).max(initial=0.0) < OPTIONS.settled * max(1.0, float(np.abs(theta).max())))
            theta, residual = self._moved(theta, change, float(b @ b), weights)
            if converged:
                break
        a, b = _whitened(self._jacobian(theta), weights), (weights @ residual[..., None]).ravel()
        inner = [k for k in free if k not in bound]
        freedom, chi_square = residual.size - len(inner), float(b @ b)
        if not known:
            if freedom <= 0:
                raise ArrayError(
                    f"{residual.size} readings cannot tell their own errors from {len(inner)} parameters",
                    expected="more poses, or leg_sigma",
                )
            columns = _whitened(self._jacobian(theta), np.eye(LEGS)).reshape(-1, LEGS, LEGS * _EACH)[..., inner]
            longest = float(np.abs(self.readings).max())
            leg_sigma = restricted_sigma(columns, residual, self.pose_covariances, longest)
        covariance = np.zeros((len(PARAMETERS), len(PARAMETERS)))
        if inner:
            r = np.linalg.qr(a[:, inner], mode="r")
            half = np.linalg.solve(r, np.eye(len(inner)))
            covariance[np.ix_(inner, inner)] = half @ half.T
        return Calibration(
            machine=_machine(theta),
            covariance=covariance,
            identified=tuple(PARAMETERS[k] for k in sorted(inner)),
            held=tuple(name for k, name in enumerate(PARAMETERS) if k not in inner),
            gauges=gauges,
            at_bound=tuple(PARAMETERS[k] for k in bound),
            residuals=residual,
            leg_sigma=leg_sigma,
            chi_square=chi_square,
            freedom=freedom,
            converged=converged,
        )

    def _moved(self, theta: Floats, change: Floats, cost: float, weights: Floats) -> tuple[Floats, Floats]:
        """Return the parameters after the change, or so much of it as does not raise the cost, and the residuals."""
        share = 1.0
        while True:
            trial = theta + share * change
            trial[_RADIUS::_EACH] = np.maximum(trial[_RADIUS::_EACH], 0.0)
            residual = self._residuals(trial)
            b = (weights @ residual[..., None]).ravel()
            if float(b @ b) <= cost * (1.0 + 1e-12) + 1e-300 or share < 1e-6:
                return trial, residual
            share *= 0.5

    def _residuals(self, theta: Floats) -> Floats:
        return self.readings - _machine(theta).leg_lengths(self.p, self.i)

    def _jacobian(self, theta: Floats) -> Floats:
        """Return ∂reading_k/∂(x, y, z, offset, radius, zero) of leg k (N, 5, 6)."""
        machine = _machine(theta)
        d = machine.base - self.p[:, None]
        t = np.einsum("nkc,nc->nk", d, self.i)
        rho = np.linalg.norm(d - t[..., None] * self.i[:, None], axis=-1)
        along, across = t - machine.offsets, rho - machine.radii
        length = np.hypot(along, across)
        by_base = -machine.jacobian(self.p, self.i)[..., :3]
        rest = np.stack([-along / length, -across / length, np.ones_like(length)], axis=-1)
        return np.concatenate([by_base, rest], axis=-1)


def _whitened(columns: Floats, weights: Floats) -> Floats:
    """Return the whitened derivatives by all parameters (5 N, 30), of those (N, 5, 6) of each leg by its own."""
    return (weights[..., None] * columns[:, None]).reshape(-1, len(PARAMETERS))


def _identifiable(
    columns: Floats, sigmas: Floats, wanted: list[int], limit: float
) -> tuple[list[int], tuple[str, ...]]:
    """Return the indices of the identifiable parameters, and the gauge freedoms by name.

    columns (N, 5, 6): derivatives of the readings, sigmas (N, 5) their errors. Legs share no parameter, so each is
    treated by itself: in the order wanted, a parameter is identifiable if the part of its column that is orthogonal to
    those before it determines it.
    """
    free: list[int] = []
    gauges: list[str] = []
    for leg in range(LEGS):
        a = columns[:, leg] / sigmas[:, leg, None]
        taken: list[int] = []
        for kind in wanted:
            others = np.linalg.lstsq(a[:, taken], a[:, kind], rcond=None)[0] if taken else np.zeros(0)
            left = a[:, kind] - a[:, taken] @ others
            rest, whole = float(np.linalg.norm(left)), float(np.linalg.norm(a[:, kind]))
            if rest * limit >= 1.0 and rest > OPTIONS.dependent * whole:
                taken.append(kind)
            else:
                terms = [
                    f"{KINDS[k]} {-c:+.3g}" for k, c in zip(taken, others, strict=True) if abs(c) > OPTIONS.negligible
                ]
                gauges.append(f"leg {leg + 1}: " + ", ".join([f"{KINDS[kind]} +1", *terms]) + " change no reading")
        free += [_EACH * leg + kind for kind in taken]
    return free, tuple(gauges)


def _bounded_step(a: Floats, b: Floats, theta: Floats, free: list[int]) -> tuple[Floats, list[int]]:
    """Return the Gauss-Newton step of those free parameters that no bound holds, and the radii held at 0."""
    bound: list[int] = []
    while True:
        inner = [k for k in free if k not in bound]
        step: Floats = np.asarray(np.linalg.lstsq(a[:, inner], b, rcond=None)[0] if inner else (), dtype=np.float64)
        out = [k for k, s in zip(inner, step, strict=True) if k % _EACH == _RADIUS and theta[k] <= 0.0 and s < 0.0]
        if not out:
            return step, bound
        bound += out


def _machine(theta: Floats) -> AsBuiltPentapod:
    rows = theta.reshape(LEGS, _EACH)
    return AsBuiltPentapod(rows[:, :3], rows[:, 3], rows[:, 4], rows[:, _ZERO])


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
