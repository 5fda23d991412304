"""ToolCurve: a C2 motion of pivot and tool axis, parametrised by the arc length of the tip."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
from scipy.interpolate import BSpline, PPoly

from pentapod.arrays import Floats
from pentapod.errors import ToolpathError

REORIENTATION_LEVER_M = 1e-3
"""One radian of axis counts as this much path, so that turning on the spot has a length too."""

ARC_LENGTH_ERROR = 1e-7
"""Largest relative deviation of ds from the tip's arc length."""

_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(6)


@dataclass(frozen=True, eq=False)
class ToolCurve:
    """Tip and axis as C2 functions of s, the tip's arc length in metres.

    curve: pivot and un-normalised axis (6 columns) over the spline's own parameter u; parameter: u over s.
    pivot: metres from the tip along the axis to the pivot. The arc length includes REORIENTATION_LEVER_M of path
    for each radian that the axis turns, so the tip is never faster than ds/dt.
    """

    curve: PPoly
    parameter: PPoly
    pivot: float

    @classmethod
    def of(cls, spline: BSpline, pivot: float) -> ToolCurve:
        """Build it from a spline (6 columns) of pivots and axes. Raises ToolpathError where the tool stands still."""
        knots = np.unique(spline.t)
        curve = PPoly(np.stack([spline(knots[:-1], k) / factorial(k) for k in (3, 2, 1, 0)]), knots)
        return cls(curve, _parameter_over_arc_length(curve, pivot), pivot)

    @property
    def length(self) -> float:
        """Arc length in metres."""
        return float(self.parameter.x[-1])

    @property
    def knots(self) -> Floats:
        """Arc lengths at which the third derivative may jump, both ends included."""
        return self.arc_length(self.curve.x)

    def arc_length(self, u: Floats) -> Floats:
        """Return the arc length s at spline parameters u that are knots."""
        nodes = self.parameter(self.parameter.x)
        return np.asarray(np.interp(u, nodes, self.parameter.x), dtype=np.float64)

    def __call__(self, s: Floats, order: int) -> tuple[Floats, Floats]:
        """Return the derivatives of the given order (0, 1, 2) of tip and axis with respect to s, (n, 3) each."""
        s = np.clip(np.asarray(s, dtype=np.float64), 0.0, self.length)
        u = np.clip(self.parameter(s), self.curve.x[0], self.curve.x[-1])
        tip, axis = _tip_and_axis(self.curve, u, self.pivot, order)
        if order == 0:
            return tip[0], axis[0]
        u1 = self.parameter(s, 1)[:, None]
        if order == 1:
            return tip[1] * u1, axis[1] * u1
        u2 = self.parameter(s, 2)[:, None]
        return tip[2] * u1 * u1 + tip[1] * u2, axis[2] * u1 * u1 + axis[1] * u2


def _tip_and_axis(curve: PPoly, u: Floats, pivot: float, order: int) -> tuple[list[Floats], list[Floats]]:
    """Return tip and unit axis and their derivatives up to `order` (≤ 2) with respect to u."""
    values = [curve(u, k) for k in range(order + 1)]
    raw = [v[:, 3:] for v in values]
    norm = np.linalg.norm(raw[0], axis=1, keepdims=True)
    axis = [raw[0] / norm]
    if order >= 1:
        norm1 = _dot(axis[0], raw[1])
        axis.append((raw[1] - axis[0] * norm1) / norm)
        if order >= 2:
            norm2 = (_dot(raw[1], raw[1]) + _dot(raw[0], raw[2]) - norm1 * norm1) / norm
            axis.append((raw[2] - 2.0 * norm1 * axis[1] - norm2 * axis[0]) / norm)
    return [v[:, :3] - pivot * a for v, a in zip(values, axis, strict=True)], axis


def _speed(curve: PPoly, u: Floats, pivot: float, order: int) -> list[Floats]:
    """Return ds/du, and with order 1 also d²s/du²."""
    tip, axis = _tip_and_axis(curve, u, pivot, order + 1)
    lever2 = REORIENTATION_LEVER_M**2
    speed = np.sqrt(_dot(tip[1], tip[1]) + lever2 * _dot(axis[1], axis[1]))[:, 0]
    if order == 0:
        return [speed]
    return [speed, (_dot(tip[1], tip[2]) + lever2 * _dot(axis[1], axis[2]))[:, 0] / speed]


def _parameter_over_arc_length(curve: PPoly, pivot: float) -> PPoly:
    """Return u(s): quintic pieces with exact u, u′, u″ at nodes dense enough for ARC_LENGTH_ERROR."""
    nodes = curve.x
    slowest = float(_speed(curve, nodes, pivot, 0)[0].min())
    if slowest < 1e-6:
        raise ToolpathError(
            "the tool stands still somewhere on the path",
            expected="a motion of tip or axis between waypoints",
        )
    error = np.ones(1)
    for _ in range(12):
        widths = np.diff(nodes)
        at = nodes[:-1, None] + 0.5 * widths[:, None] * (1.0 + _GAUSS_X)
        lengths = 0.5 * widths * (_speed(curve, at.ravel(), pivot, 0)[0].reshape(at.shape) @ _GAUSS_W)
        s = np.concatenate([[0.0], np.cumsum(lengths)])
        speed, change = _speed(curve, nodes, pivot, 1)
        u_of_s = _quintic(s, nodes, 1.0 / speed, -change / speed**3)
        between = (s[:-1, None] + np.diff(s)[:, None] * np.array([0.25, 0.5, 0.75])).ravel()
        error = (
            np.abs(u_of_s(between, 1) * _speed(curve, u_of_s(between), pivot, 0)[0] - 1.0).reshape(-1, 3).max(axis=1)
        )
        if error.max() <= ARC_LENGTH_ERROR:
            return u_of_s
        nodes = np.sort(np.concatenate([nodes, 0.5 * (nodes[:-1] + nodes[1:])[error > ARC_LENGTH_ERROR]]))
    raise ToolpathError("the path bends too sharply to measure its length", value=float(error.max()))


def _quintic(x: Floats, y: Floats, y1: Floats, y2: Floats) -> PPoly:
    """Return the C2 piecewise quintic with values y and derivatives y1, y2 at x (all (n,))."""
    h = np.diff(x)
    a0, a1, a2 = y[:-1], y1[:-1] * h, 0.5 * y2[:-1] * h * h
    # The rest of the polynomial in τ = (x − x_k)/h must supply these remainders at τ = 1.
    r0 = y[1:] - a0 - a1 - a2
    r1 = y1[1:] * h - a1 - 2.0 * a2
    r2 = y2[1:] * h * h - 2.0 * a2
    a3 = 10.0 * r0 - 4.0 * r1 + 0.5 * r2
    a4 = -15.0 * r0 + 7.0 * r1 - r2
    a5 = 6.0 * r0 - 3.0 * r1 + 0.5 * r2
    return PPoly(np.stack([a / h**k for k, a in zip((5, 4, 3, 2, 1, 0), (a5, a4, a3, a2, a1, a0), strict=True)]), x)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("ni,ni->n", a, b)[:, None]
