"""Interpolant: a controller's interpolation of setpoints at equal periods, as polynomials with exact extrema."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.bernstein import multiply, split

Interpolation = Literal["linear", "cubic"]
"""How a controller moves between setpoints."""

BISECTION_ROUNDS = 60
"""Rounds of `largest_length`; the precision of numbers is reached after about fifty."""

RELATIVE_ERROR = 1e-13
"""Of the length that `largest_length` returns."""


@dataclass(frozen=True, eq=False)
class Interpolant:
    """One polynomial for each of d columns and each of the N − 1 intervals between rows; rest before and after.

    bernstein (N − 1, d, k + 1): Bernstein coefficients in the interval's own time in [0, 1]; k = 1 for linear
    interpolation, 3 for cubic. period in seconds.
    """

    bernstein: Floats
    period: float

    @classmethod
    def through(cls, rows: Floats, period: float, interpolation: Interpolation) -> Interpolant:
        """Return the interpolant of rows (N, d): straight lines, or the C2 cubic spline with zero end velocities."""
        return cls.along(rows, clamped_slopes(rows) if interpolation == "cubic" else None, period)

    @classmethod
    def along(cls, rows: Floats, slopes: Floats | None, period: float) -> Interpolant:
        """Return the cubic Hermite interpolant of rows (N, d) with slopes (N, d) per row; without slopes, lines."""
        if slopes is None:
            return cls(np.stack([rows[:-1], rows[1:]], axis=-1), period)
        third = slopes / 3.0
        inner = (rows[:-1], rows[:-1] + third[:-1], rows[1:] - third[1:], rows[1:])
        return cls(np.stack(inner, axis=-1), period)

    @property
    def degree(self) -> int:
        """Degree of the polynomials: 1 or 3."""
        return self.bernstein.shape[-1] - 1

    @cached_property
    def halves(self) -> Floats:
        """Values (2N − 1, d) at the rows and halfway between them."""
        b = self.bernstein
        weights = np.array([0.5, 0.5]) if self.degree == 1 else np.array([1.0, 3.0, 3.0, 1.0]) / 8.0
        values = np.empty((2 * len(b) + 1, b.shape[1]))
        values[:-1:2], values[1::2], values[-1] = b[..., 0], b @ weights, b[-1, :, -1]
        return values

    @cached_property
    def ranges(self) -> tuple[Floats, Floats]:
        """Least and largest value (N − 1, d) on each interval."""
        b = self.bernstein
        low, high = np.minimum(b[..., 0], b[..., -1]), np.maximum(b[..., 0], b[..., -1])
        if self.degree == 3:
            for t in _roots(self._steps):
                value = _cubic(b, t)
                low, high = np.minimum(low, value), np.maximum(high, value)
        return low, high

    @cached_property
    def rates(self) -> Floats:
        """Largest |rate| (N − 1, d) on each interval, per second."""
        if self.degree == 1:
            return np.abs(self.steps[..., 0])
        from pentapod.geometry.interpolant_kernels import cubic_rates  # noqa: PLC0415 - loads numba

        found = np.empty(self.bernstein.shape[:2])
        cubic_rates(self.bernstein, self.period, found)
        return found

    @cached_property
    def first(self) -> Floats:
        """Signed rates (N, d) at the rows, per second; for lines those of the interval before, and 0 at first."""
        if self.degree == 1:
            return np.concatenate([np.zeros((1, self.bernstein.shape[1])), self.steps[..., 0]])
        return np.concatenate([self.steps[..., 0], self.steps[-1:, :, -1]])

    @cached_property
    def accelerations(self) -> Floats:
        """Largest |acceleration| (N, d) at each row, per s²; nothing between the rows exceeds it.

        Linear: the second difference of the rows over the period squared, at rest before and after. Cubic: the second
        derivative, which is linear between the rows.
        """
        return np.abs(self.second)

    @cached_property
    def second(self) -> Floats:
        """Signed accelerations (N, d) at the rows, see `accelerations`, per s²."""
        still = np.zeros((1, self.bernstein.shape[1]))
        if self.degree == 1:
            return np.diff(np.concatenate([still, self._steps[..., 0], still]), axis=0) / self.period**2
        from pentapod.geometry.interpolant_kernels import cubic_accelerations  # noqa: PLC0415 - loads numba

        rows = np.empty((len(self.bernstein) + 1, self.bernstein.shape[1]))
        cubic_accelerations(self.bernstein, self.period, rows)
        return rows

    @cached_property
    def jerks(self) -> Floats:
        """|Jerk| (N − 1, d) on each interval, per s³: the change of the rows' accelerations over the period.

        A step of the acceleration at the start or the end counts as a change over one period.
        """
        a = self.second
        jerk = np.abs(np.diff(a, axis=0))
        jerk[0], jerk[-1] = np.maximum(jerk[0], np.abs(a[0])), np.maximum(jerk[-1], np.abs(a[-1]))
        return jerk / self.period

    @cached_property
    def jerk_lengths(self) -> Floats:
        """Length (N − 1,) of the jerk vector of a point with d coordinates on each interval, see `jerks`, per s³."""
        a = self.second
        jerk = np.linalg.norm(np.diff(a, axis=0), axis=1)
        ends = np.linalg.norm(a[[0, -1]], axis=1)
        jerk[0], jerk[-1] = max(jerk[0], ends[0]), max(jerk[-1], ends[1])
        return jerk / self.period

    @cached_property
    def turn_accelerations(self) -> Floats:
        """Angular acceleration (N,) at each row, rad/s², where the rows (N, 3) are unit vectors."""
        axes = np.concatenate([self.bernstein[..., 0], self.bernstein[-1:, :, -1]])
        return np.linalg.norm(np.cross(axes, self.second), axis=1)

    @cached_property
    def steps(self) -> Floats:
        """Bernstein coefficients (N − 1, d, k) of the rates, per second."""
        return self._steps / self.period

    @cached_property
    def _steps(self) -> Floats:
        return self.degree * np.diff(self.bernstein, axis=-1)


def largest_length(vectors: Floats) -> tuple[float, int]:
    """Return the maximum of |v(t)| over M vectors of polynomials, t in [0, 1], and the index of its vector.

    vectors (M, d, n + 1): Bernstein coefficients. Branch and bound on |v|²: its coefficients enclose it, and its end
    coefficients are values.
    """
    # No coefficient of |v|² is larger than that of the longest coefficient of v: most vectors are out at once.
    lengths = np.square(vectors).sum(axis=1)
    likely = lengths[:, [0, -1]].max(initial=0.0) * (1.0 - RELATIVE_ERROR)
    owners = np.flatnonzero(~(lengths.max(axis=1) < likely))
    square = multiply(vectors[owners], vectors[owners]).sum(axis=1)
    best, where = 0.0, 0
    for _ in range(BISECTION_ROUNDS):
        ends = np.maximum(square[:, 0], square[:, -1])
        k = int(np.argmax(ends))
        if ends[k] > best:
            best, where = float(ends[k]), int(owners[k])
        open_ = square.max(axis=1) > best * (1.0 + RELATIVE_ERROR)
        if not open_.any():
            break
        square, owners = np.concatenate(split(square[open_])), np.tile(owners[open_], 2)
    return float(np.sqrt(best)), where


def clamped_slopes(rows: Floats) -> Floats:
    """Return slopes (N, d), per row, of the C2 cubic spline through rows (N, d) from rest to rest."""
    from pentapod.geometry.interpolant_kernels import spline_slopes  # noqa: PLC0415 - loads numba

    slopes = np.empty(rows.shape)
    spline_slopes(np.require(rows, np.float64, ["C", "W"]), slopes)
    return slopes


def _roots(quadratic: Floats) -> tuple[Floats, Floats]:
    """Return both roots (...) in (0, 1) of quadratics in Bernstein form (..., 3); 0 where there is none."""
    a = quadratic[..., 0] - 2.0 * quadratic[..., 1] + quadratic[..., 2]
    half_b = quadratic[..., 1] - quadratic[..., 0]
    c = quadratic[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        # The two quotients without cancellation.
        q = -(half_b + np.copysign(np.sqrt(half_b * half_b - a * c), half_b))
        roots = q / a, c / q
    first, second = (np.where((t > 0.0) & (t < 1.0), t, 0.0) for t in roots)
    return first, second


def _cubic(b: Floats, t: Floats) -> Floats:
    """Return the values (...) of cubics in Bernstein form (..., 4) at t (...)."""
    s = 1.0 - t
    return s**3 * b[..., 0] + 3 * s * s * t * b[..., 1] + 3 * s * t * t * b[..., 2] + t**3 * b[..., 3]
