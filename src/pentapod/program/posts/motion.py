"""Motion of the legs between a program's rows: velocities and accelerations of the spline through them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats
from pentapod.geometry.interpolant import Interpolant
from pentapod.program.program import Program


def velocities(program: Program) -> Floats:
    """Return leg velocities (N, n_legs) in m/s at the rows: of the C2 cubic spline through them, from rest to rest.

    Drives that interpolate positions and velocities by cubics follow that spline. With linear interpolation there is no
    velocity at a row; then the spline is the smooth curve closest to the program.
    """
    return Interpolant.through(program.legs, program.period, "cubic").first


def accelerations(program: Program) -> Floats:
    """Return leg accelerations (N, n_legs) in m/s² at the rows, of the same spline."""
    return Interpolant.through(program.legs, program.period, "cubic").second


def lengths_at(program: Program, times: ArrayLike) -> Floats:
    """Return leg lengths (M, n_legs) in metres at times (M,) in seconds, by the interpolation of the program."""
    joined = Interpolant.through(program.legs, program.period, program.interpolation)
    exact = np.asarray(times, dtype=np.float64) / program.period
    k = np.clip(np.floor(exact).astype(np.intp), 0, len(program.legs) - 2)
    values, t = joined.bernstein[k], np.clip(exact - k, 0.0, 1.0)[:, None]
    # De Casteljau's algorithm: stable, and exact at the ends.
    while values.shape[-1] > 1:
        values = values[..., :-1] + t[..., None] * np.diff(values, axis=-1)
    return values[..., 0]
