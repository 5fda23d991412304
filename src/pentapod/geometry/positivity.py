"""Lower bounds of polynomials in Bernstein form over [0, 1], by subdivision where it is needed."""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Floats
from pentapod.geometry.bernstein import split


def lower_bounds(coefficients: Floats, error: Floats, error_per_split: Floats, depth: int) -> Floats:
    """Return proven positive lower bounds (N,) of polynomials over [0, 1]; 0 where none was found.

    coefficients (N, n + 1): computed Bernstein coefficients. error (N,): how far each may be from its exact
    value. error_per_split (N,): what one halving adds to that error. depth: how often an interval may be
    halved. A polynomial is between its least and its largest coefficient on the interval, and its end
    coefficients are its values there: so a piece is done when all its coefficients exceed the error, and its
    polynomial is given up when an end value does not. Non-finite coefficients give 0.

    Raises nothing.
    """
    bounds = coefficients.min(axis=-1) - error
    refused = ~(np.minimum(coefficients[:, 0], coefficients[:, -1]) - error > 0.0) | ~np.isfinite(bounds)
    owners = np.flatnonzero(~(bounds > 0.0) & ~refused)
    bounds[owners] = np.inf  # from here on the least over the pieces that are done
    pieces, slack = coefficients[owners], error[owners]
    for _ in range(depth):
        if not owners.size:
            break
        pieces, owners = np.concatenate(split(pieces)), np.concatenate([owners, owners])
        slack = np.concatenate([slack, slack]) + error_per_split[owners]
        low = pieces.min(axis=-1) - slack
        done = low > 0.0
        np.minimum.at(bounds, owners[done], low[done])
        refused[owners[~(np.minimum(pieces[:, 0], pieces[:, -1]) - slack > 0.0)]] = True
        left = ~done & ~refused[owners]
        pieces, owners, slack = pieces[left], owners[left], slack[left]
    refused[owners] = True
    return np.where(refused | ~(bounds > 0.0), 0.0, bounds)
