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

_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(6)


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
        """Return the curve of a C3 spline of tilt centres and axes (6 columns). Raises ToolpathError at rest."""
        knots = np.unique(spline.t)
        powers = [spline(knots[:-1], k) / factorial(k) for k in range(spline.k, -1, -1)]
        curve = PPoly(np.stack(powers), knots)
        return cls(curve, _parameter_over_length(curve, tilt_centre), tilt_centre)

    @property
    def length(self) -> float:
        """Length in s, metres."""
        return float(self.parameter.x[-1])

    @property
    def knots(self) -> Floats:
        """Stations at which the fourth derivative may jump, with both ends."""
        return self.arc_length(self.curve.x)

    def arc_length(self, u: Floats) -> Floats:
        """Return the station s at spline parameters u that are knots."""
        nodes = self.parameter(self.parameter.x)
        return np.asarray(np.interp(u, nodes, self.parameter.x), dtype=np.float64)

    def tip_length(self, s: Floats) -> Floats:
        """Return the path length (n,) of the tip alone from the start to stations s (n,), metres."""
        return np.asarray(self._tip_length(np.clip(s, 0.0, self.length)), dtype=np.float64)

    def __call__(self, s: Floats, order: int) -> tuple[Floats, Floats]:
        """Return the derivatives of the given order (0 to 3) of tip and axis with respect to s, (n, 3) each."""
        return self.derivatives(s, order)[-1]

    def derivatives(self, s: Floats, order: int) -> list[tuple[Floats, Floats]]:
        """Return tip and axis (n, 3) and their derivatives with respect to s, up to `order` ≤ 3."""
        s = np.clip(np.asarray(s, dtype=np.float64), 0.0, self.length)
        u = np.clip(self.parameter(s), self.curve.x[0], self.curve.x[-1])
        tip, axis = _tip_and_axis(self.curve, u, self.tilt_centre, order)
        by_u = [self.parameter(s, k)[:, None] for k in range(1, order + 1)]
        return list(zip(_chain(tip, by_u), _chain(axis, by_u), strict=True))

    @cached_property
    def _tip_length(self) -> CubicHermiteSpline:
        nodes = self.parameter.x
        half = 0.5 * np.diff(nodes)
        at = nodes[:-1, None] + half[:, None] * (1.0 + _GAUSS_X)
        speed = np.linalg.norm(self(at.ravel(), 1)[0], axis=1).reshape(at.shape)
        way = np.concatenate([[0.0], np.cumsum(half * (speed @ _GAUSS_W))])
        return CubicHermiteSpline(nodes, way, np.linalg.norm(self(nodes, 1)[0], axis=1))


def _chain(values: list[Floats], by_u: list[Floats]) -> list[Floats]:
    """Return derivatives with respect to s from those with respect to u and the derivatives of u(s)."""
    by_s = [
        lambda: values[0],
        lambda: values[1] * by_u[0],
        lambda: values[2] * by_u[0] ** 2 + values[1] * by_u[1],
        lambda: values[3] * by_u[0] ** 3 + 3.0 * values[2] * by_u[0] * by_u[1] + values[1] * by_u[2],
    ]
    return [derivative() for derivative in by_s[: len(values)]]


def _tip_and_axis(curve: PPoly, u: Floats, tilt_centre: float, order: int) -> tuple[list[Floats], list[Floats]]:
    """Return tip and unit axis and their derivatives up to `order` (≤ 3) with respect to u."""
    values = [curve(u, k) for k in range(order + 1)]
    r = [v[:, 3:] for v in values]
    axis = _directions(r)
    return [v[:, :3] - tilt_centre * a for v, a in zip(values, axis, strict=True)], axis


def _directions(r: list[Floats]) -> list[Floats]:
    """Return the unit vectors a = r/n of vectors r[0] (n, 3), and their derivatives from those of r (up to r[3]).

    From a n = r and n² = r · r, differentiated as often as needed.
    """
    n = np.linalg.norm(r[0], axis=1, keepdims=True)
    a = [r[0] / n]
    if len(r) == 1:
        return a
    n1 = _dot(a[0], r[1])
    a.append((r[1] - n1 * a[0]) / n)
    if len(r) == 2:
        return a
    n2 = (_dot(r[1], r[1]) + _dot(r[0], r[2]) - n1 * n1) / n
    a.append((r[2] - 2.0 * n1 * a[1] - n2 * a[0]) / n)
    if len(r) == 3:
        return a
    n3 = (3.0 * _dot(r[1], r[2]) + _dot(r[0], r[3]) - 3.0 * n1 * n2) / n
    a.append((r[3] - 3.0 * n1 * a[2] - 3.0 * n2 * a[1] - n3 * a[0]) / n)
    return a


def _speed(curve: PPoly, u: Floats, tilt_centre: float, order: int) -> list[Floats]:
    """Return ds/du and its derivatives up to `order` (≤ 2) with respect to u."""
    tip, axis = _tip_and_axis(curve, u, tilt_centre, order + 1)

    def product(j: int, k: int) -> Floats:
        return (_dot(tip[j], tip[k]) + REORIENTATION_LEVER_M**2 * _dot(axis[j], axis[k]))[:, 0]

    speeds = [np.sqrt(product(1, 1))]
    if order >= 1:
        speeds.append(product(1, 2) / speeds[0])
    if order >= 2:
        speeds.append((product(2, 2) + product(1, 3) - speeds[1] ** 2) / speeds[0])
    return speeds


def _parameter_over_length(curve: PPoly, tilt_centre: float) -> PPoly:
    """Return u(s): pieces of degree 7, exact u, u′, u″, u‴ at nodes dense enough for ARC_LENGTH_ERROR."""
    nodes = curve.x
    slowest = float(_speed(curve, nodes, tilt_centre, 0)[0].min())
    if slowest < 1e-6:
        what = "the tool stands still somewhere on the path"
        raise ToolpathError(what, expected="a motion of tip or axis between waypoints")
    error = np.ones(1)
    for _ in range(12):
        widths = np.diff(nodes)
        at = nodes[:-1, None] + 0.5 * widths[:, None] * (1.0 + _GAUSS_X)
        lengths = 0.5 * widths * (_speed(curve, at.ravel(), tilt_centre, 0)[0].reshape(at.shape) @ _GAUSS_W)
        s = np.concatenate([[0.0], np.cumsum(lengths)])
        v, v1, v2 = _speed(curve, nodes, tilt_centre, 2)
        u_of_s = _septic(s, [nodes, 1.0 / v, -v1 / v**3, (3.0 * v1**2 - v * v2) / v**5.0])
        between = (s[:-1, None] + np.diff(s)[:, None] * np.array([0.25, 0.5, 0.75])).ravel()
        relative = np.abs(u_of_s(between, 1) * _speed(curve, u_of_s(between), tilt_centre, 0)[0] - 1.0)
        error = relative.reshape(-1, 3).max(axis=1)
        if error.max() <= ARC_LENGTH_ERROR:
            return u_of_s
        nodes = np.sort(np.concatenate([nodes, 0.5 * (nodes[:-1] + nodes[1:])[error > ARC_LENGTH_ERROR]]))
    raise ToolpathError("the path bends too sharply to measure its length", value=float(error.max()))


_SEPTIC = np.array(
    [[35.0, -15.0, 2.5, -1.0 / 6.0], [-84.0, 39.0, -7.0, 0.5], [70.0, -34.0, 6.5, -0.5], [-20.0, 10.0, -2.0, 1.0 / 6.0]]
)
"""Coefficients of τ⁴ to τ⁷ from the errors at τ = 1, in value and 3 derivatives, of the cubic from the left end."""


def _septic(x: Floats, y: list[Floats]) -> PPoly:
    """Return the C3 piecewise polynomial of degree 7 with value and 3 derivatives y (4 of (n,)) at x (n,)."""
    h = np.diff(x)
    scale = np.array([h**k for k in range(4)])
    a = np.array([value[:-1] for value in y]) * scale
    a[2], a[3] = a[2] / 2.0, a[3] / 6.0
    errors = np.array([value[1:] for value in y]) * scale - np.array(
        [a[0] + a[1] + a[2] + a[3], a[1] + 2.0 * a[2] + 3.0 * a[3], 2.0 * a[2] + 6.0 * a[3], 6.0 * a[3]]
    )
    powers = np.concatenate([a, _SEPTIC @ errors]) / np.array([h**k for k in range(8)])
    return PPoly(powers[::-1], x)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("ni,ni->n", a, b)[:, None]
