"""Outliers: poses whose measurement contradicts all others, found one by one and named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from pentapod.base.arrays import Floats
from pentapod.base.units import from_si
from pentapod.base.values import Value
from pentapod.machine.identification.least_squares import Solution
from pentapod.machine.identification.measurements import Measurements
from pentapod.machine.identification.observations import Observations, PoseObservations


@dataclass(frozen=True)
class OutlierOptions:
    """chance: of naming a pose where all errors are as they should be. share: largest share of poses left out.

    least: metres; what is off by less is no outlier. one_leg: share of a pose's squared error from which one leg is
    named. known: share of a pose's variance that the others must leave to it; else it determines what it is judged by.
    """

    chance: float = 1e-3
    share: float = 0.2
    least: float = 1e-6
    one_leg: float = 0.8
    known: float = 1e-6


@dataclass(frozen=True)
class Outlier(Value):
    """A pose that was left out. line: of the file. off: by how much, metres. leg: whose reading, from 0; None: pose."""

    line: int
    off: float
    leg: int | None

    def __str__(self) -> str:
        by = f"{float(from_si(abs(self.off), 'mm')):.3g} mm"
        if self.leg is None:
            return f"line {self.line}: what the instrument saw is {by} off"
        return f"line {self.line}: leg {self.leg + 1} reads {by} {'more' if self.off > 0.0 else 'less'} than it should"


def without_outliers(
    measured: Measurements,
    fit: Callable[[Measurements], tuple[Observations, Solution]],
    options: OutlierOptions = OutlierOptions(),
) -> tuple[Measurements, tuple[Outlier, ...]]:
    """Return the measurements without outliers, and these.

    A pose is left out if its residuals, each compared with what the others predict, are too large for chance. The scale
    is the median's, as outliers raise every mean.
    """
    found: list[Outlier] = []
    most = int(options.share * len(measured))
    while len(found) < most:
        seen, solution = fit(measured)
        distances, deleted = _deleted(seen, solution, options)
        size = solution.residuals.shape[1]
        scale = max(float(np.median(distances)) / float(chdtri(size, 0.5)), np.finfo(float).tiny)
        worst = int(np.argmax(distances))
        if distances[worst] <= scale * float(chdtri(size, options.chance / len(measured))):
            break
        outlier = _named(measured, seen, deleted[worst], worst, options)
        if abs(outlier.off) < options.least:
            break
        found.append(outlier)
        measured = measured.some(np.arange(len(measured)) != worst)
    return measured, tuple(sorted(found, key=lambda one: one.line))


def _deleted(seen: Observations, solution: Solution, options: OutlierOptions) -> tuple[Floats, Floats]:
    """Return for each pose the squared distance (N,) from what the others predict, in sigmas, and residuals (N, m)."""
    size = solution.residuals.shape[1]
    covariances = seen.instrument_covariances + solution.leg_sigma**2 * np.eye(size)
    columns = seen.columns(solution.theta)
    # Of the residuals: what the fit has taken up of a pose's own errors is missing.
    left = covariances - columns @ solution.covariance @ columns.swapaxes(1, 2)
    residuals = solution.residuals[..., None]
    values, vectors = np.linalg.eigh(left)
    # A direction that this pose alone determines has no residual and tells nothing.
    known = values > options.known * np.linalg.eigvalsh(covariances)[:, -1:]
    inverse = (vectors * np.where(known, 1.0 / np.where(known, values, 1.0), 0.0)[:, None]) @ vectors.swapaxes(1, 2)
    distances = (residuals.swapaxes(1, 2) @ inverse @ residuals)[:, 0, 0]
    return distances, (covariances @ inverse @ residuals)[..., 0]


def _named(measured: Measurements, seen: Observations, deleted: Floats, pose: int, options: OutlierOptions) -> Outlier:
    """Return the outlier: with its leg where one leg alone explains it."""
    line = int(measured.lines[pose])
    if isinstance(seen, PoseObservations):
        leg = int(np.argmax(np.abs(deleted)))
        if deleted[leg] ** 2 >= options.one_leg * float(deleted @ deleted):
            return Outlier(line, float(deleted[leg]), leg)
    return Outlier(line, seen.off(deleted, pose), None)
