"""ToolCurve: a C3 motion of tip and tool axis, parametrised by the tip's path length and the axis's turn."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import factorial

import numpy as np
from scipy.interpolate import BSpline, CubicHermiteSpline, PPoly

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError

REORIENTATION_LEVER_M = 1e-3
"""Path length of one radian of axis, metres, so that turning on the spot has a length too."""

ARC_LENGTH_ERROR = 1e-7
"""Largest relative error of ds."""

HALVINGS = 12
"""How often an interval of the parameter is halved for it at most."""

_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(6)


class TooSharpError(ToolpathError):
    """The lengths of a curve cannot be measured to ARC_LENGTH_ERROR: somewhere it nearly turns back."""


@dataclass(frozen=True, eq=False)
class ToolCurve:
    """Tip and axis as C3 functions of s in metres, ds² = |d tip|² + (REORIENTATION_LEVER_M |d axis|)².

    curve: tilt centre and un-normalised axis (6 columns) over the spline's own parameter u; parameter: u over s.
    tilt_centre: metres from the tip along the axis to the tilt centre. The tip is never faster than ds/dt, and s
    increases also where the tool turns on the spot.
    """

    curve: PPoly
    parameter: PPoly
    tilt_centre: float

    @classmethod
    def of(cls, spline: BSpline, tilt_centre: float) -> ToolCurve:
        """Return the curve of a C3 spline of tilt centres and axes (6 columns).

        Raises ToolpathError at rest, and TooSharpError.
        """
        knots = np.unique(spline.t)
        powers = [spline(knots[:-1], k) / factorial(k) for k in range(spline.k, -1, -1)]
        curve = PPoly(np.stack(powers), knots)
        return cls(curve, _parameter_over_length(curve, tilt_centre), tilt_centre)

    @property
    def length(self) -> float:
        """Length in s, metres."""
        return float(self.parameter.x[-1])

    @cached_property
    def knots(self) -> Floats:
        """Stations at which the fourth derivative may jump, with both ends."""
        return self.arc_length(self.curve.x)

    def arc_length(self, u: Floats) -> Floats:
        """Return the station s at spline parameters u that are knots, and about that at others."""
        nodes = np.append(self.parameter.c[-1], self.curve.x[-1])
        return np.asarray(np.interp(u, nodes, self.parameter.x), dtype=np.float64)

    def tip_length(self, s: Floats) -> Floats:
        """Return the path length (n,) of the tip alone from the start to stations s (n,), metres."""
        return np.asarray(self._tip_length(np.clip(s, 0.0, self.length)), dtype=np.float64)

    def __call__(self, s: Floats, order: int) -> tuple[Floats, Floats]:
        """Return the derivatives of the given order (0 to 3) of tip and axis with respect to s, (n, 3) each."""
        return self.derivatives(s, order)[-1]

    def derivatives(self, s: Floats, order: int) -> list[tuple[Floats, Floats]]:
        """Return tip and axis (n, 3) and their derivatives with respect to s, up to `order` ≤ 3."""
        from pentapod.planning.leg_path.curve_kernels import poses_along  # noqa: PLC0415 - loads numba

        tips, axes = (np.empty((order + 1, len(s), 3)) for _ in range(2))
        s = np.require(s, np.float64, ["C", "W"])
        parameter, curve = self._by_piece
        poses_along(s, self.parameter.x, parameter, self.curve.x, curve, self.tilt_centre, tips, axes)
        return list(zip(tips, axes, strict=True))

    @cached_property
    def _by_piece(self) -> tuple[Floats, Floats]:
        """The coefficients of `parameter` (m, 8) and of `curve` (k, 5, 6), those of a piece side by side."""
        return np.ascontiguousarray(self.parameter.c.T), np.ascontiguousarray(np.moveaxis(self.curve.c, 1, 0))

    @cached_property
    def _tip_length(self) -> CubicHermiteSpline:
        nodes = self.parameter.x
        half = 0.5 * np.diff(nodes)
        at = nodes[:-1, None] + half[:, None] * (1.0 + _GAUSS_X)
        speed = np.linalg.norm(self(at.ravel(), 1)[0], axis=1).reshape(at.shape)
        way = np.concatenate([[0.0], np.cumsum(half * (speed @ _GAUSS_W))])
        return CubicHermiteSpline(nodes, way, np.linalg.norm(self(nodes, 1)[0], axis=1))


def _speeds(curve: PPoly, u: Floats, tilt_centre: float, order: int) -> Floats:
    """Return ds/du and its derivatives up to `order` ≤ 2, (order + 1, n)."""
    from pentapod.planning.leg_path.curve_kernels import speeds_along  # noqa: PLC0415 - loads numba

    speeds = np.empty((order + 1, len(u)))
    speeds_along(
        u, curve.x, np.ascontiguousarray(np.moveaxis(curve.c, 1, 0)), tilt_centre, REORIENTATION_LEVER_M, speeds
    )
    return speeds


def _parameter_over_length(curve: PPoly, tilt_centre: float) -> PPoly:
    """Return u(s): pieces of degree 7, exact u, u′, u″, u‴ at nodes dense enough for ARC_LENGTH_ERROR."""
    nodes, inverse = curve.x, _inverse(curve, curve.x, tilt_centre)
    if 1.0 / float(inverse[1].max()) < 1e-6:
        what = "the tool stands still somewhere on the path"
        raise ToolpathError(what, expected="a motion of tip or axis between waypoints")
    lengths = _lengths(curve, nodes[:-1], nodes[1:], tilt_centre)
    unknown, error = np.arange(len(lengths)), np.ones(0)
    for _ in range(HALVINGS):
        powers = _septic(lengths[unknown], inverse[:, unknown], inverse[:, unknown + 1])
        error = _error(curve, powers, lengths[unknown], tilt_centre)
        coarse = unknown[error > ARC_LENGTH_ERROR]
        if not len(coarse):
            powers = _septic(lengths, inverse[:, :-1], inverse[:, 1:])
            return PPoly(powers[::-1], np.concatenate([[0.0], np.cumsum(lengths)]))
        middles = 0.5 * (nodes[coarse] + nodes[coarse + 1])
        early = _lengths(curve, nodes[coarse], middles, tilt_centre)
        late = _lengths(curve, middles, nodes[coarse + 1], tilt_centre)
        nodes = np.insert(nodes, coarse + 1, middles)
        inverse = np.insert(inverse, coarse + 1, _inverse(curve, middles, tilt_centre), axis=1)
        lengths[coarse] = early
        lengths = np.insert(lengths, coarse + 1, late)
        first = coarse + np.arange(len(coarse))
        unknown = np.sort(np.concatenate([first, first + 1]))
    raise TooSharpError("the path bends too sharply to measure its length")


def _inverse(curve: PPoly, u: Floats, tilt_centre: float) -> Floats:
    """Return u and its derivatives with respect to s, up to the third, (4, n)."""
    v, v1, v2 = _speeds(curve, u, tilt_centre, 2)
    return np.stack([u, 1.0 / v, -v1 / v**3, (3.0 * v1**2 - v * v2) / v**5.0])


def _lengths(curve: PPoly, begins: Floats, ends: Floats, tilt_centre: float) -> Floats:
    """Return the lengths (n,) in s of intervals of u, m."""
    half = 0.5 * (ends - begins)
    at = begins[:, None] + half[:, None] * (1.0 + _GAUSS_X)
    return half * (_speeds(curve, at.ravel(), tilt_centre, 0)[0].reshape(at.shape) @ _GAUSS_W)


def _error(curve: PPoly, powers: Floats, lengths: Floats, tilt_centre: float) -> Floats:
    """Return the largest relative error (n,) of ds between nodes, of polynomials u(s) with these powers (8, n)."""
    largest = np.zeros(len(lengths))
    for fraction in (0.25, 0.5, 0.75):
        u, rate = powers[-1], np.zeros(len(lengths))
        for power in powers[-2::-1]:
            rate, u = rate * (fraction * lengths) + u, u * (fraction * lengths) + power
        largest = np.maximum(largest, np.abs(rate * _speeds(curve, u, tilt_centre, 0)[0] - 1.0))
    return largest


_SEPTIC = np.array(
    [[35.0, -15.0, 2.5, -1.0 / 6.0], [-84.0, 39.0, -7.0, 0.5], [70.0, -34.0, 6.5, -0.5], [-20.0, 10.0, -2.0, 1.0 / 6.0]]
)
"""Coefficients of τ⁴ to τ⁷ from the errors at τ = 1, in value and 3 derivatives, of the cubic from the left end."""


def _septic(h: Floats, left: Floats, right: Floats) -> Floats:
    """Return the powers (8, n) of polynomials of degree 7 with values and 3 derivatives (4, n) at 0 and h (n,)."""
    scale = np.array([h**k for k in range(4)])
    a = left * scale
    a[2], a[3] = a[2] / 2.0, a[3] / 6.0
    errors = right * scale - np.array(
        [a[0] + a[1] + a[2] + a[3], a[1] + 2.0 * a[2] + 3.0 * a[3], 2.0 * a[2] + 6.0 * a[3], 6.0 * a[3]]
    )
    return np.concatenate([a, _SEPTIC @ errors]) / np.array([h**k for k in range(8)])
