"""Generalised least squares on observations of a machine, by Gauss and Newton, with rings that stay possible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ArrayError
from pentapod.machine.calibration.parameters import KINDS, PARAMETERS
from pentapod.machine.identification.identifiable import identifiable
from pentapod.machine.identification.leg_noise import restricted_sigma
from pentapod.machine.identification.observations import Observations

GROUPS = {"base": ("x", "y", "z"), "offsets": ("offset",), "zeros": ("zero",), "radii": ("radius",)}
"""Groups of parameters, in the order in which they are identified."""

_EACH, _RADIUS = len(KINDS), KINDS.index("radius")


@dataclass(frozen=True)
class FitOptions:
    """When the iterations end.

    rounds: Gauss-Newton steps at most. settled: relative change of the unknowns below which they end, or
    still: change of all that is computed, in standard deviations of what is measured. noise_rounds:
    fits at most while leg_sigma is estimated; same_noise: its relative change below which they end. first_sigma: the
    first leg_sigma, metres. rising: relative rise of the cost that counts as rounding; least_step: share of a step
    below which it is taken although the cost rises.
    """

    rounds: int = 50
    settled: float = 1e-13
    still: float = 1e-7
    noise_rounds: int = 12
    same_noise: float = 1e-3
    first_sigma: float = 1e-6
    rising: float = 1e-12
    least_step: float = 1e-6


@dataclass(frozen=True, eq=False)
class Solution:
    """Unknowns (K,), of which `inner` were found and `bound` held at 0; covariance (K, K), zero for the others.

    residuals (N, m): scaled. leg_sigma: as given or as estimated.
    """

    theta: Floats
    covariance: Floats
    inner: tuple[int, ...]
    bound: tuple[int, ...]
    gauges: tuple[str, ...]
    residuals: Floats
    leg_sigma: float
    chi_square: float
    freedom: int
    converged: bool


def solved(
    seen: Observations,
    groups: Sequence[str],
    leg_sigma: float | None,
    limit: float,
    options: FitOptions = FitOptions(),
) -> Solution:
    """Return the best unknowns. groups: of parameters to identify. leg_sigma: metres, estimated where None.

    limit: metres; a parameter whose standard deviation, with those before it known, exceeds this is not identified.
    Raises ArrayError where the residuals cannot tell leg_sigma.
    """
    if leg_sigma is not None:
        return _solved(seen, groups, leg_sigma, limit, options, known=True)
    guess = last = options.first_sigma
    for _ in range(options.noise_rounds):  # the estimate decides what is identified, and that changes the estimate
        guess, last = _solved(seen, groups, guess, limit, options, known=False).leg_sigma, guess
        if abs(guess - last) <= options.same_noise * guess:
            break
    else:
        guess = max(guess, last)
    return _solved(seen, groups, guess, limit, options, known=True)


def _solved(
    seen: Observations, groups: Sequence[str], leg_sigma: float, limit: float, options: FitOptions, *, known: bool
) -> Solution:
    """Return the best unknowns. known: whether leg_sigma is given, not to be estimated."""
    theta = seen.start.copy()
    size = seen.instrument_covariances.shape[1]
    covariances = seen.instrument_covariances + leg_sigma**2 * np.eye(size)
    weights = np.asarray(np.linalg.inv(np.linalg.cholesky(covariances)), dtype=np.float64)  # W Σ Wᵀ = 1
    sigmas = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    names = (*PARAMETERS, *seen.extras)
    order = [
        *range(len(PARAMETERS), len(names)),
        *(k for group, kinds in GROUPS.items() if group in groups for k in _of_kinds(kinds)),
    ]
    columns = (seen.columns(theta) / sigmas[..., None]).reshape(-1, len(names))
    free, gauges = identifiable(columns, order, names, limit)
    bound: list[int] = []
    residuals, converged = seen.residuals(theta), False
    for _ in range(options.rounds):
        a, b = _whitened(seen.columns(theta), residuals, weights)
        if not (np.isfinite(a).all() and np.isfinite(b).all()):
            raise ArrayError("the fit does not converge", remedy="check component, target_mm and which leg is which")
        step, bound = _bounded_step(a, b, theta, free)
        change = np.zeros(len(names))
        change[[k for k in free if k not in bound]] = step
        far = float(np.linalg.norm(a @ change))
        small = np.abs(change).max(initial=0.0) < options.settled * max(1.0, float(np.abs(theta).max()))
        converged = bool(small or far < options.still)
        theta, residuals = _moved(seen, theta, change, float(b @ b), weights, options)
        if converged:
            break
    a, b = _whitened(seen.columns(theta), residuals, weights)
    inner = [k for k in free if k not in bound]
    freedom = residuals.size - len(inner)
    if not known:
        if freedom <= 0:
            raise ArrayError(
                f"{residuals.size} readings cannot tell their own errors from {len(inner)} parameters",
                expected="more poses, or leg_sigma",
            )
        some = seen.columns(theta)[..., inner]
        leg_sigma = restricted_sigma(some, residuals, seen.instrument_covariances, seen.longest)
    covariance = np.zeros((len(names), len(names)))
    if inner:
        r = np.linalg.qr(a[:, inner], mode="r")
        half = np.linalg.solve(r, np.eye(len(inner)))
        covariance[np.ix_(inner, inner)] = half @ half.T
    found = (theta, covariance, tuple(inner), tuple(bound), gauges, residuals)
    return Solution(*found, leg_sigma, float(b @ b), freedom, converged)


def _of_kinds(kinds: Sequence[str]) -> list[int]:
    """Return the parameters of some kinds: leg by leg, so that x, y and z of a joint come together."""
    return [k for k, name in enumerate(PARAMETERS) if name.split()[-1] in kinds]


def _whitened(columns: Floats, residuals: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Return whitened derivatives (N m, K) and residuals (N m,)."""
    return (weights @ columns).reshape(-1, columns.shape[-1]), (weights @ residuals[..., None]).ravel()


def _moved(
    seen: Observations, theta: Floats, change: Floats, cost: float, weights: Floats, options: FitOptions
) -> tuple[Floats, Floats]:
    """Return the unknowns after the change, or so much of it as does not raise the cost, and the residuals."""
    share, radii = 1.0, slice(_RADIUS, len(PARAMETERS), _EACH)
    while True:
        trial = theta + share * change
        trial[radii] = np.maximum(trial[radii], 0.0)
        residuals = seen.residuals(trial)
        b = (weights @ residuals[..., None]).ravel()
        if float(b @ b) <= cost * (1.0 + options.rising) + 1e-300 or share < options.least_step:
            return trial, residuals
        share *= 0.5


def _bounded_step(a: Floats, b: Floats, theta: Floats, free: list[int]) -> tuple[Floats, list[int]]:
    """Return the Gauss-Newton step of those free unknowns that no bound holds, and the radii held at 0."""
    bound: list[int] = []
    while True:
        inner = [k for k in free if k not in bound]
        step: Floats = np.asarray(np.linalg.lstsq(a[:, inner], b, rcond=None)[0] if inner else (), dtype=np.float64)
        rings = [(k, s) for k, s in zip(inner, step, strict=True) if k < len(PARAMETERS) and k % _EACH == _RADIUS]
        out = [k for k, s in rings if theta[k] <= 0.0 and s < 0.0]
        if not out:
            return step, bound
        bound += out
