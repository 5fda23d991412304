"""The one place that speaks to toppra: the largest ṡ² along a grid, from rest to rest.

toppra compares with absolute tolerances (1e-8 and the like), so what it is given has no units: squared
speeds are of order one, and so are the path accelerations that the limits allow. Metres with
micrometre-long motions fail every time otherwise.
"""

from __future__ import annotations

import logging
import warnings
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.arrays import Floats


@dataclass(frozen=True)
class Failure:
    """Why there is no law: the gridpoint where the solver stopped, and its reason."""

    gridpoint: int
    reason: str


def fastest(s: Floats, first: Floats, second: Floats, ceiling: Floats) -> Floats | Failure:
    """Return the largest x = ṡ² (N + 1,) at gridpoints s (N + 1,), zero at both ends (TOPP-RA).

    |first · u + second · x| ≤ 1 at both ends of each stage (rows (N + 1, 5): leg derivatives over leg
    acceleration limits), 0 ≤ x ≤ ceiling (N + 1,), x piecewise linear in s.
    """
    x_unit, s_unit = _units(s, first, ceiling)
    problem = _Problem(
        s / s_unit, first * (x_unit / s_unit), second * x_unit, np.minimum(ceiling / x_unit, 1e4), x_unit
    )
    return problem.solve()


def _units(s: Floats, first: Floats, ceiling: Floats) -> tuple[float, float]:
    """Return units of x in m²/s² and of s in m: x is reached from rest over one unit of s."""
    slowness = np.abs(first).max(axis=1)
    typical = float(np.median(slowness[slowness > 0.0])) if (slowness > 0.0).any() else 0.0
    x_unit, length = float(ceiling.max()), float(s[-1])
    if typical <= 0.0:
        return x_unit, length
    x_unit = min(x_unit, 2.0 * length / typical)
    return x_unit, x_unit * typical


@dataclass(frozen=True, eq=False)
class _Problem:
    grid: Floats
    first: Floats
    second: Floats
    ceiling: Floats
    x_unit: float

    def solve(self) -> Floats | Failure:
        with _quiet():
            from toppra.algorithm import TOPPRA  # noqa: PLC0415 (heavy: imported when needed)

            instance: Any = TOPPRA([_constraint(self)], _Interval(self.grid), self.grid, solver_wrapper="seidel")
            _, speeds, _, controllable = instance.compute_parameterization(0.0, 0.0, return_data=True)
        lost = np.isnan(controllable).any(axis=1)
        if lost.any():
            return Failure(int(np.argmax(lost)), "from here no law comes to rest at the end (not controllable)")
        if speeds is None:
            return Failure(0, "a start from rest is not among the controllable speeds")
        x = np.square(np.asarray(speeds, dtype=np.float64))
        if np.isnan(x).any():
            return Failure(int(np.argmax(np.isnan(x))), "the forward pass found no speed (numerical)")
        x[[0, -1]] = 0.0
        still = (x[:-1] + x[1:]) <= 0.0
        if still.any():
            return Failure(int(np.argmax(still)), "the motion comes to a standstill")
        return x * self.x_unit


@dataclass(frozen=True, eq=False)
class _Interval:
    """All that toppra asks of a path when its constraints know their own coefficients."""

    grid: Floats
    dof: int = 5

    @property
    def path_interval(self) -> tuple[float, float]:
        return float(self.grid[0]), float(self.grid[-1])


def _constraint(problem: _Problem) -> Any:
    from toppra.constraint import LinearConstraint  # noqa: PLC0415
    from toppra.constraint.linear_constraint import canlinear_colloc_to_interpolate  # noqa: PLC0415

    class LegLimitsAndCeiling(LinearConstraint):  # type: ignore[misc]
        """Unit leg accelerations at both ends of each stage, and an upper bound of x."""

        def __init__(self) -> None:
            super().__init__()
            self.dof = 5
            self.identical = True
            self._format_string = ""

        def compute_constraint_params(self, path: Any, gridpoints: Any, *args: Any, **kwargs: Any) -> Any:
            x_bounds = np.stack([np.zeros_like(problem.ceiling), problem.ceiling], axis=1)
            unit = np.concatenate([np.eye(5), -np.eye(5)])
            none = np.zeros_like(problem.first)
            rows: Any = canlinear_colloc_to_interpolate(
                problem.first, problem.second, none, unit, np.ones(10), None, None, gridpoints, identical=True
            )
            return (*rows[:5], None, x_bounds)

    return LegLimitsAndCeiling()


@contextmanager
def _quiet() -> Generator[None]:
    """Keep toppra's log records and its imports' warnings to ourselves: failures come back as values."""
    logger = logging.getLogger("toppra")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.setLevel(level)
