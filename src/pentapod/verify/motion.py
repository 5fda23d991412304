"""LegMotion: how the controller moves the legs between the rows of a program, as polynomials."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.arrays import Floats
from pentapod.program.program import Program


@dataclass(frozen=True, eq=False)
class LegMotion:
    """One polynomial for each leg and each of the N − 1 intervals between rows.

    bernstein (N − 1, 5, k + 1): Bernstein coefficients of the leg lengths in metres, over the interval's own
    time in [0, 1]; k = 1 for linear interpolation, 3 for cubic. period in seconds.
    """

    bernstein: Floats
    period: float

    @classmethod
    def of(cls, program: Program) -> LegMotion:
        """Return the motion between the rows of a program, as its interpolation says."""
        rows = program.legs
        if program.interpolation == "linear":
            return cls(np.stack([rows[:-1], rows[1:]], axis=-1), program.period)
        # In units of the period, so that knots are integers and the slopes have the size of the steps.
        slopes = _clamped_slopes(rows)
        third = slopes / 3.0
        inner = (rows[:-1], rows[:-1] + third[:-1], rows[1:] - third[1:], rows[1:])
        return cls(np.stack(inner, axis=-1), program.period)

    @property
    def degree(self) -> int:
        """Degree of the polynomials: 1 or 3."""
        return self.bernstein.shape[-1] - 1

    @cached_property
    def halves(self) -> Floats:
        """Leg lengths (2N − 1, 5) at the rows and halfway between them, metres."""
        b = self.bernstein
        weights = np.array([0.5, 0.5]) if self.degree == 1 else np.array([1.0, 3.0, 3.0, 1.0]) / 8.0
        legs = np.empty((2 * len(b) + 1, 5))
        legs[:-1:2], legs[1::2], legs[-1] = b[..., 0], b @ weights, b[-1, :, -1]
        return legs

    @cached_property
    def lengths(self) -> tuple[Floats, Floats]:
        """Least and largest length (N − 1, 5) of each leg on each interval: exact extrema, metres."""
        b = self.bernstein
        low, high = np.minimum(b[..., 0], b[..., -1]), np.maximum(b[..., 0], b[..., -1])
        if self.degree == 3:
            for t in _roots(self._steps):
                value = _cubic(b, t)
                low, high = np.minimum(low, value), np.maximum(high, value)
        return low, high

    @cached_property
    def rates(self) -> Floats:
        """Largest speed (N − 1, 5) of each leg on each interval: exact extrema, m/s."""
        d = self._steps / self.period
        speed = np.abs(d[..., [0, -1]]).max(axis=-1)
        if self.degree == 3:
            bend = d[..., 0] - 2.0 * d[..., 1] + d[..., 2]
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (d[..., 0] - d[..., 1]) / bend
            t = np.where((t > 0.0) & (t < 1.0), t, 0.0)
            vertex = (1 - t) ** 2 * d[..., 0] + 2 * t * (1 - t) * d[..., 1] + t * t * d[..., 2]
            speed = np.maximum(speed, np.abs(vertex))
        return speed

    @cached_property
    def accelerations(self) -> Floats:
        """Largest acceleration (N, 5) of each leg at each row, m/s²; nothing between the rows exceeds it.

        Linear: the second difference of the rows by the period squared, with the first and the last row
        repeated: the robot stands before and after. Cubic: the larger of both sides' second derivatives,
        which is linear between the rows.
        """
        if self.degree == 1:
            steps = np.concatenate([np.zeros((1, 5)), self._steps[..., 0], np.zeros((1, 5))])
            return np.abs(np.diff(steps, axis=0)) / self.period**2
        second = 2.0 * np.abs(np.diff(self._steps, axis=-1)) / self.period**2
        rows = np.zeros((len(second) + 1, 5))
        rows[:-1] = second[..., 0]
        rows[1:] = np.maximum(rows[1:], second[..., 1])
        return rows

    @property
    def _steps(self) -> Floats:
        """Bernstein coefficients (N − 1, 5, k) of the derivative, metres per period."""
        return self.degree * np.diff(self.bernstein, axis=-1)


def _clamped_slopes(rows: Floats) -> Floats:
    """Return slopes (N, 5), per row, of the C2 cubic spline through rows (N, 5) from rest to rest."""
    # scipy.interpolate takes a while to import; programs for linear controllers never need it.
    from scipy.interpolate import CubicSpline  # noqa: PLC0415

    knots = np.arange(len(rows), dtype=np.float64)
    return np.asarray(CubicSpline(knots, rows, axis=0, bc_type="clamped")(knots, 1), dtype=np.float64)


def _roots(quadratic: Floats) -> tuple[Floats, Floats]:
    """Return both roots (...) in [0, 1] of quadratics in Bernstein form (..., 3); 0 where there is none."""
    a = quadratic[..., 0] - 2.0 * quadratic[..., 1] + quadratic[..., 2]
    half_b = quadratic[..., 1] - quadratic[..., 0]
    c = quadratic[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        # The two quotients that do not cancel.
        q = -(half_b + np.copysign(np.sqrt(half_b * half_b - a * c), half_b))
        roots = q / a, c / q
    first, second = (np.where((t > 0.0) & (t < 1.0), t, 0.0) for t in roots)
    return first, second


def _cubic(b: Floats, t: Floats) -> Floats:
    """Return the values (...) of cubics in Bernstein form (..., 4) at t (...)."""
    s = 1.0 - t
    return s**3 * b[..., 0] + 3 * s * s * t * b[..., 1] + 3 * s * t * t * b[..., 2] + t**3 * b[..., 3]
