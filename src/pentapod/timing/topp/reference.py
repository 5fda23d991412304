"""The toppra engine: the reference solution of the largest ṡ² along a grid.

toppra compares with absolute tolerances (1e-8 and the like), so what it is given has no units: squared speeds are of
order one, and so are the path accelerations that the limits allow. In metres, motions of micrometres fail every time.
"""

from __future__ import annotations

import logging
import math
import warnings
from collections.abc import Generator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.topp.stages import NOT_CONTROLLABLE, Failure, Stages


def solve(stages: Stages, x_start: float, x_end: float) -> Floats | Failure:
    """Return the largest x (N + 1,), or why there is none, as toppra finds it."""
    distinct = np.diff(stages.s, prepend=-np.inf) > 0.0
    s, first, second = stages.s[distinct], stages.first[distinct], stages.second[distinct]
    offset = stages.offset if len(stages.offset) == 1 else stages.offset[distinct]
    ceiling = np.minimum.reduceat(stages.ceiling, np.flatnonzero(distinct))
    x_unit, s_unit = _units(s, first, ceiling, max(x_start, x_end))
    x = _solve(
        s / s_unit,
        (first * (x_unit / s_unit), second * x_unit, np.broadcast_to(offset, first.shape)),
        np.minimum(ceiling / x_unit, 1e4),
        (x_start / x_unit, x_end / x_unit),
    )
    return x if isinstance(x, Failure) else x[np.cumsum(distinct) - 1] * x_unit


def _units(s: Floats, first: Floats, ceiling: Floats, ends: float) -> tuple[float, float]:
    """Return units of x and of s: x is reached from rest over one unit of s, or is that of the faster end."""
    slowness = np.abs(first).max(axis=1)
    typical = float(np.median(slowness[slowness > 0.0])) if (slowness > 0.0).any() else 0.0
    x_unit, length = float(ceiling.max()), float(s[-1] - s[0])
    if typical <= 0.0:
        return x_unit, length
    x_unit = min(x_unit, max(2.0 * length / typical, ends))
    return x_unit, x_unit * typical


def _solve(
    grid: Floats, rows: tuple[Floats, Floats, Floats], ceiling: Floats, ends: tuple[float, float]
) -> Floats | Failure:
    """Return toppra's x (N + 1,) for rows within ±1 (first, second, offset), all free of units."""
    with _quiet():
        from toppra.algorithm import TOPPRA  # noqa: PLC0415 (heavy: imported when needed)

        # All that toppra asks of a path when its constraints know their own coefficients.
        path = SimpleNamespace(path_interval=(float(grid[0]), float(grid[-1])), dof=rows[0].shape[1])
        instance: Any = TOPPRA([_constraint(rows, ceiling)], path, grid, solver_wrapper="seidel")
        _, speeds, _, controllable = instance.compute_parameterization(*map(math.sqrt, ends), return_data=True)
    lost = np.isnan(controllable).any(axis=1)
    if lost.any():
        return Failure(int(np.argmax(lost)), NOT_CONTROLLABLE)
    if speeds is None:
        return Failure(0, "the speed at the start is not among the controllable ones")
    x = np.square(np.asarray(speeds, dtype=np.float64))
    if np.isnan(x).any():
        return Failure(int(np.argmax(np.isnan(x))), "the forward pass found no speed (numerical)")
    x[[0, -1]] = ends
    return x


def _constraint(rows: tuple[Floats, Floats, Floats], ceiling: Floats) -> Any:
    """Return toppra's constraint: rows within ±1 at both ends of each stage, and an upper bound of x."""
    from toppra.constraint import LinearConstraint  # noqa: PLC0415
    from toppra.constraint.linear_constraint import canlinear_colloc_to_interpolate  # noqa: PLC0415

    count = rows[0].shape[1]
    unit, limits = np.concatenate([np.eye(count), -np.eye(count)]), np.ones(2 * count)

    class RowsAndCeiling(LinearConstraint):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.dof = count
            self.identical = True
            self._format_string = ""

        def compute_constraint_params(self, path: Any, gridpoints: Any, *args: Any, **kwargs: Any) -> Any:
            found: Any = canlinear_colloc_to_interpolate(*rows, unit, limits, None, None, gridpoints, identical=True)
            return (*found[:-2], None, np.stack([np.zeros_like(ceiling), ceiling], axis=1))

    return RowsAndCeiling()


@contextmanager
def _quiet() -> Generator[None]:
    """Silence toppra's log records and its imports' warnings: failures come back as values."""
    logger = logging.getLogger("toppra")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.setLevel(level)
