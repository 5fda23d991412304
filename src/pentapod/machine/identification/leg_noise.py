"""The standard deviation of leg readings, estimated from the residuals of a fit by restricted maximum likelihood.

The readings of a pose have the covariance Σ = σ² 1 + P, where P comes from the errors of the measured pose. There is no
closed form for σ, and the fitted parameters take up part of the residuals. The restricted likelihood is that of all
combinations of the readings which the parameters do not change.

Source: H. D. Patterson, R. Thompson, "Recovery of inter-block information when block sizes are unequal", Biometrika 58
(1971).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from pentapod.base.arrays import Floats


@dataclass(frozen=True)
class NoiseOptions:
    """How σ is searched for.

    grid: values tried first, for the likelihood may have more than one maximum. least_share: least σ, as a share of the
    largest error that the poses cause: below it Σ is no longer regular in floating point. tolerance: of log σ².
    """

    grid: int = 24
    least_share: float = 1e-6
    tolerance: float = 1e-4


def restricted_sigma(
    columns: Floats,
    residual: Floats,
    pose_covariances: Floats,
    longest: float,
    options: NoiseOptions = NoiseOptions(),
) -> float:
    """Return σ of the readings, metres.

    columns (N, 5, m): derivatives of the readings by the m fitted parameters, m < 5 N. residual (N, 5), metres.
    pose_covariances (N, 5, 5): P, m². longest: the longest reading, metres; its rounding is the least σ. The parameters
    are fitted anew for every σ that is tried, with the same `columns`.
    """
    values, vectors = np.linalg.eigh(pose_covariances)
    by_pose = vectors.swapaxes(1, 2)
    a = (by_pose @ columns).reshape(-1, columns.shape[-1])
    b = (by_pose @ residual[..., None]).ravel()
    added = np.maximum(values.ravel(), 0.0)
    q = np.linalg.qr(a)[0]
    loose = b - q @ (q.T @ b)
    spread = float(loose @ loose) / (b.size - a.shape[1])
    least = max(2.0**-53 * longest, options.least_share * float(np.sqrt(added.max(initial=0.0))))
    low, high = 2.0 * np.log(least), np.log(16.0 * max(spread, least * least))

    def cost(log_variance: float) -> float:
        """Return −2 log of the restricted likelihood, up to a constant."""
        variance = added + np.exp(log_variance)
        weight = 1.0 / np.sqrt(variance)
        q, r = np.linalg.qr(weight[:, None] * a)
        error = weight * b
        error = error - q @ (q.T @ error)
        largest = 2.0 * float(np.log(np.abs(np.diagonal(r))).sum())
        return float(np.log(variance).sum()) + largest + float(error @ error)

    grid = np.linspace(low, high, options.grid)
    best = int(np.argmin([cost(at) for at in grid]))
    around = (grid[max(best - 1, 0)], grid[min(best + 1, options.grid - 1)])
    found = minimize_scalar(cost, bounds=around, method="bounded", options={"xatol": options.tolerance})
    return max(float(np.exp(0.5 * found.x)), least)
